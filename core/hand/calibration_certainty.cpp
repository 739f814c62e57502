// How certain the calibration is: noise, spread of the angles, and standard deviations of the hand's variables.
#include <algorithm>
#include <cmath>

#include "core/hand/calibration_internal.hpp"

namespace embody::hand {

using namespace calibration;

/// Standard deviations of the hand's variables and the redundancy of the frames, from eliminated normal equations.
/// Scores are summed over stretches of the recording, for frames near in time share what is unknown about their posture
/// (cluster-robust covariance; Liang & Zeger 1986).
void CalibrationProblem::hand_certainty(const Eigen::MatrixXd& covariance, Certainty& out) const {
  constexpr std::size_t kStretches = 20;
  const Index hand = hand_size();
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(hand, kStretches);
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const std::size_t stretch = frames_.frames[k].index * kStretches / std::max<std::size_t>(frames_.recorded, 1);
    sums.col(idx(std::min(stretch, kStretches - 1))) += scores_.col(idx(k));
  }
  const double by_stretch = (sums.transpose() * covariance * sums).trace();
  const double by_frame = (scores_.transpose() * covariance * scores_).trace();
  out.redundancy = std::clamp(by_stretch / std::max(by_frame, 1e-12), 1.0, static_cast<double>(blocks_.size()));
  const Eigen::MatrixXd inverse = hand_hessian_.llt().solve(Eigen::MatrixXd::Identity(hand, hand));
  const double lost = 1.0 / (1.0 - 1.0 / static_cast<double>(kStretches));  // to the sum of all scores being zero
  const Eigen::MatrixXd outer = lost / (redundancy_ * redundancy_) * sums * sums.transpose();
  const Eigen::MatrixXd prior = prior_sd().cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd sandwich = inverse * (outer + prior) * inverse;
  out.sd = inverse.diagonal().cwiseMax(sandwich.diagonal()).cwiseMax(0.0).cwiseSqrt();
}

/// Adds one finger in one frame to the sums of squares of the spreads; returns how many parameters its markers pay for:
/// trace(posterior covariance * information of the markers). `local` is the covariance of its local variables.
double CalibrationProblem::finger_certainty(const CalibrationVariables& at, std::size_t k, std::size_t f,
                                            const LocalSquare& local, Certainty& out) const {
  const FingerBlock& block = blocks_[k].fingers[f];
  const Local U = block.factor.solve(block.coupling);
  const Local angles_local = -U * local;
  const Matrix9 angles = block.factor.solve(Matrix9::Identity()) - angles_local * U.transpose();
  const StaticVector<AngleBelief, kAngleBeliefs>& beliefs = angle_priors_[f].beliefs();
  for (std::size_t b = 0; b < beliefs.size(); ++b) {
    const Vector9& d = beliefs[b].direction;
    const Index habit = kHabit + idx(b);
    const double off = d.dot(at.frames[k].q_rad[f]) - at.habit_rad[f](idx(b));
    out.spread_rad[f](idx(b)) +=
        off * off + d.dot(angles * d) + local(habit, habit) - 2.0 * d.dot(angles_local.col(habit));
  }
  // Markers do not depend on habits: what those couple with is prior.
  Local coupling = block.coupling;
  LocalSquare information = block.local_hessian;
  coupling.middleCols<kAngleBeliefs>(kHabit).setZero();
  information.diagonal().segment<kAngleBeliefs>(kHabit).setZero();
  return (angles * (block.hessian - block.prior)).trace() + 2.0 * angles_local.cwiseProduct(coupling).sum() +
         local.cwiseProduct(information).sum();
}

CalibrationProblem::Certainty CalibrationProblem::certainty(const CalibrationVariables& at) {
  Certainty out;
  out.sd = prior_sd();
  out.noise_m = noise_m_;
  for (Habit& spread : out.spread_rad) spread.setZero();
  if (!eliminate(at, 0.0)) return out;
  const Index hand = hand_size();
  const Eigen::MatrixXd prior = prior_sd().cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd information = redundancy_ * (hand_hessian_ - prior) + prior;  // as if all frames counted
  const Eigen::MatrixXd covariance = information.llt().solve(Eigen::MatrixXd::Identity(hand, hand));
  hand_certainty(covariance, out);
  double paid = 0.0;
  double squares_m2 = 0.0;
  double seen = 0.0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const FrameBlock& frame = blocks_[k];
    const Eigen::Matrix<double, 6, Eigen::Dynamic> T = frame.factor.solve(frame.coupling);
    const Eigen::Matrix<double, 6, Eigen::Dynamic> slip_hand = -T * covariance;
    const Matrix6 slip_slip = frame.factor.solve(Matrix6::Identity()) - slip_hand * T.transpose();
    for (std::size_t f = 0; f < kFingers; ++f) {
      const std::vector<Index> columns = hand_columns(f);
      const Index n = 6 + idx(columns.size());
      LocalSquare local(n, n);
      local.topLeftCorner<6, 6>() = slip_slip;
      for (std::size_t a = 0; a < columns.size(); ++a) {
        local.block<6, 1>(0, 6 + idx(a)) = slip_hand.col(columns[a]);
        local.block<1, 6>(6 + idx(a), 0) = slip_hand.col(columns[a]).transpose();
        for (std::size_t b = 0; b < columns.size(); ++b) {
          local(6 + idx(a), 6 + idx(b)) = covariance(columns[a], columns[b]);
        }
      }
      paid += finger_certainty(at, k, f, local, out);
      for (const std::size_t i : of_finger_[f]) {
        const std::optional<double> d = distance_m(at, k, i);
        if (!d || loss_.weight(*d * *d) <= 0.5) continue;
        squares_m2 += *d * *d;
        seen += 3.0;
      }
    }
  }
  for (Habit& spread : out.spread_rad) spread = (spread / static_cast<double>(blocks_.size())).cwiseSqrt();
  out.noise_m = std::sqrt(squares_m2 / std::max(seen - paid, 0.05 * std::max(seen, 1.0)));
  return out;
}

}  // namespace embody::hand
