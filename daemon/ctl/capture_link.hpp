#pragma once
// The proxy that stands on the link of a configured device while it is captured.
#include <memory>
#include <string>

#include "daemon/app/config.hpp"
#include "drivers/capture/capture_writer.hpp"

namespace embody::ctl {

enum class CapturedDevice : std::uint8_t { kTracker, kArm, kHand };

/// What the file's header says of the device's link: kind and peer.
[[nodiscard]] capture::Header link_header(CapturedDevice device, const config::EmbodyConfig& config);

class CaptureLink {
 public:
  virtual ~CaptureLink() = default;
  CaptureLink(const CaptureLink&) = delete;
  CaptureLink& operator=(const CaptureLink&) = delete;

  /// Lines for the configuration of a program whose link is to be captured.
  [[nodiscard]] virtual std::string advice() const = 0;
  /// Nothing more will come: a serial line is gone.
  [[nodiscard]] virtual bool over() const { return false; }

 protected:
  CaptureLink() = default;
};

/// Opens the proxy, and changes `config` so that the drivers made from it connect to the proxy instead of the device.
/// Nothing is sent to the device. `writer` must outlive the link. Errors: those of TcpProxy::forward(),
/// PtyProxy::open() and UdpForwarder::open().
[[nodiscard]] Result<std::unique_ptr<CaptureLink>> open_capture_link(CapturedDevice device,
                                                                     config::EmbodyConfig& config,
                                                                     capture::CaptureWriter& writer);

}  // namespace embody::ctl
