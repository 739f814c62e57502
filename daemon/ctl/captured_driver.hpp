#pragma once
// The driver whose link is captured: connected, read, and never told to move.
#include <memory>
#include <string>

#include "daemon/ctl/capture_link.hpp"

namespace embody::ctl {

class CapturedDriver {
 public:
  virtual ~CapturedDriver() = default;
  CapturedDriver(const CapturedDriver&) = delete;
  CapturedDriver& operator=(const CapturedDriver&) = delete;

  /// Returns what to poll. Moves nothing. Errors: those of the driver's connect().
  virtual Result<int> connect() = 0;
  /// Reads what has come and does what is due. Errors: the session is over.
  virtual Status serve(TimePoint now) = 0;
  /// Frames or states so far.
  [[nodiscard]] std::uint64_t readings() const noexcept { return readings_; }

 protected:
  CapturedDriver() = default;

  std::uint64_t readings_{0};
};

/// The arm's driver gets no command and loads no program; the hand's gets kHold only, as fast as [hand] rate_hz.
[[nodiscard]] std::unique_ptr<CapturedDriver> make_captured_driver(CapturedDevice device, config::EmbodyConfig config);

}  // namespace embody::ctl
