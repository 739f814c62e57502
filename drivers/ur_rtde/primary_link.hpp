#pragma once
// Connection to the controller's primary port: sends programs, and keeps what the controller reports about itself.
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/transport/unique_fd.hpp"
#include "drivers/ur_rtde/primary_codec.hpp"

namespace embody::ur {

/// One report of the controller that matters for a program; texts are copies.
struct PrimaryEvent {
  MessageKind kind{MessageKind::kErrorCode};  ///< kErrorCode or kRuntimeException
  std::int32_t code{0};
  std::int32_t argument{0};
  std::int32_t level{0};
  std::int32_t line{0};
  FixedString<120> text;
};

class PrimaryLink {
 public:
  PrimaryLink(std::string host, std::uint16_t port);

  [[nodiscard]] bool is_open() const noexcept { return static_cast<bool>(fd_); }
  /// Errors: kNotFound, kDisconnected, kTimeout.
  Status open(TimePoint deadline);
  void close() noexcept;

  /// Errors: kDisconnected, kTimeout.
  Status send(std::string_view program, TimePoint deadline);

  /// Handles what arrives, until `deadline` or the first event; an empty answer means no event. A closed or broken
  /// connection shows in is_open().
  [[nodiscard]] std::optional<PrimaryEvent> next_event(TimePoint deadline);

  /// Geometry that the controller reported last.
  [[nodiscard]] const std::optional<UrKinematics>& kinematics() const noexcept { return kinematics_; }

 private:
  [[nodiscard]] std::optional<PrimaryEvent> take_event();

  std::string host_;
  std::uint16_t port_;
  transport::UniqueFd fd_;
  std::vector<std::byte> pending_;  // at most one message and one read beyond it
  std::optional<UrKinematics> kinematics_;
};

}  // namespace embody::ur
