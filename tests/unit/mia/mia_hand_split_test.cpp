// The same bytes in two pieces, cut anywhere, leave the driver in the same state. A scripted hand on a pseudo-terminal.
#include <gtest/gtest.h>

#include <string>
#include <thread>

#include "drivers/mia/mia_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/pty.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/tty.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

std::string ack_of(const mia::Command& command) {
  const mia::Ack ack = mia::encode_ack(command);
  return {ack.data(), ack.size()};
}

/// The hand's end of the line: takes commands, gives bytes.
struct FarEnd {
  explicit FarEnd(int master) : fd(master) {}

  std::optional<mia::Command> command(Duration limit = seconds(5)) {
    const TimePoint deadline = transport::now() + limit;
    while (true) {
      for (; taken < size; ++taken) {
        if (auto found = commands.push(static_cast<char>(buffer[taken]))) return ++taken, found;
      }
      if (!transport::wait_readable(fd, deadline)) return std::nullopt;
      const auto got = transport::read_tty(fd, buffer);
      taken = 0;
      size = got.status == IoStatus::kDone ? got.size : 0;
      if (got.status == IoStatus::kDisconnected) return std::nullopt;
    }
  }
  void say(std::string_view text) {
    ASSERT_EQ(transport::write_tty(fd, std::as_bytes(std::span(text))), IoStatus::kDone);
  }

  int fd;
  mia::CommandAssembler commands;
  std::array<std::byte, 256> buffer{};
  std::size_t taken{0}, size{0};
};

struct Bench {
  explicit Bench(mia::MiaConfig config) : pty(std::move(transport::open_pty()).value()), far(pty.master.get()) {
    config.device = pty.device;
    config.ack_timeout = seconds(2);  // only what was said counts here, not when
    config.silence_limit = seconds(60);
    hand.emplace(config);
    std::thread answering([this] {
      while (!connected) {
        const auto command = far.command(milliseconds(20));
        if (command) far.say(reply(*command));
      }
    });
    const auto got = hand->connect();
    connected = true;
    answering.join();
    EXPECT_TRUE(got.ok()) << got.error().detail.view();
    if (got) info = *got;
  }

  /// What the hand says to a command: its ACK, and data where there is some.
  std::string reply(const mia::Command& command) const {
    const mia::Request request = mia::parse_command(command);
    std::string said = ack_of(command);
    const bool read = request.kind == mia::Request::Kind::kRead;
    const bool stream = request.kind == mia::Request::Kind::kStream && request.on;
    if (read || stream) said += data(request.channel);
    return said;
  }
  std::string data(char channel) const {
    if (channel == 'P') return std::string(mia::encode_triple(mia::TripleLine::kPosition, counts).view());
    if (channel == 'C') return std::string(mia::encode_triple(mia::TripleLine::kCurrent, {11, 22, 33}).view());
    return std::string(mia::encode_strain_gauges({1, 2, 3, 4, 5, 6, 7, 8}).view());
  }

  /// Lets the driver take all of the bytes that were just said.
  void take(std::string_view piece) {
    if (piece.empty()) return;
    far.say(piece);
    ASSERT_TRUE(transport::wait_readable(info.fd, transport::now() + seconds(5)));
    while (transport::wait_readable(info.fd, transport::now())) {
      const IoStatus status = hand->read(state);
      ASSERT_NE(status, IoStatus::kDisconnected) << hand->reason();
      if (status == IoStatus::kDone) ++replies;
    }
  }

  transport::Pty pty;
  FarEnd far;
  std::optional<mia::MiaHand> hand;
  std::atomic<bool> connected{false};
  HandInfo info;
  HandDeviceState state;
  std::uint64_t replies{0};
  std::array<int, 3> counts{30, -40, 50};
};

mia::MiaConfig telling(mia::Generation generation) {
  mia::MiaConfig config;
  config.generation = generation;
  config.telemetry.every_cycles = 1;
  return config;
}

/// What must not depend on the cut.
struct Outcome {
  std::uint64_t acks, replies, mismatches, late_acks, currents, forces;
  std::array<double, 3> q_rad;
  bool operator==(const Outcome&) const = default;
};

Outcome outcome(const Bench& bench, const mia::MiaCounters& before, const mia::MiaTelemetry& told) {
  const mia::MiaCounters& now = bench.hand->counters();
  return {now.acks - before.acks,
          now.replies - before.replies,
          now.mismatches - before.mismatches,
          now.late_acks - before.late_acks,
          bench.hand->telemetry().current_samples - told.current_samples,
          bench.hand->telemetry().force_samples - told.force_samples,
          {bench.state.q_rad[0], bench.state.q_rad[1], bench.state.q_rad[2]}};
}

TEST(MiaSplit, AcknowledgingSessionCutAtEveryByte) {
  Bench bench(telling(mia::Generation::kAcknowledging));
  std::optional<Outcome> whole;
  std::size_t length = 0;
  for (std::size_t cut = 0; cut == 0 || cut < length; ++cut) {
    const mia::MiaCounters before = bench.hand->counters();
    const mia::MiaTelemetry told = bench.hand->telemetry();
    // Two cycles: three motors, the positions, currents; then positions and forces.
    const double q = cut % 2 == 0 ? 0.3 : 0.4;
    std::size_t offset = 0;
    std::string session;
    for (const std::size_t expected : {5, 2}) {
      HandCommand command;
      command.action = expected == 5 ? HandAction::kMove : HandAction::kHold;
      command.joint_count = mia::kMotors;
      command.q_rad = {q, q, q};
      command.t_expires = transport::now() + seconds(60);
      ASSERT_EQ(bench.hand->write(command, transport::now()), IoStatus::kDone);
      for (std::size_t i = 0; i < expected; ++i) {
        const auto asked = bench.far.command();
        ASSERT_TRUE(asked) << "cut " << cut << ", command " << i;
        const std::string said = bench.reply(*asked);
        session += said;
        const bool here = cut > offset && cut < offset + said.size();
        bench.take(here ? said.substr(0, cut - offset) : said);
        if (here) bench.take(said.substr(cut - offset));
        offset += said.size();
      }
    }
    length = session.size();
    const Outcome now = outcome(bench, before, told);
    if (!whole) whole = now;
    ASSERT_EQ(now, *whole) << "cut " << cut;
  }
  EXPECT_GT(length, 250u);
  EXPECT_EQ(whole->acks, 7u);
  EXPECT_EQ(whole->replies, 2u);
  EXPECT_EQ(whole->currents, 1u);
  EXPECT_EQ(whole->forces, 1u);
  EXPECT_EQ(whole->mismatches, 0u);
}

TEST(MiaSplit, StreamingSessionCutAtEveryByte) {
  Bench bench(telling(mia::Generation::kStreaming));
  ASSERT_EQ(bench.hand->generation(), mia::Generation::kStreaming);
  const std::string session = bench.data('P') + ack_of(mia::encode_plain("ADP1")) + bench.data('C') + "rubbish\n" +
                              bench.data('A') + bench.data('P');
  std::optional<Outcome> whole;
  for (std::size_t cut = 0; cut < session.size(); ++cut) {
    const mia::MiaCounters before = bench.hand->counters();
    const mia::MiaTelemetry told = bench.hand->telemetry();
    bench.take(session.substr(0, cut));
    bench.take(session.substr(cut));
    const Outcome now = outcome(bench, before, told);
    if (!whole) whole = now;
    ASSERT_EQ(now, *whole) << "cut " << cut;
  }
  EXPECT_EQ(whole->replies, 2u);
  EXPECT_EQ(whole->acks, 1u);
  EXPECT_EQ(whole->currents, 1u);
  EXPECT_EQ(whole->forces, 1u);
  EXPECT_EQ(whole->mismatches, 1u);
}

}  // namespace
}  // namespace embody::test
