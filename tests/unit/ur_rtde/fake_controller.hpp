#pragma once
// A controller that answers each request with bytes of the test's choice, for what a healthy one never says.
#include <functional>
#include <thread>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/arm_package.hpp"
#include "drivers/ur_rtde/frame_buffer.hpp"
#include "tests/unit/ur_rtde/hex.hpp"

namespace embody::test {

using ReplyBytes = std::vector<std::byte>;

/// One data package of the arm driver's recipe: running, normal, program playing, joint angles all `q_rad`.
inline ReplyBytes state_package(double timestamp_s, double q_rad = 0.0) {
  ReplyBytes package(rtde::kFieldsStart + rtde::OutputRecipe().size());
  rtde::begin_data(package, 1);
  rtde::store(package, 4, timestamp_s);
  for (std::size_t i = 0; i < 6; ++i) rtde::store(package, 12 + 8 * i, q_rad);
  for (const auto& [offset, value] : {std::pair{204, 7}, {208, 1}, {212, 1}, {216, 2}, {224, 1}, {256, 1}}) {
    rtde::store(package, static_cast<std::size_t>(offset), std::int32_t{value});
  }
  return package;
}

/// What a healthy controller answers to a request of the given type.
inline ReplyBytes healthy_reply(char type) {
  const auto types = [](std::span<const rtde::Variable> recipe) {
    std::string text;
    for (const rtde::Variable& variable : recipe) text += std::string(rtde::type_name(variable.type)) + ',';
    text.pop_back();
    return text;
  };
  switch (type) {
    case 'V':
      return hex("00 04 56 01");
    case 'v':
      return rtde::encode_controller_version({5, 12, 4, 0});
    case 'O':
      return rtde::encode_setup_reply(rtde::PackageType::kSetupOutputs, {1, types(rtde::OutputRecipe().variables())});
    case 'I':
      return rtde::encode_setup_reply(rtde::PackageType::kSetupInputs, {1, types(rtde::kInputRecipe)});
    case 'S':
      return hex("00 04 53 01");
    default:
      return {};
  }
}

class FakeController {
 public:
  using Answer = std::function<ReplyBytes(char)>;

  /// `answer` maps the type of a request to the bytes of the reply; `part` > 0 sends them in parts of that size.
  explicit FakeController(Answer answer, std::size_t part = 0) : answer_(std::move(answer)), part_(part) {
    listener_ = std::move(*transport::tcp_listen("127.0.0.1", 0));
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  [[nodiscard]] std::uint16_t port() const { return transport::local_port(listener_.get()); }

 private:
  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (!transport::wait_readable(listener_.get(), transport::now() + kTick)) continue;
      transport::UniqueFd fd = transport::tcp_accept(listener_.get());
      rtde::FrameBuffer buffer;
      while (fd && !stop.stop_requested()) serve(fd, buffer);
    }
  }
  void serve(transport::UniqueFd& fd, rtde::FrameBuffer& buffer) {
    if (!transport::wait_readable(fd.get(), transport::now() + kTick)) return;
    const auto received = transport::receive(fd.get(), buffer.space());
    if (received.status == IoStatus::kDisconnected) return fd.reset();
    buffer.commit(received.size);
    for (auto parsed = buffer.next(); parsed.framing == rtde::Framing::kComplete; parsed = buffer.next()) {
      send(fd.get(), answer_(static_cast<char>(parsed.frame.type)));
    }
  }
  void send(int fd, const ReplyBytes& bytes) const {
    const std::size_t step = part_ == 0 ? bytes.size() : part_;
    for (std::size_t i = 0; i < bytes.size(); i += step) {
      const auto part = rtde::Bytes(bytes).subspan(i, std::min(step, bytes.size() - i));
      (void)transport::send_all(fd, part, transport::now() + std::chrono::seconds(1));
    }
  }

  static constexpr Duration kTick = std::chrono::milliseconds(5);
  Answer answer_;
  std::size_t part_;
  transport::UniqueFd listener_;
  std::jthread thread_;
};

}  // namespace embody::test
