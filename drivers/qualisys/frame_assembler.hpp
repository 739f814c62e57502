#pragma once
// Data packets in, whole frames in order out. UDP may split a frame, reorder, duplicate and lose; clocks may restart.
#include <cstdint>

#include "core/base/time.hpp"
#include "drivers/qualisys/codec.hpp"

namespace embody::qualisys {

enum class Assembly {
  kWhole,    ///< frame() is new and has everything that is needed
  kPart,     ///< more components of this frame are needed
  kUseless,  ///< older than, or the same as, what came before; not used
};

/// Frames are told apart by their time stamps: QTM's frame number may stand still.
class FrameAssembler {
 public:
  /// `bodies`: a frame needs a 6D component besides its 3D component. `in_order`: the channel keeps the order (TCP), so
  /// that a time stamp that goes back is QTM's clock starting anew. Otherwise it goes back when it is more than 0.5 s
  /// behind, or when several packets in a row are behind and follow each other.
  FrameAssembler(bool bodies, bool in_order) noexcept : bodies_(bodies), in_order_(in_order) {}

  /// `part` is a packet that was received at `t_arrival`. Steps once per packet.
  Assembly step(const DataPacket& part, TimePoint t_arrival) noexcept;

  /// The last whole frame; valid until step(), and as long as the packet that step() was given.
  [[nodiscard]] const DataPacket& frame() const noexcept { return *frame_; }

  [[nodiscard]] std::uint64_t useless() const noexcept { return useless_; }
  [[nodiscard]] std::uint64_t incomplete() const noexcept { return incomplete_; }  ///< frames given up half-built
  [[nodiscard]] std::uint64_t restarts() const noexcept { return restarts_; }      ///< of QTM's clock
  /// Incomplete frames since the last whole one.
  [[nodiscard]] std::uint64_t incomplete_run() const noexcept { return incomplete_run_; }

 private:
  [[nodiscard]] bool is_old(const DataPacket& part) noexcept;
  [[nodiscard]] bool restarted(std::uint64_t timestamp_us, TimePoint t_arrival) const noexcept;
  void merge(const DataPacket& part) noexcept;

  bool bodies_;
  bool in_order_;
  bool started_{false};
  bool building_{false};        // part_ waits for more
  std::uint64_t newest_us_{0};  // of all packets used
  TimePoint t_newest_{};
  std::uint64_t behind_us_{0};  // last packet that was too old
  int behind_{0};               // such packets in a row, each newer than the one before
  DataPacket part_;
  const DataPacket* frame_{&part_};
  std::uint64_t useless_{0}, incomplete_{0}, restarts_{0}, incomplete_run_{0};
};

}  // namespace embody::qualisys
