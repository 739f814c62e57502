// The simulated controller's ports 30001 to 30003, and its faults by name.
#include <gtest/gtest.h>

#include "drivers/sim/ur/controller_faults.hpp"
#include "drivers/sim/ur/script_port.hpp"
#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::sim {
namespace {

constexpr Duration kPatience = std::chrono::seconds(5);

class PrimaryClient {
 public:
  explicit PrimaryClient(std::uint16_t port) {
    fd_ = std::move(*transport::tcp_connect("127.0.0.1", port, transport::now() + kPatience));
  }
  void send(std::string_view text) {
    EXPECT_TRUE(transport::send_all(fd_.get(), std::as_bytes(std::span(text)), transport::now() + kPatience).ok());
  }
  /// The next message as bytes; empty when none comes or the connection ends.
  Message next() {
    const TimePoint deadline = transport::now() + kPatience;
    std::array<std::byte, 4096> bytes;
    while (true) {
      if (pending_.size() >= 4) {
        const std::size_t size = rtde::load<std::uint32_t>(pending_, 0);
        if (pending_.size() >= size) {
          Message message(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(size));
          pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(size));
          return message;
        }
      }
      if (!transport::wait_readable(fd_.get(), deadline)) return {};
      const auto received = transport::receive(fd_.get(), bytes);
      if (received.status == IoStatus::kDisconnected) return {};
      pending_.insert(pending_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(received.size));
    }
  }
  /// The next robot message of a kind; views `last`.
  std::optional<ur::RobotMessage> next(ur::MessageKind kind) {
    while (true) {
      last = next();
      if (last.empty()) return std::nullopt;
      const ur::PrimaryMessage message = ur::parse_primary(last);
      if (message.type != ur::kRobotMessage) continue;
      const auto decoded = ur::decode_robot_message(message.contents);
      if (decoded && decoded->is(kind)) return decoded;
    }
  }
  Message last;

 private:
  transport::UniqueFd fd_;
  Message pending_;
};

UrControllerConfig empty_controller() {
  UrControllerConfig config;
  config.robot.program_text = "";
  return config;
}

TEST(ScriptPort, TakesWholeProgramsHoweverTheyAreCut) {
  const std::string stream =
      "\nstop program\ndef a():\n  if True:\n    sync()\n  end\nend\nsec b():\nend\r\ntextmsg(\"x\")\ndef c():\n";
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    std::vector<std::string> programs;
    std::string pending = stream.substr(0, cut);
    while (auto program = take_program(pending)) programs.push_back(*program);
    pending += stream.substr(cut);
    while (auto program = take_program(pending)) programs.push_back(*program);
    ASSERT_EQ(programs.size(), 4U) << cut;
    EXPECT_EQ(programs[0], "stop program\n");
    EXPECT_EQ(programs[1], "def a():\n  if True:\n    sync()\n  end\nend\n");
    EXPECT_EQ(programs[3], "textmsg(\"x\")\n");
    EXPECT_EQ(pending, "def c():\n");
  }
}

TEST(PrimaryPort, GreetsWithVersionAndGeometryAndStreamsAtTenHertz) {
  UrController controller(empty_controller());
  ASSERT_TRUE(controller.start());
  PrimaryClient client(controller.primary_port());
  const auto version = client.next(ur::MessageKind::kVersion);
  ASSERT_TRUE(version);
  EXPECT_EQ(version->major, 5);
  const Message state = client.next();
  EXPECT_TRUE(ur::decode_kinematics(ur::parse_primary(state).contents));
  const TimePoint begin = transport::now();
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(client.next().empty());
  EXPECT_GT(transport::now() - begin, std::chrono::milliseconds(250));
}

TEST(PrimaryPort, RunsProgramsAndReportsWhatIsWrongWithThem) {
  UrController controller(empty_controller());
  ASSERT_TRUE(controller.start());
  PrimaryClient client(controller.primary_port());
  client.send("def good():\n  while True:\n    sync()\n  end\nend\n");
  const auto started = client.next(ur::MessageKind::kKey);
  ASSERT_TRUE(started);
  EXPECT_EQ(started->title, "PROGRAM_XXX_STARTED");
  EXPECT_EQ(started->text, "good");
  client.send("stop program\n");
  EXPECT_EQ(client.next(ur::MessageKind::kKey)->title, "PROGRAM_XXX_STOPPED");
  client.send("def bad():\n  x = unknown_name\nend\n");
  const auto exception = client.next(ur::MessageKind::kRuntimeException);
  ASSERT_TRUE(exception);
  EXPECT_EQ(exception->line, 2);
  client.send("textmsg(\"hello\")\n");
  EXPECT_EQ(client.next(ur::MessageKind::kText)->text, "hello");
}

TEST(PrimaryPort, IsReadOnlyInLocalControlAndClosedByTheSwitch) {
  UrController controller(empty_controller());
  ASSERT_TRUE(controller.start());
  PrimaryClient before(controller.primary_port());
  ASSERT_TRUE(before.next(ur::MessageKind::kVersion));
  ASSERT_TRUE(controller.fault("ur local"));
  while (!before.next().empty()) {
  }
  PrimaryClient after(controller.primary_port());
  after.send("def good():\n  sync()\nend\n");
  const auto refused = after.next(ur::MessageKind::kErrorCode);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, 210);
  EXPECT_EQ(controller.safety().runtime_state, 1U);
}

TEST(RealtimePort, StreamsEachCycleInPackagesOf1220Bytes) {
  UrController controller(empty_controller());
  ASSERT_TRUE(controller.start());
  PrimaryClient client(controller.realtime_port());
  const Message first = client.next(), second = client.next();
  ASSERT_EQ(first.size(), 1220U);
  EXPECT_NEAR(rtde::load<double>(first, 4 + 8 * 31), UrRobotConfig{}.q_start_rad[0], 1e-12);
  EXPECT_NEAR(rtde::load<double>(second, 4) - rtde::load<double>(first, 4), 0.002, 0.1);
  PrimaryClient secondary(controller.secondary_port());
  EXPECT_EQ(ur::parse_primary(secondary.next()).type, ur::kRobotState);
}

TEST(PrimaryPort, AProgramWithoutEndIsNotKeptForEver) {
  UrController controller(empty_controller());
  ASSERT_TRUE(controller.start());
  PrimaryClient client(controller.primary_port());
  client.send("def endless():\n");
  const std::string filler(64 * 1024, '#');
  for (int i = 0; i < 4; ++i) client.send(filler);
  while (!client.next().empty()) {  // the connection ends
  }
}

TEST(ControllerFaults, EveryListedNameIsUnderstoodAndNothingElse) {
  std::string_view list = kFaultHelp, entry;
  int count = 0;
  while (!list.empty()) {
    const std::size_t comma = list.find(", ");
    entry = list.substr(0, comma);
    list = comma == std::string_view::npos ? std::string_view{} : list.substr(comma + 2);
    const std::string name(entry.substr(0, entry.find(' ')));
    const bool takes_switch = entry.find("on|off") != std::string_view::npos;
    const bool takes_number = entry.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") != std::string_view::npos;
    EXPECT_EQ(parse_ur_fault(name).ok(), !takes_switch && !takes_number) << name;
    EXPECT_EQ(parse_ur_fault("ur " + name + " on").ok(), takes_switch) << name;
    EXPECT_EQ(parse_ur_fault(name + " 0.5").ok(), takes_number) << name;
    EXPECT_FALSE(parse_ur_fault(name + " nan")) << name;
    EXPECT_FALSE(parse_ur_fault(name + " -1")) << name;
    EXPECT_FALSE(parse_ur_fault(name + " on off")) << name;
    ++count;
  }
  EXPECT_EQ(count, 27);
  const auto unknown = parse_ur_fault("explode");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().detail.view().find("freeze"), std::string_view::npos);
}

}  // namespace
}  // namespace embody::sim
