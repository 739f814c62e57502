#pragma once
// One connection of a replayed device. Internal to ReplayDevice.
#include <vector>

#include "drivers/capture/replay.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::capture {

class ReplayDevice::Line {
 public:
  enum class Waits {
    kForDriver,  ///< to send something
    kForReader,  ///< to read what was sent
    kForTime,
    kForOpening,  ///< a pseudo-terminal that nobody has open
    kOver,
  };

  /// @param device  of a serial line, empty for TCP
  Line(transport::UniqueFd fd, std::string device, std::vector<Chunk> script, ReplayOptions options);

  /// Takes what the driver has sent, then plays on as far as possible without waiting.
  Waits serve(TimePoint now);
  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  [[nodiscard]] bool readable() const noexcept { return fd_ && !host_ended_; }
  void add_to(ReplayReport& report) const;

 private:
  void take();
  Waits play(TimePoint now);
  bool send_piece(const std::vector<std::byte>& bytes, TimePoint now);
  [[nodiscard]] bool is_open() const noexcept;
  [[nodiscard]] bool was_read(TimePoint now, Duration terminal_lag);
  void close(bool reset);

  transport::UniqueFd fd_;
  const std::string device_;
  const std::vector<Chunk> script_;
  const ReplayOptions options_;
  std::vector<std::byte> recorded_out_;
  std::size_t at_{0};            // chunk to play
  std::size_t offset_{0};        // bytes of it that were sent
  std::size_t expected_out_{0};  // bytes of the driver in the chunks before at_
  std::size_t received_{0};
  std::size_t sent_{0};
  std::size_t different_{0};
  bool host_ended_{false};
  bool piece_under_way_{false};
  bool seen_unread_{false};
  TimePoint t_sent_{};
  TimePoint t_begin_{};
  int reader_{-1};  // the driver's descriptor
};

}  // namespace embody::capture
