#include "core/hand/palm_pose_estimator.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace embody::hand {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Standard deviation of the points along the second axis of their plane. Below it the rotation about the first is
// noise: the four knuckles alone have 3 mm, wrist and two neighbouring knuckles have 9 mm.
constexpr double kLeastSpread_m = 0.006;
constexpr Duration kScaleTime = std::chrono::seconds(1);
constexpr std::size_t kLeastScales = 10;

struct Moments {
  Vector3d mean_W{Vector3d::Zero()};
  Vector3d mean_M{Vector3d::Zero()};
  Matrix3d scatter_WW{Matrix3d::Zero()};
  Matrix3d scatter_MM{Matrix3d::Zero()};
  Matrix3d scatter_WM{Matrix3d::Zero()};
};

Moments moments(const PalmPairs& pairs, double weight_sum) noexcept {
  Moments m;
  for (const PalmPair& pair : pairs) {
    m.mean_W += pair.weight / weight_sum * pair.p_W;
    m.mean_M += pair.weight / weight_sum * pair.p_M;
  }
  for (const PalmPair& pair : pairs) {
    const double share = pair.weight / weight_sum;
    const Vector3d from_W = pair.p_W - m.mean_W;
    const Vector3d from_M = pair.p_M - m.mean_M;
    m.scatter_WW += share * from_W * from_W.transpose();
    m.scatter_MM += share * from_M * from_M.transpose();
    m.scatter_WM += share * from_W * from_M.transpose();
  }
  return m;
}

/// The points span a plane, not just a line. Written so that NaN fails.
bool spans_a_plane(const Matrix3d& scatter) noexcept {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(scatter, Eigen::EigenvaluesOnly);
  return axes.info() == Eigen::Success && axes.eigenvalues()(1) >= kLeastSpread_m * kLeastSpread_m;
}

}  // namespace

PalmFit fit_palm(const PalmPairs& pairs) noexcept {
  PalmFit fit;
  std::size_t count = 0;
  double weight_sum = 0.0;
  for (const PalmPair& pair : pairs) {
    if (pair.weight > 0.0) ++count;
    weight_sum += pair.weight;
  }
  if (count < 3 || !std::isfinite(weight_sum)) return fit;
  const Moments m = moments(pairs, weight_sum);
  if (!m.scatter_WM.allFinite() || !spans_a_plane(m.scatter_WW) || !spans_a_plane(m.scatter_MM)) return fit;

  const Eigen::JacobiSVD<Matrix3d> svd(m.scatter_WM, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d sign = Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) sign.z() = -1.0;  // no mirror image
  fit.X_WM.linear() = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  fit.X_WM.translation() = m.mean_W - fit.X_WM.linear() * m.mean_M;
  fit.scale = svd.singularValues().dot(sign) / m.scatter_MM.trace();
  double sum_m2 = 0.0;
  for (const PalmPair& pair : pairs) {
    sum_m2 += pair.weight / weight_sum * (pair.p_W - fit.X_WM * pair.p_M).squaredNorm();
  }
  fit.error_m = std::sqrt(sum_m2);
  fit.determined = math::is_valid(fit.X_WM) && std::isfinite(fit.error_m);
  return fit;
}

PalmPoseEstimator::PalmPoseEstimator(const HandModel& model, const PalmPoseConfig& config) noexcept : config_(config) {
  for (std::size_t i = 0; i < p_M_.size(); ++i) p_M_[i] = model.rest_joints()[kPalmLandmarks[i].joint];
}

HandPose PalmPoseEstimator::step(const MarkerFrame& frame) noexcept {
  ++last_.sequence;
  last_.frame_number = frame.frame_number;
  last_.t_capture = frame.t_capture;
  last_.t_arrival = frame.t_arrival;
  last_.valid = false;
  PalmPairs pairs;
  for (std::size_t i = 0; i < kPalmLandmarks.size(); ++i) {
    const std::size_t slot = kPalmLandmarks[i].slot;
    if (slot >= frame.count || slot >= kMaxMarkers) continue;
    const Marker& landmark = frame.markers[slot];
    const double confidence = landmark.confidence;
    if (!landmark.visible || !landmark.p_W.allFinite() || !(confidence >= config_.least_confidence)) continue;
    const bool thumb = kPalmLandmarks[i].joint == first_joint(Finger::kThumb);
    pairs.push_back({landmark.p_W, p_M_[i], thumb ? config_.thumb_weight * confidence : confidence});
  }
  const PalmFit fit = fit_palm(pairs);
  if (!fit.determined) return last_;
  note_scale(fit.scale, frame.t_capture);
  last_.fit_error_m = fit.error_m;
  if (!(fit.error_m <= config_.fit_tolerance_m)) return last_;
  last_.X_WM = fit.X_WM;
  last_.X_WH = fit.X_WM;
  last_.valid = true;
  return last_;
}

void PalmPoseEstimator::note_scale(double scale, TimePoint t_capture) noexcept {
  if (palm_scale_ > 0.0) return;
  if (scales_.empty()) t_first_ = t_capture;
  scales_.push_back(scale);
  const bool second_over = scales_.size() >= kLeastScales && t_capture - t_first_ >= kScaleTime;
  if (!second_over && scales_.size() < scales_.capacity()) return;
  auto* const middle = scales_.begin() + scales_.size() / 2;
  std::nth_element(scales_.begin(), middle, scales_.end());
  palm_scale_ = *middle;
}

}  // namespace embody::hand
