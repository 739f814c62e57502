// The simulated UR controller as an e-Series (500 Hz) and as a CB3 (125 Hz), behind relays on the RTDE and the program
// port.
#include <map>
#include <mutex>
#include <optional>

#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/frame_buffer.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"
#include "tests/contract/arm_cell.hpp"
#include "tests/contract/relay.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;

/// Counts the commands among the bytes of an RTDE client. Called by the relay's thread, read by the test's.
class CommandCount {
 public:
  void take(int connection, std::span<const std::byte> bytes) {
    const std::scoped_lock lock(mutex_);
    rtde::FrameBuffer& buffer = buffers_[connection];
    const std::span<std::byte> space = buffer.space();
    ASSERT_LE(bytes.size(), space.size());
    std::copy(bytes.begin(), bytes.end(), space.begin());
    buffer.commit(bytes.size());
    for (auto parsed = buffer.next(); parsed.framing == rtde::Framing::kComplete; parsed = buffer.next()) {
      if (!parsed.frame.is(rtde::PackageType::kData)) continue;
      constexpr std::size_t kMode = 1 + 4;  // behind the recipe and the sequence
      ++commands_;
      motions_ += rtde::load<std::int32_t>(parsed.frame.payload, kMode) == 1 ? 1U : 0U;
    }
  }
  void tell(ArmRecord& record) {
    const std::scoped_lock lock(mutex_);
    record.commands = commands_;
    record.motions = motions_;
  }

 private:
  std::mutex mutex_;
  std::map<int, rtde::FrameBuffer> buffers_;
  std::uint64_t commands_{0}, motions_{0};
};

class UrCell final : public ArmCell {
 public:
  UrCell(double frequency_hz, const rtde::ControllerVersion& version) : controller_(config(frequency_hz, version)) {
    rate_hz = frequency_hz;
    const UrRtdeConfig delivered;
    hang_up_bound = milliseconds(20);
    silence_bound = delivered.stale_after;
    top_speed_rad_s = delivered.script.max_velocity_rad_s[0];
    // Until commands count as stale, then the deceleration, then the lag of the joints.
    const double braking_s = kContractSpeed_rad_s / delivered.script.stop_deceleration_rad_s2;
    stop_bound = patient_script().stale_after + from_seconds(braking_s) + milliseconds(150);
    const Status started = controller_.start();
    EXPECT_TRUE(started.ok()) << started.error().detail.view();
    EXPECT_TRUE(eventually([this] { return controller_.counters().cycles > 0; }));
    rtde_.emplace(
        tcp_socket(rtde_port_), [this] { return to(controller_.port()); },
        [this](int connection, auto bytes) { count_.take(connection, bytes); });
    primary_.emplace(tcp_socket(primary_port_), [this] { return to(controller_.primary_port()); });
  }

  std::unique_ptr<ArmDriver> driver(Pace pace) override {
    UrRtdeConfig config;
    config.frequency_hz = rate_hz;
    config.port = rtde_port_;
    config.primary_port = primary_port_;
    config.upload_retry = milliseconds(100);
    config.script = patient_script();
    if (pace == Pace::kPatient) {
      config.stale_after = config.backlog_limit = kPatience;
      config.echo_patience = kPatience;
    }
    return std::make_unique<UrRtdeArm>(config);
  }
  ArmRecord record() override {
    const sim::UrSample sample = controller_.latest();
    ArmRecord record{sample.q_rad, sample.qd_rad_s};
    count_.tell(record);
    return record;
  }

  void cut() override {
    rtde_->cut();
    primary_->cut();
  }
  void restore() override {
    rtde_->restore();
    primary_->restore();
  }
  void hush() override {
    rtde_->hush();
    primary_->hush();
  }
  void babble(std::mt19937& random) override {
    rtde_->inject(rubbish(random, 300));
    primary_->inject(rubbish(random, 300));
  }

 private:
  /// Delivered with 50 ms: a busy machine would end the tracking of every test.
  static rtde::ControlScriptConfig patient_script() {
    rtde::ControlScriptConfig script;
    script.stale_after = milliseconds(200);
    script.watchdog_hz = 4.0;  // its period has to be longer
    return script;
  }
  static sim::UrControllerConfig config(double frequency_hz, const rtde::ControllerVersion& version) {
    sim::UrControllerConfig config;
    config.frequency_hz = frequency_hz;
    config.version = version;
    config.robot.program = patient_script();
    if (version.major < 5) config.model = "UR10";
    return config;
  }
  static Result<transport::UniqueFd> to(std::uint16_t port) {
    return transport::tcp_connect("127.0.0.1", port, transport::now() + std::chrono::seconds(1));
  }

  sim::UrController controller_;
  CommandCount count_;
  std::uint16_t rtde_port_{0}, primary_port_{0};
  std::optional<Relay> rtde_, primary_;
};

}  // namespace

std::unique_ptr<ArmCell> ur_e_series() {
  return std::make_unique<UrCell>(500.0, rtde::ControllerVersion{5, 12, 4, 1'101'661});
}

std::unique_ptr<ArmCell> ur_cb3() {
  return std::make_unique<UrCell>(125.0, rtde::ControllerVersion{3, 15, 8, 106'339});
}

}  // namespace embody::test
