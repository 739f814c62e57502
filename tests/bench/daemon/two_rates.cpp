// Does a slow finger stage slow the arm? Blocks of 2 s with the finger loop as it is, sleeping 50 ms per frame, and
// computing 50 ms per frame alternate in one run; printed are the ratios of the arm path's latencies. The loops run as
// in the daemon, against the simulated devices, with real-time priorities where permitted.
#include <array>
#include <cstdio>
#include <filesystem>
#include <thread>
#include <vector>

#include "daemon/app/config_io.hpp"
#include "daemon/app/models.hpp"
#include "daemon/app/thread.hpp"
#include "daemon/loops/arm_loop.hpp"
#include "daemon/loops/finger_loop.hpp"
#include "daemon/loops/tracker_loop.hpp"
#include "daemon/simlab/demo_recording.hpp"
#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"

namespace {

using namespace embody;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kRounds = 5;
constexpr std::array<const char*, 3> kNames{"fingers as they are", "sleeping 50 ms", "computing 50 ms"};

struct Samples {
  std::vector<double> total_us;     // frame arrival to command written
  std::vector<double> reaction_us;  // robot package read to command written
};

double quantile(std::vector<double> values, double q) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

double us(Duration d) {
  return to_seconds(d) * 1e6;
}

void run_block(FingerLoop& fingers, Edges& edges, int kind, Samples& samples) {
  fingers.set_slow_down({kind == 0 ? Duration{0} : Duration{milliseconds(50)}, kind == 2});
  ArmTiming timing;
  std::this_thread::sleep_for(milliseconds(200));  // the finger loop takes the setting
  while (edges.arm_timings.pop(timing)) {
  }
  const TimePoint end = transport::now() + seconds(2);
  while (transport::now() < end) {
    std::this_thread::sleep_for(milliseconds(50));
    while (edges.arm_timings.pop(timing)) {
      samples.total_us.push_back(us(timing.t_written - timing.t_arrival));
      samples.reaction_us.push_back(us(timing.t_written - timing.t_tick));
    }
  }
}

void print(const std::array<Samples, 3>& samples) {
  std::printf("%-22s %10s %10s %10s %10s   (ratios to the first row)\n", "", "total p50", "p90", "react p50", "p90");
  const auto values = [](const Samples& s) {
    return std::array{quantile(s.total_us, 0.5), quantile(s.total_us, 0.9), quantile(s.reaction_us, 0.5),
                      quantile(s.reaction_us, 0.9)};
  };
  const auto base = values(samples[0]);
  for (std::size_t kind = 0; kind < samples.size(); ++kind) {
    const auto v = values(samples[kind]);
    std::printf("%-22s %7.0f us %7.0f us %7.1f us %7.1f us   %.3f %.3f %.3f %.3f   (%zu frames)\n", kNames[kind], v[0],
                v[1], v[2], v[3], v[0] / base[0], v[1] / base[1], v[2] / base[2], v[3] / base[3],
                samples[kind].total_us.size());
  }
}

int run() {
  const auto config = config::load_config(std::filesystem::path(EMBODY_SOURCE_DIR) / "config/embody.toml");
  if (!config) return std::fprintf(stderr, "%s\n", config.error().detail.c_str()), 1;
  auto models = make_models(*config);
  if (!models) return std::fprintf(stderr, "%s\n", models.error().detail.c_str()), 1;

  sim::QtmServer qtm({}, sim::make_demo_recording(2.3 * kRounds * 3 + 10.0));
  sim::UrController ur({});
  if (!qtm.start() || !ur.start()) return 1;
  qualisys::QualisysTracker tracker({"127.0.0.1", qtm.port()}, config->glove.names);
  UrRtdeArm arm({"127.0.0.1", ur.port()});
  auto edges = std::make_unique<Edges>();
  TrackerBaton tracker_baton(tracker);
  ArmBaton arm_baton(arm);
  TrackerLoop tracker_loop(tracker_baton, models->hand_pose, models->monitor, models->predictor, *edges);
  ArmLoop arm_loop(arm_baton, tracker_baton, models->arm, {}, {}, *edges);
  FingerLoop finger_loop(models->fingers, models->filter, models->embodiment, {}, *edges);
  const auto tracker_info = tracker.connect();
  const auto arm_info = arm.connect();
  if (!tracker_info || !arm_info) return 1;
  tracker_baton.pass_to_loop(*tracker_info);
  arm_baton.pass_to_loop(*arm_info);

  const bool fifo = may_use_fifo(46);
  std::printf("scheduling: %s\n",
              fifo ? "SCHED_FIFO, arm 46, tracker 44, fingers 40" : "normal (FIFO is not permitted)");
  std::array<Samples, 3> samples;
  {
    Thread arm_thread;
    Thread tracker_thread;
    Thread finger_thread;
    if (!arm_thread.start({"arm", fifo ? 46 : 0, {}, false}, [&] { arm_loop.run(); })) return 1;
    if (!finger_thread.start({"fingers", fifo ? 40 : 0, {}, false}, [&] { finger_loop.run(); })) return 1;
    if (!tracker_thread.start({"tracker", fifo ? 44 : 0, {}, false}, [&] { tracker_loop.run(); })) return 1;
    qtm.play();
    for (int round = 0; round < kRounds; ++round) {
      for (int kind = 0; kind < 3; ++kind)
        run_block(finger_loop, *edges, kind, samples[static_cast<std::size_t>(kind)]);
    }
    edges->stop = true;
  }
  print(samples);
  const LoopCounters& counters = edges->counters;
  const std::uint64_t packages = counters.robot_packages;
  const std::uint64_t commands = counters.arm_commands;
  std::printf("commands %llu, robot packages %llu, sequence gaps %llu, finger frames %llu of %llu\n",
              static_cast<unsigned long long>(commands), static_cast<unsigned long long>(packages),
              static_cast<unsigned long long>(ur.counters().sequence_gaps),
              static_cast<unsigned long long>(counters.finger_frames.load()),
              static_cast<unsigned long long>(counters.frames_used.load()));
  return 0;
}

}  // namespace

int main() {
  return run();
}
