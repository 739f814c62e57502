#pragma once
// What a session of the tracker holds, by the thread that uses it. Internal to the tracker.
#include <atomic>

#include "core/teleop/clock_map.hpp"
#include "drivers/qualisys/frame_assembler.hpp"
#include "drivers/qualisys/packet_source.hpp"
#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/qualisys/setup_check.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::qualisys {

/// read() -> service(): when did frames come?
struct Flow {
  std::atomic<Duration::rep> t_frame_ns{transport::now().time_since_epoch().count()};  ///< last frame, or the beginning
  std::atomic<bool> any_data{false};
  std::atomic<bool> idle{false};  ///< QTM said that it has no data
};

struct QualisysTracker::Session {
  Session(PacketSource packets, RtConnection control_connection, Parameters valid_parameters, const Wanted& wanted)
      : source(std::move(packets)),
        control(std::move(control_connection)),
        parameters(std::move(valid_parameters)),
        map(make_map(parameters, wanted)),
        two_periods(from_seconds(2.0 / parameters.frequency_hz)),
        assembler(!wanted.rigid_body.empty(), !source.is_udp()) {}

  PacketSource source;   // read(); cut() from service()
  RtConnection control;  // service()
  const Parameters parameters;
  const DataMap map;
  const Duration two_periods;
  std::atomic<bool> stop_requested{false};  // service() -> read()
  Flow flow;

  // read() only:
  bool over{false};
  FrameAssembler assembler;
  DataPacket data;
  teleop::ClockMap clock;
  bool catching_up{false};
  std::uint64_t last_number{0};  // of the last frame; 0: none yet
  TimePoint t_late{};            // frames are late by more than a second since
};

}  // namespace embody::qualisys
