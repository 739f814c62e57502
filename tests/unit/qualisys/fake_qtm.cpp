#include "tests/unit/qualisys/fake_qtm.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::test {
namespace {

constexpr std::uint32_t kError = 0, kCommand = 1, kXml = 2;

TimePoint patience() {
  return transport::now() + std::chrono::seconds(10);
}

}  // namespace

FakeQtm::FakeQtm(FakeQtmSettings settings) : settings_(std::move(settings)), stop_(::eventfd(0, EFD_CLOEXEC)) {
  auto listener = transport::tcp_listen("127.0.0.1", 0);
  if (listener) listener_ = std::move(*listener);
  port_ = transport::local_port(listener_.get());
  thread_ = std::thread([this] { run(); });
}

FakeQtm::~FakeQtm() {
  ::eventfd_write(stop_.get(), 1);
  thread_.join();
}

bool FakeQtm::streaming() const {
  const std::lock_guard lock(mutex_);
  for (const Client& client : clients_) {
    if (client.open && client.streams) return true;
  }
  return false;
}

std::vector<std::string> FakeQtm::commands() const {
  const std::lock_guard lock(mutex_);
  return commands_;
}

void FakeQtm::push(const Bytes& bytes) {
  const std::lock_guard lock(mutex_);
  for (Client& client : clients_) {
    if (client.open && client.streams) send(client, bytes);
  }
}

void FakeQtm::push_datagram(const Bytes& bytes, const std::string& address) {
  const std::lock_guard lock(mutex_);
  const auto socket = transport::udp_bind(address, 0, 1 << 20);
  for (Client& client : clients_) {
    if (client.open && client.udp_port != 0 && socket) {
      (void)transport::send_datagram(socket->get(), "127.0.0.1", client.udp_port, bytes);
    }
  }
}

void FakeQtm::push_frame(const WireFrame& frame) {
  bool udp = false;
  Bytes bytes;
  {
    const std::lock_guard lock(mutex_);
    for (const Client& client : clients_) udp = udp || (client.open && client.udp_port != 0);
    bytes = wire_data(frame, settings_.order);
  }
  udp ? push_datagram(bytes) : push(bytes);
}

void FakeQtm::run() {
  while (true) {
    std::vector<pollfd> polled{{stop_.get(), POLLIN, 0}, {listener_.get(), POLLIN, 0}};
    {
      const std::lock_guard lock(mutex_);
      for (const auto& client : clients_) polled.push_back({client.open ? client.fd.get() : -1, POLLIN, 0});
    }
    ::poll(polled.data(), polled.size(), -1);
    if (polled[0].revents != 0) return;
    const std::lock_guard lock(mutex_);
    for (Client& client : clients_) {
      if (!client.open) continue;
      const auto received = transport::receive(client.fd.get(), client.input.free_space());
      if (received.status == IoStatus::kDisconnected) client.open = false;
      client.input.commit(received.size);
      for (auto packet = client.input.next(); packet && !packet->empty(); packet = client.input.next()) {
        answer(client, std::string(qualisys::decode_text(*packet, settings_.order).value()));
      }
    }
    if (auto fd = transport::tcp_accept(listener_.get())) {
      clients_.push_back({std::move(fd), qualisys::StreamReassembler(4096, settings_.order)});
      send(clients_.back(), wire_text(kCommand, "QTM RT Interface connected", settings_.order));
    }
  }
}

void FakeQtm::answer(Client& client, const std::string& command) {
  commands_.push_back(command);
  if (!settings_.answers) return;
  const auto order = settings_.order;
  if (command.starts_with("Version 1.")) {
    const int minor = std::stoi(command.substr(10));
    const bool known = minor >= 8 && minor <= settings_.newest_minor;
    if (!known) return send(client, wire_text(kError, "Version NOT supported", order));
    return send(client, wire_text(kCommand, "Version set to 1." + std::to_string(minor), order));
  }
  if (command == "GetState") return send(client, wire_event(settings_.state, order));
  if (command.starts_with("GetParameters")) return send(client, wire_text(kXml, parameters(), order));
  if (command.starts_with("StreamFrames")) {
    const auto udp = command.find("UDP:");
    if (udp != std::string::npos) client.udp_port = static_cast<std::uint16_t>(std::stoi(command.substr(udp + 4)));
    client.streams = true;  // QTM does not acknowledge
  }
}

void FakeQtm::send(Client& client, const Bytes& bytes) {
  const std::size_t step = settings_.dribble ? 1 : bytes.size();
  for (std::size_t begin = 0; begin < bytes.size() && client.open; begin += step) {
    const auto piece = std::span(bytes).subspan(begin, step);
    if (!transport::send_all(client.fd.get(), piece, patience())) client.open = false;
  }
}

std::string FakeQtm::parameters() const {
  std::string xml = "<QTM_Parameters_Ver_1.25>\r\n<General><Frequency>" + std::to_string(settings_.rate_hz) +
                    "</Frequency><RealTime_Processing_Actions>" + settings_.processing +
                    "</RealTime_Processing_Actions></General>\r\n<The_3D><AxisUpwards>" + settings_.axis +
                    "</AxisUpwards><CalibrationTime>" + settings_.calibration_time + "</CalibrationTime><Labels>" +
                    std::to_string(settings_.labels.size()) + "</Labels>";
  for (const auto& label : settings_.labels) xml += "<Label><Name>" + label + "</Name></Label>";
  return xml + "</The_3D>\r\n<The_6D>" + settings_.bodies_xml + "</The_6D></QTM_Parameters_Ver_1.25>\r\n";
}

}  // namespace embody::test
