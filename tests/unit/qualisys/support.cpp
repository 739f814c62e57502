#include "tests/unit/qualisys/support.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <cmath>
#include <list>
#include <random>

#include "drivers/qualisys/stream_reassembler.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::test {
namespace {

constexpr Duration kPatience = std::chrono::seconds(10);

}  // namespace

recording::Recording random_recording(std::vector<std::string> names, std::size_t frames, double rate_hz,
                                      unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> eighths_of_mm(-8000, 8000);
  std::bernoulli_distribution visible(0.9);
  recording::Recording recording;
  recording.rate_hz = rate_hz;
  recording.source = "random";
  for (std::size_t k = 0; k < frames; ++k) {
    std::vector<Marker> markers(names.size());
    for (auto& marker : markers) {
      if (!visible(random)) continue;
      marker.visible = true;
      for (int axis = 0; axis < 3; ++axis) marker.p_W[axis] = 0.125e-3 * eighths_of_mm(random);
    }
    recording.frames.push_back(std::move(markers));
  }
  recording.marker_names = std::move(names);
  return recording;
}

bool eventually(const std::function<bool()>& condition) {
  const auto deadline = transport::now() + kPatience;
  while (!condition()) {
    if (transport::now() >= deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

IoStatus next_frame(HandTracker& tracker, int fd, MarkerFrame& frame) {
  const auto deadline = transport::now() + kPatience;
  while (true) {
    const IoStatus status = tracker.read(frame);
    if (status != IoStatus::kEmpty || !transport::wait_readable(fd, deadline)) return status;
  }
}

ScriptedPeer::ScriptedPeer(Bytes greeting, Script script)
    : greeting_(std::move(greeting)), script_(std::move(script)), stop_(::eventfd(0, EFD_CLOEXEC)) {
  auto listener = transport::tcp_listen("127.0.0.1", 0);
  if (listener) listener_ = std::move(*listener);
  port_ = transport::local_port(listener_.get());
  thread_ = std::thread([this] { run(); });
}

ScriptedPeer::~ScriptedPeer() {
  ::eventfd_write(stop_.get(), 1);
  thread_.join();
}

void ScriptedPeer::run() {
  struct Client {
    transport::UniqueFd fd;
    qualisys::StreamReassembler input{4096};
    bool open{true};
  };
  std::list<Client> clients;
  while (true) {
    std::vector<pollfd> polled{{stop_.get(), POLLIN, 0}, {listener_.get(), POLLIN, 0}};
    for (auto& client : clients) polled.push_back({client.open ? client.fd.get() : -1, POLLIN, 0});
    ::poll(polled.data(), polled.size(), -1);
    if (polled[0].revents != 0) return;
    for (auto& client : clients) {
      const auto received = transport::receive(client.fd.get(), client.input.free_space());
      if (received.status == IoStatus::kDisconnected) client.open = false;
      client.input.commit(received.size);
      for (auto packet = client.input.next(); packet && !packet->empty(); packet = client.input.next()) {
        for (const auto& reply : script_(qualisys::decode_text(*packet).value())) {
          if (transport::send_message(client.fd.get(), reply) != IoStatus::kDone) client.open = false;
        }
      }
    }
    if (auto fd = transport::tcp_accept(listener_.get())) {
      const bool sent = greeting_.empty() || transport::send_message(fd.get(), greeting_) == IoStatus::kDone;
      clients.push_back({std::move(fd)});
      clients.back().open = sent;
    }
  }
}

Bytes welcome() {
  return qualisys::encode_text(qualisys::PacketType::kCommand, "QTM RT Interface connected");
}

ScriptedPeer::Script sound_script(std::vector<std::string> labels, ScriptedPeer::Script exception) {
  using qualisys::PacketType;
  return
      [labels = std::move(labels), exception = std::move(exception)](std::string_view command) -> std::vector<Bytes> {
        if (auto special = exception(command); !special.empty()) return special;
        if (command.starts_with("Version")) {
          return {qualisys::encode_text(PacketType::kCommand, "Version set to 1.25")};
        }
        if (command == "GetState") return {qualisys::encode_event(qualisys::Event::kConnected)};
        if (!command.starts_with("GetParameters")) return {};
        std::string xml =
            "<Q><General><Frequency>100</Frequency></General><The_3D><AxisUpwards>+Z</AxisUpwards>"
            "<CalibrationTime>2021</CalibrationTime><Labels>" +
            std::to_string(labels.size()) + "</Labels>";
        for (const auto& label : labels) xml += "<Label><Name><![CDATA[" + label + "]]></Name></Label>";
        return {qualisys::encode_text(PacketType::kXml, xml + "</The_3D></Q>")};
      };
}

}  // namespace embody::test
