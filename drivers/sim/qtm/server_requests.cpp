// The simulated QTM and its clients: who connects, what they say, and what follows from it.
#include <algorithm>
#include <array>
#include <utility>

#include "drivers/sim/qtm/server_loop.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::sim {
namespace {

constexpr std::size_t kMaxClients = 10;
constexpr int kStormEvents = 20;

}  // namespace

void QtmServer::Loop::accept_clients() {
  for (const auto& [kind, order] :
       {std::pair{Ports::kLittleEndian, ByteOrder::kLittle}, std::pair{Ports::kBigEndian, ByteOrder::kBig}}) {
    while (ports_.fd(kind) >= 0) {
      auto socket = ports_.accept(kind);
      if (!socket) break;
      auto client = std::make_unique<Client>(std::move(socket), order, next_client_id_++);
      if (clients_.size() >= kMaxClients) {
        client->send(Reply{Packet::kError, "Connection refused. Max number of clients reached."}, link_faults_);
        continue;
      }
      client->send(Reply{Packet::kCommand, "QTM RT Interface connected"}, link_faults_);
      clients_.push_back(std::move(client));
    }
  }
}

void QtmServer::Loop::refuse_legacy_clients() {
  while (ports_.fd(Ports::kLegacy) >= 0) {
    auto socket = ports_.accept(Ports::kLegacy);
    if (!socket) return;
    const std::string where = std::to_string(numbers_[Ports::kLittleEndian]);
    Client client(std::move(socket), ByteOrder::kBig, next_client_id_++);
    client.send(Reply{Packet::kError, "Protocol 1.0 is not served here. Connect to port " + where + "."}, link_faults_);
  }
}

void QtmServer::Loop::serve(Client& client) {
  std::array<std::byte, 4096> buffer;
  const auto received = transport::receive(client.fd(), buffer);
  if (received.status == IoStatus::kDisconnected) client.close();
  client.input.push(std::span(buffer).first(received.size));
  while (!client.dead()) {
    const auto request = client.input.next();
    if (!request) return client.close();
    if (!*request) return;
    answer(client, **request);
  }
}

void QtmServer::Loop::answer(Client& client, const Request& request) {
  const bool was_running = running_->studio.measurement().running();
  const Answer answer = running_->desk.answer(client.conversation, request, transport::now());
  if (answer.parameters_asked && event_storm_) storm(client);
  if (answer.reply) std::visit([&](const auto& reply) { client.send(reply, link_faults_); }, *answer.reply);
  if (answer.parameters_asked && event_storm_) storm(client);
  follow_up(client, answer, was_running);
}

void QtmServer::Loop::follow_up(Client& client, const Answer& answer, bool was_running) {
  Studio& studio = running_->studio;
  Conversation& talk = client.conversation;
  const bool runs = studio.measurement().running();
  if (answer.calibration_asked) client.awaits_calibration = true;
  if (answer.stream_changed) {
    if (const Status opened = client.open_stream(config_.allow_remote); !opened) {
      talk.stream.reset();
      client.send(Reply{Packet::kError, opened.error().detail.c_str()}, link_faults_);
    } else if (talk.stream && !runs) {
      client.send(no_more_data_packet(talk.order), link_faults_);
    }
  }
  if (answer.frame_wanted && !runs) {
    talk.current_frame.reset();
    client.send(no_more_data_packet(talk.order), link_faults_);
  } else if (answer.frame_wanted && studio.frame_tick() && studio.frame_tick() != client.last_frame) {
    client.last_frame = studio.frame_tick();
    client.send(encode_frame(studio.frame(), *std::exchange(talk.current_frame, {}), talk.order), link_faults_);
  }
  if (runs && !was_running) {
    studio.start(transport::now());
    script_next_ = 0;
    for (auto& other : clients_) other->last_frame.reset();
  }
  if (was_running && !runs) end_streams();
  tell({{}, false, answer.events});
}

void QtmServer::Loop::storm(Client& client) {
  for (int i = 0; i < kStormEvents; ++i) client.send(QtmEvent::kCameraSettingsChanged, link_faults_);
}

}  // namespace embody::sim
