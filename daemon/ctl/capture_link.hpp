#pragma once
// What stands on the link of a configured device, or listens beside it, while it is captured.
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

  /// What a person has to do so that another program's link is captured.
  [[nodiscard]] virtual std::string advice() const = 0;
  /// A bus, to which a second driver would be a second master: no driver of ours is connected, and the configuration
  /// stays as it is.
  [[nodiscard]] virtual bool listens_only() const { return false; }
  /// Errors: kDisconnected, nothing more will come.
  [[nodiscard]] virtual Status status() const { return {}; }

 protected:
  CaptureLink() = default;
};

/// Opens the proxy, and changes `config` so that the drivers made from it connect to the proxy instead of the device.
/// Nothing is sent to the device. `writer` must outlive the link. Errors: kUnsupported (a hand without a link of ours),
/// those of TcpProxy::forward(), PtyProxy::open(), UdpForwarder::open() and open_can().
[[nodiscard]] Result<std::unique_ptr<CaptureLink>> open_capture_link(CapturedDevice device,
                                                                     config::EmbodyConfig& config,
                                                                     capture::CaptureWriter& writer);

}  // namespace embody::ctl
