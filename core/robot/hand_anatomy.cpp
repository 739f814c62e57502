#include "core/robot/hand_anatomy.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

namespace embody::robot {
namespace {

using Eigen::Vector3d;
using Fingers = std::vector<SerialFinger>;

constexpr double kAxisLead_rad = 0.35;  // by which the thumb's axis must be ahead
constexpr double kBaseLead = 1.5;       // spacings
constexpr double kMiddle = 0.1;         // of the hand's breadth: a thumb nearer to the middle tells no side

double angle(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Index of the greatest score when it leads by `lead`; nothing otherwise.
std::optional<std::size_t> leader(const std::vector<double>& scores, double lead) {
  const auto best = std::max_element(scores.begin(), scores.end());
  for (auto it = scores.begin(); it != scores.end(); ++it) {
    if (it != best && *best - *it < lead) return std::nullopt;
  }
  return static_cast<std::size_t>(best - scores.begin());
}

/// Mean angle of each finger's closing axis to the others', rad.
std::vector<double> axis_scores(const Fingers& fingers) {
  std::vector<double> scores;
  for (const SerialFinger& finger : fingers) {
    double sum = 0.0;
    for (const SerialFinger& other : fingers) {
      if (&other != &finger) sum += angle(finger.closing_axis_P, other.closing_axis_P);
    }
    scores.push_back(sum / static_cast<double>(fingers.size() - 1));
  }
  return scores;
}

/// Distance of each knuckle from the nearest other one, in units of the smallest such distance.
std::vector<double> base_scores(const Fingers& fingers) {
  std::vector<double> scores;
  for (const SerialFinger& finger : fingers) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const SerialFinger& other : fingers) {
      if (&other != &finger) nearest = std::min(nearest, (finger.p_knuckle_P - other.p_knuckle_P).norm());
    }
    scores.push_back(nearest);
  }
  const double pitch_m = *std::min_element(scores.begin(), scores.end());
  for (double& score : scores) score /= std::max(pitch_m, 1e-6);
  return scores;
}

bool says_thumb(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  if (name.find("thumb") != std::string::npos) return true;
  for (std::size_t at = name.find("th"); at != std::string::npos; at = name.find("th", at + 1)) {
    const bool starts = at == 0 || std::isalpha(static_cast<unsigned char>(name[at - 1])) == 0;
    const bool ends = at + 2 >= name.size() || std::isalpha(static_cast<unsigned char>(name[at + 2])) == 0;
    if (starts && (ends || name[at + 2] == 'j')) return true;
  }
  return false;
}

bool says_thumb(const RobotModel& model, const SerialFinger& finger) {
  return std::any_of(finger.joints.begin(), finger.joints.end(), [&](std::size_t j) {
    return says_thumb(model.joints[j].name) || says_thumb(model.links[model.joints[j].child_link].name);
  });
}

std::pair<std::size_t, ThumbRule> find_thumb(const RobotModel& model, const Fingers& fingers) {
  if (fingers.size() > 2) {
    if (const auto by_axis = leader(axis_scores(fingers), kAxisLead_rad)) return {*by_axis, ThumbRule::kAxis};
    if (const auto by_base = leader(base_scores(fingers), kBaseLead)) return {*by_base, ThumbRule::kBase};
  }
  std::vector<double> named, driven;
  for (const SerialFinger& finger : fingers) {
    named.push_back(says_thumb(model, finger) ? 1.0 : 0.0);
    driven.push_back(model.joints[finger.joints.front()].mimic ? 0.0 : 1.0);
  }
  if (const auto by_name = leader(named, 1.0)) return {*by_name, ThumbRule::kName};
  const auto by_motor = leader(driven, 1.0);
  return {fingers.size() == 2 ? by_motor.value_or(0) : 0, ThumbRule::kFirst};
}

Vector3d mean_knuckle(const Fingers& fingers) {
  Vector3d sum = Vector3d::Zero();
  for (const SerialFinger& finger : fingers) sum += finger.p_knuckle_P;
  return sum / static_cast<double>(fingers.size());
}

/// Unit vector along the knuckles (sign without meaning); 0 for one finger.
Vector3d knuckle_line(const Fingers& fingers) {
  if (fingers.size() < 2) return Vector3d::Zero();
  const Vector3d centre = mean_knuckle(fingers);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const SerialFinger& finger : fingers) {
    scatter += (finger.p_knuckle_P - centre) * (finger.p_knuckle_P - centre).transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
}

/// Where the middle of the thumb's length is: its base alone may sit under the middle of the palm.
Vector3d thumb_place(const SerialFinger& thumb) {
  return 0.5 * (thumb.p_knuckle_P + thumb.p_tip_P);
}

/// Finger direction and palmar direction of the fingers other than the thumb. False if they cancel out.
bool find_palm_frame(const SerialFinger& thumb, const Fingers& fingers, math::Pose& X_PQ) {
  Vector3d distal = Vector3d::Zero(), palmar = Vector3d::Zero();
  for (const SerialFinger& finger : fingers) {
    distal += finger.direction_P();
    if (finger.v_closing_P.norm() > 1e-9) palmar += finger.v_closing_P.normalized();
  }
  if (distal.norm() < 1e-6) {  // tips unknown: from the hand's base to the knuckles is all there is
    distal = palmar.cross(knuckle_line(fingers));
    if (distal.dot(mean_knuckle(fingers) - thumb.p_knuckle_P) < 0.0) distal = -distal;
  }
  if (distal.norm() < 1e-6) return false;
  distal.normalize();
  palmar -= palmar.dot(distal) * distal;
  if (palmar.norm() < 1e-6) return false;
  palmar.normalize();
  X_PQ.linear() << distal, palmar, distal.cross(palmar);
  X_PQ.translation() = mean_knuckle(fingers);
  return true;
}

void find_side(const SerialFinger& thumb, const Fingers& fingers, HandAnatomy& hand) {
  const Vector3d z = hand.X_PQ.linear().col(2);
  double breadth = 0.0;
  for (const SerialFinger& finger : fingers) {
    breadth = std::max(breadth, 2.0 * std::abs(z.dot(finger.p_knuckle_P - hand.X_PQ.translation())));
  }
  const double towards_thumb = z.dot(thumb_place(thumb) - hand.X_PQ.translation());
  hand.side_sure = fingers.size() > 1 && std::abs(towards_thumb) > kMiddle * breadth && breadth > 0.0;
  hand.side = hand.side_sure && towards_thumb < 0.0 ? Side::kLeft : Side::kRight;
}

/// Index finger first: along the thumb side, or against it in a left hand.
void sort_fingers(Fingers& fingers, const HandAnatomy& hand) {
  Vector3d line = knuckle_line(fingers);
  const Vector3d thumb_side = (hand.side == Side::kRight ? 1.0 : -1.0) * hand.X_PQ.linear().col(2);
  if (line.dot(thumb_side) < 0.0) line = -line;
  std::stable_sort(fingers.begin(), fingers.end(), [&](const SerialFinger& a, const SerialFinger& b) {
    return line.dot(a.p_knuckle_P) > line.dot(b.p_knuckle_P);
  });
}

std::vector<MimicGroup> mimic_groups(const RobotModel& model) {
  std::vector<MimicGroup> groups;
  for (std::size_t source = 0; source < model.joints.size(); ++source) {
    MimicGroup group{source, {}};
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      if (model.joints[j].mimic && model.joints[j].mimic->joint == source) group.followers.push_back(j);
    }
    if (!group.followers.empty()) groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace

Result<HandAnatomy> find_hand_anatomy(const RobotModel& model) {
  Result<SerialFingers> chains = find_serial_fingers(model);
  if (!chains) return chains.error();
  HandAnatomy hand;
  hand.palm_link = chains->palm_link;
  hand.wrist_joints = chains->wrist_joints;
  hand.bars = chains->bars;
  hand.mimic_groups = mimic_groups(model);
  Fingers fingers = chains->fingers;
  const auto [thumb, rule] = find_thumb(model, fingers);
  hand.thumb_rule = rule;
  const SerialFinger thumb_chain = fingers[thumb];
  hand.fingers[static_cast<std::size_t>(Finger::kThumb)] = thumb_chain;
  fingers.erase(fingers.begin() + static_cast<std::ptrdiff_t>(thumb));
  if (!find_palm_frame(thumb_chain, fingers, hand.X_PQ)) {
    return make_error(Errc::kUnsupported, "the fingers of '%.60s' neither point nor close into one direction",
                      model.name.c_str());
  }
  find_side(thumb_chain, fingers, hand);
  sort_fingers(fingers, hand);
  for (std::size_t i = 0; i < fingers.size(); ++i) {
    if (i + 1 < kFingers) {
      hand.fingers[i + 1] = fingers[i];
    } else {
      hand.left_out.push_back(fingers[i]);
    }
  }
  return hand;
}

}  // namespace embody::robot
