#include "drivers/landmarks/landmark_tracker.hpp"

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::landmarks {
namespace {

constexpr int kReceivesPerRead = 16;
constexpr int kReceiveBuffer = 64 << 10;  // about 50 datagrams with the kernel's overhead

}  // namespace

LandmarkTracker::LandmarkTracker(LandmarkConfig config) : config_(std::move(config)) {
  show({{"received", &counters_.received},
        {"malformed", &counters_.malformed},
        {"foreign", &counters_.foreign},
        {"other_hand", &counters_.other_hand},
        {"duplicates", &counters_.duplicates},
        {"restarts", &counters_.restarts}});
}

Result<TrackerInfo> LandmarkTracker::connect() {
  fd_.reset();
  port_ = 0;
  reason_ = {};
  const auto network = transport::network_of(config_.address);
  if (!network) return network.error();
  auto fd = transport::udp_bind(config_.address, config_.port, kReceiveBuffer);
  if (!fd) return fd.error();
  fd_ = std::move(*fd);
  port_ = transport::local_port(fd_.get());
  network_ = *network;
  clock_ = {};
  started_ = false;
  ++epoch_;
  const std::string peer = "landmark datagrams at UDP " + config_.address + ":" + std::to_string(port_);
  return TrackerInfo{fd_.get(), config_.rate_hz, false, std::string_view(peer)};
}

Status LandmarkTracker::service() {
  if (fd_) return {};
  return make_error(Errc::kDisconnected, "there is no socket for landmarks");
}

IoStatus LandmarkTracker::read(MarkerFrame& frame) noexcept {
  if (!fd_ || !reason_.empty()) return IoStatus::kDisconnected;
  std::array<std::byte, kDatagramSize> buffer;
  for (int i = 0; i < kReceivesPerRead; ++i) {
    const transport::Datagram datagram = transport::receive_datagram(fd_.get(), buffer);
    const TimePoint t_arrival = transport::now();
    if (datagram.status == IoStatus::kDisconnected) reason_ = "the socket for landmarks broke";
    if (datagram.status != IoStatus::kDone) return datagram.status;
    ++counters_.received;
    if (!network_.contains(datagram.source)) {
      ++counters_.foreign;
    } else if (datagram.size != buffer.size()) {
      ++counters_.malformed;
    } else if (take(buffer, t_arrival, frame)) {
      return IoStatus::kDone;
    }
  }
  return IoStatus::kEmpty;
}

/// Fills `frame` and returns true when the datagram is a new frame of our hand.
bool LandmarkTracker::take(std::span<const std::byte> datagram, TimePoint t_arrival, MarkerFrame& frame) noexcept {
  const auto decoded = decode(datagram);
  if (!decoded) return ++counters_.malformed, false;
  if (decoded->side != config_.side) return ++counters_.other_hand, false;
  if (!is_new(decoded->frame_number)) return ++counters_.duplicates, false;
  frame.frame_number = decoded->frame_number;
  frame.label_epoch = epoch_;
  frame.t_arrival = t_arrival;
  frame.t_capture = decoded->t_capture_ns == 0 ? t_arrival : clock_.map(Duration{decoded->t_capture_ns}, t_arrival);
  frame.count = kLandmarkCount;
  for (std::size_t i = 0; i < kLandmarkCount; ++i) {
    const LandmarkFrame::Landmark& landmark = decoded->landmarks[i];
    frame.markers[i].p_W = Eigen::Vector3d(landmark.p_W[0], landmark.p_W[1], landmark.p_W[2]);
    frame.markers[i].visible = landmark.confidence > 0.0F;
    frame.markers[i].confidence = landmark.confidence;
  }
  return true;
}

bool LandmarkTracker::is_new(std::uint64_t frame_number) noexcept {
  const bool first = !started_;
  started_ = true;
  if (!first && frame_number == last_frame_) return false;
  if (!first && frame_number < last_frame_) ++counters_.restarts;
  last_frame_ = frame_number;
  return true;
}

}  // namespace embody::landmarks
