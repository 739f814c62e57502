#include "core/robot/serial_fingers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace embody::robot {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kThickness_m = 0.02;    // joints nearer to each other than a finger is thick: no phalanx between them
constexpr double kDirection_m = 0.005;   // shorter segments tell no direction
constexpr double kPhalanxRatio = 0.8;    // of a phalanx to the one before it; human: 0.75 to 0.9 with the soft tip
constexpr double kFingerPerPitch = 4.4;  // human middle finger (92 mm) per spacing of the knuckles (21 mm)
constexpr double kParallelCos = 0.7;     // axes within 45 degrees flex the same finger
constexpr double kUndecided = 0.1;  // rooms to turn that differ by less of the range do not tell which way is closing

constexpr std::size_t kMaxBranches = 32;

std::vector<std::size_t> children_of(const RobotModel& model, std::size_t link) {
  std::vector<std::size_t> joints;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].parent_link == link) joints.push_back(j);
  }
  return joints;
}

/// Links that are joined to `link` by fixed joints, itself first, and the moving joints that leave them.
struct Body {
  std::vector<std::size_t> links;
  std::vector<std::size_t> moving;
};

Body body_of(const RobotModel& model, std::size_t link) {
  Body body{{link}, {}};
  for (std::size_t i = 0; i < body.links.size(); ++i) {
    for (const std::size_t j : children_of(model, body.links[i])) {
      if (model.joints[j].type == JointType::kFixed) {
        body.links.push_back(model.joints[j].child_link);
      } else {
        body.moving.push_back(j);
      }
    }
  }
  return body;
}

std::vector<std::size_t> path_from_root(const RobotModel& model, std::size_t link) {
  std::vector<std::size_t> path{link};
  while (model.links[path.back()].parent_joint != kNoIndex) {
    path.push_back(model.joints[model.links[path.back()].parent_joint].parent_link);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

std::size_t common_ancestor(const RobotModel& model, const std::vector<SerialFinger>& chains) {
  std::vector<std::size_t> common = path_from_root(model, chains.front().base_link);
  for (const SerialFinger& chain : chains) {
    const std::vector<std::size_t> path = path_from_root(model, chain.base_link);
    const auto end = std::mismatch(common.begin(), common.end(), path.begin(), path.end()).first;
    common.erase(end, common.end());
  }
  return common.back();
}

/// Independent joint that `joint` follows, and its rate.
std::pair<std::size_t, double> source(const RobotModel& model, std::size_t joint) {
  const auto& mimic = model.joints[joint].mimic;
  return mimic ? std::pair{mimic->joint, mimic->multiplier} : std::pair{joint, 1.0};
}

/// Appends one chain for every leaf body below the joints of `chain`.
void add_chains(const RobotModel& model, SerialFinger chain, std::size_t joint, std::vector<SerialFinger>& chains) {
  if (chain.joints.empty()) chain.base_link = model.joints[joint].parent_link;
  chain.joints.push_back(joint);
  chain.last_link = chain.tip_link = model.joints[joint].child_link;
  const Body body = body_of(model, chain.last_link);
  for (const std::size_t next : body.moving) add_chains(model, chain, next, chains);
  if (body.moving.empty()) chains.push_back(chain);
}

/// What the rules below look at: the model in its open posture.
struct Scene {
  const RobotModel& model;
  JointValues q;
  std::vector<math::Pose> X_PL;

  [[nodiscard]] Vector3d origin_P(std::size_t joint) const {
    return X_PL[model.joints[joint].child_link].translation();
  }
  [[nodiscard]] Vector3d axis_P(std::size_t joint) const {
    return X_PL[model.joints[joint].child_link].linear() * model.joints[joint].axis;
  }
};

void find_knuckle(const Scene& scene, SerialFinger& chain) {
  const Vector3d last = scene.axis_P(chain.joints.back());
  const bool slides = scene.model.joints[chain.joints.back()].type == JointType::kPrismatic;
  chain.knuckle = chain.joints.size() - 1;
  for (std::size_t i = chain.joints.size(); i-- > 0;) {
    const bool same_kind = (scene.model.joints[chain.joints[i]].type == JointType::kPrismatic) == slides;
    if (same_kind && std::abs(scene.axis_P(chain.joints[i]).dot(last)) > kParallelCos) chain.knuckle = i;
  }
  chain.p_knuckle_P = scene.origin_P(chain.joints[chain.knuckle]);
  chain.p_last_P = scene.origin_P(chain.joints.back());
}

/// The last joint-to-joint segment longer than `least`, joint origins from the palm's end; 0 if there is none.
Vector3d last_segment(const Scene& scene, const SerialFinger& chain, double least) {
  for (std::size_t i = chain.joints.size(); i-- > 1;) {
    Vector3d segment = scene.origin_P(chain.joints[i]) - scene.origin_P(chain.joints[i - 1]);
    if (segment.norm() > least) return segment;
  }
  return Vector3d::Zero();
}

/// The link fixed to the last moving link that is farthest from the last joint.
std::size_t farthest_leaf(const Scene& scene, const SerialFinger& chain) {
  const auto distance = [&](std::size_t link) { return (scene.X_PL[link].translation() - chain.p_last_P).norm(); };
  const Body body = body_of(scene.model, chain.last_link);
  return *std::max_element(body.links.begin(), body.links.end(),
                           [&](std::size_t a, std::size_t b) { return distance(a) < distance(b) - 1e-9; });
}

/// Sum of segments from the first joint to the farthest fixed link: what the URDF says about the finger's length.
double known_length(const Scene& scene, const SerialFinger& chain) {
  double length = (scene.X_PL[farthest_leaf(scene, chain)].translation() - chain.p_last_P).norm();
  for (std::size_t i = 1; i < chain.joints.size(); ++i) {
    length += (scene.origin_P(chain.joints[i]) - scene.origin_P(chain.joints[i - 1])).norm();
  }
  return length;
}

/// True for the second bar of the linkage of `finger`: much shorter, and turning in the same plane.
bool is_bar(const Scene& scene, const SerialFinger& chain, const SerialFinger& finger) {
  if (last_segment(scene, chain, kThickness_m) != Vector3d::Zero()) return false;
  if (known_length(scene, chain) > 0.5 * known_length(scene, finger)) return false;
  if (last_segment(scene, finger, kThickness_m) == Vector3d::Zero()) return false;
  const Vector3d axis = scene.axis_P(finger.joints[finger.knuckle]);
  const bool parallel = std::abs(scene.axis_P(chain.joints.back()).dot(axis)) > 0.98;
  return parallel && std::abs((chain.p_last_P - finger.p_knuckle_P).dot(axis)) < kDirection_m;
}

void split_bars(const Scene& scene, SerialFingers& hand) {
  const std::vector<SerialFinger> all = hand.fingers;
  hand.fingers.clear();
  for (const SerialFinger& chain : all) {
    const bool bar = std::any_of(all.begin(), all.end(), [&](const SerialFinger& other) {
      return &other != &chain && is_bar(scene, chain, other);
    });
    (bar ? hand.bars : hand.fingers).push_back(chain);
  }
}

/// Median distance of the knuckles from their nearest neighbours, m; 0 if unknown.
double knuckle_pitch(const std::vector<SerialFinger>& fingers) {
  std::vector<double> nearest;
  for (const SerialFinger& finger : fingers) {
    double least = std::numeric_limits<double>::infinity();
    for (const SerialFinger& other : fingers) {
      if (&other != &finger) least = std::min(least, (other.p_knuckle_P - finger.p_knuckle_P).norm());
    }
    if (std::isfinite(least)) nearest.push_back(least);
  }
  std::sort(nearest.begin(), nearest.end());
  return nearest.empty() ? 0.0 : nearest[(nearest.size() - 1) / 2];
}

/// Which way the finger's own frames and joints say that its last link goes; 0 if they do not.
Vector3d own_direction(const Scene& scene, const SerialFinger& chain) {
  const Vector3d leaf = scene.X_PL[farthest_leaf(scene, chain)].translation() - chain.p_last_P;
  const Vector3d along = leaf.norm() > kDirection_m ? leaf : last_segment(scene, chain, kDirection_m);
  return along.norm() > kDirection_m ? Vector3d(along.normalized()) : Vector3d::Zero();
}

Vector3d across(const Vector3d& v, const Vector3d& axis) {
  const Vector3d in_plane = v - v.dot(axis) * axis;
  return in_plane.norm() > 1e-3 * v.norm() && v.norm() > 0.0 ? Vector3d(in_plane.normalized()) : Vector3d::Zero();
}

/// +1 or -1: the way in which the independent joint has more room from the open posture; 0: no way in particular.
double closing_sign(const Scene& scene, std::size_t joint) {
  const JointRange range = motor_range(scene.model, joint);
  const double up = range.upper - scene.q[joint], down = scene.q[joint] - range.lower;
  if (std::abs(up - down) <= kUndecided * (range.upper - range.lower)) return 0.0;
  return up > down ? 1.0 : -1.0;
}

/// Axis of the last joint, turned so that closing is positive (as far as the ranges tell).
Vector3d last_closing_axis(const Scene& scene, const SerialFinger& chain) {
  const auto [from, multiplier] = source(scene.model, chain.joints.back());
  const bool backwards = (closing_sign(scene, from) < 0.0) != (multiplier < 0.0);
  return (backwards ? -1.0 : 1.0) * scene.axis_P(chain.joints.back());
}

/// own_direction(), else that of the fingers that close the same way, else from the palm link's origin to the joint;
/// the latter two in the plane in which the joint turns.
Vector3d last_direction(const Scene& scene, const SerialFingers& hand, const SerialFinger& chain) {
  Vector3d direction = own_direction(scene, chain);
  if (direction != Vector3d::Zero()) return direction;
  const Vector3d axis = last_closing_axis(scene, chain);
  if (scene.model.joints[chain.joints.back()].type == JointType::kPrismatic) return Vector3d::Zero();
  for (const SerialFinger& other : hand.fingers) {
    if (last_closing_axis(scene, other).dot(axis) > kParallelCos) direction += own_direction(scene, other);
  }
  if (direction.norm() < 0.1) direction = chain.p_last_P - scene.X_PL[hand.palm_link].translation();
  return across(direction, axis);
}

void find_tip(const Scene& scene, const SerialFingers& hand, double pitch_m, SerialFinger& chain) {
  const double phalanx_m = last_segment(scene, chain, kThickness_m).norm();
  const double expected_m = phalanx_m > 0.0 ? kPhalanxRatio * phalanx_m : kFingerPerPitch * pitch_m;
  const std::size_t leaf = farthest_leaf(scene, chain);
  const double leaf_m = (scene.X_PL[leaf].translation() - chain.p_last_P).norm();
  if (leaf_m > kDirection_m && leaf_m >= 0.5 * expected_m) {
    chain.tip_rule = TipRule::kLeafFrame;
    chain.tip_link = leaf;
    chain.p_tip_P = scene.X_PL[leaf].translation();
    return;
  }
  const Vector3d direction =
      phalanx_m > 0.0 ? last_segment(scene, chain, kThickness_m).normalized() : last_direction(scene, hand, chain);
  chain.tip_link = chain.last_link;
  if (direction == Vector3d::Zero() || expected_m == 0.0) {
    chain.tip_rule = TipRule::kLinkOrigin;
    chain.p_tip_P = chain.p_last_P;
    return;
  }
  chain.tip_rule = phalanx_m > 0.0 ? TipRule::kPhalanx : TipRule::kProportions;
  chain.p_tip_P = chain.p_last_P + expected_m * direction;
  chain.p_tip_L = scene.X_PL[chain.last_link].inverse() * chain.p_tip_P;
}

/// The independent joints that turn the finger about nearly the knuckle's axis: those that close it.
std::vector<std::size_t> flexing_sources(const Scene& scene, const SerialFinger& chain) {
  std::vector<std::size_t> sources;
  const Vector3d axis = scene.axis_P(chain.joints.back());
  for (std::size_t i = chain.knuckle; i < chain.joints.size(); ++i) {
    if (std::abs(scene.axis_P(chain.joints[i]).dot(axis)) <= kParallelCos) continue;
    const std::size_t from = source(scene.model, chain.joints[i]).first;
    if (std::find(sources.begin(), sources.end(), from) == sources.end()) sources.push_back(from);
  }
  return sources;
}

/// Closing rate of each source: by its own range; a source with even range turns the way the decided ones do.
std::vector<double> closing_rates(const Scene& scene, SerialFinger& chain, const std::vector<std::size_t>& sources) {
  std::vector<double> rates;
  Vector3d decided = Vector3d::Zero();
  const auto axis_of = [&](std::size_t from) {
    for (std::size_t i = chain.knuckle; i < chain.joints.size(); ++i) {
      const auto [joint, multiplier] = source(scene.model, chain.joints[i]);
      if (joint == from) return Vector3d(multiplier * scene.axis_P(chain.joints[i]));
    }
    return Vector3d(Vector3d::Zero());
  };
  for (const std::size_t from : sources) {
    rates.push_back(closing_sign(scene, from));
    decided += rates.back() * axis_of(from);
  }
  chain.closing_sure = decided != Vector3d::Zero();
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (rates[i] == 0.0) rates[i] = decided.dot(axis_of(sources[i])) < 0.0 ? -1.0 : 1.0;
  }
  return rates;
}

void find_closing(const Scene& scene, SerialFinger& chain) {
  const std::vector<std::size_t> sources = flexing_sources(scene, chain);
  const std::vector<double> rates = closing_rates(scene, chain, sources);
  chain.v_closing_P.setZero();
  for (const std::size_t j : chain.joints) {
    const auto [from, multiplier] = source(scene.model, j);
    const auto at = std::find(sources.begin(), sources.end(), from);
    if (at == sources.end()) continue;
    const double rate = multiplier * rates[static_cast<std::size_t>(at - sources.begin())];
    const bool slides = scene.model.joints[j].type == JointType::kPrismatic;
    const Vector3d axis = scene.axis_P(j);
    chain.v_closing_P += rate * (slides ? axis : axis.cross(chain.p_tip_P - scene.origin_P(j)));
  }
  const Vector3d turn = (chain.p_tip_P - chain.p_knuckle_P).cross(chain.v_closing_P);
  chain.closing_axis_P = turn.norm() > 1e-9 ? Vector3d(turn.normalized()) : Vector3d::Zero();
}

}  // namespace

JointRange motor_range(const RobotModel& model, std::size_t joint) {
  const auto own = [](const Joint& j) {
    const bool unbounded = !std::isfinite(j.lower) || !std::isfinite(j.upper);
    return unbounded ? JointRange{-kPi, kPi} : JointRange{j.lower, j.upper};
  };
  JointRange range = own(model.joints[joint]);
  for (const Joint& follower : model.joints) {
    if (!follower.mimic || follower.mimic->joint != joint || follower.mimic->multiplier == 0.0) continue;
    if (!std::isfinite(follower.lower)) continue;
    double a = (follower.lower - follower.mimic->offset) / follower.mimic->multiplier;
    double b = (follower.upper - follower.mimic->offset) / follower.mimic->multiplier;
    if (a > b) std::swap(a, b);
    range = {std::max(range.lower, a), std::min(range.upper, b)};
  }
  return range.lower <= range.upper ? range : own(model.joints[joint]);
}

void follow_mimics(const RobotModel& model, JointValues& q) {
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (const auto& mimic = model.joints[j].mimic) q[j] = mimic->multiplier * q[mimic->joint] + mimic->offset;
  }
}

JointValues open_posture(const RobotModel& model) {
  JointValues q(model.joints.size(), 0.0);
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].type == JointType::kFixed || model.joints[j].mimic) continue;
    const JointRange range = motor_range(model, j);
    q[j] = std::clamp(0.0, range.lower, range.upper);
  }
  follow_mimics(model, q);
  return q;
}

std::vector<math::Pose> link_poses(const RobotModel& model, const JointValues& q) {
  std::vector<math::Pose> X_PL(model.links.size(), math::Pose::Identity());
  for (std::size_t j = 0; j < model.joints.size(); ++j) {  // parents come first
    const Joint& joint = model.joints[j];
    math::Pose X = X_PL[joint.parent_link] * joint.X_PC;
    if (joint.type == JointType::kPrismatic) X.translate(q[j] * joint.axis);
    if (joint.type == JointType::kRevolute || joint.type == JointType::kContinuous) {
      X.rotate(Eigen::AngleAxisd(q[j], joint.axis));
    }
    X_PL[joint.child_link] = X;
  }
  return X_PL;
}

Result<SerialFingers> find_serial_fingers(const RobotModel& model) {
  SerialFingers hand;
  Body body = body_of(model, 0);
  while (body.moving.size() == 1) {
    hand.wrist_joints.push_back(body.moving.front());
    body = body_of(model, model.joints[body.moving.front()].child_link);
  }
  if (body.moving.empty()) {
    return make_error(Errc::kUnsupported,
                      "no link of '%.60s' carries two moving joints: a hand needs at least two fingers on one palm",
                      model.name.c_str());
  }
  for (const std::size_t joint : body.moving) add_chains(model, {}, joint, hand.fingers);
  if (hand.fingers.size() > kMaxBranches) {
    return make_error(Errc::kUnsupported, "'%.60s' has %zu branches of moving joints: more than %zu are no hand",
                      model.name.c_str(), hand.fingers.size(), kMaxBranches);
  }
  hand.palm_link = common_ancestor(model, hand.fingers);
  Scene scene{model, open_posture(model), {}};
  scene.X_PL = link_poses(model, scene.q);
  for (SerialFinger& chain : hand.fingers) find_knuckle(scene, chain);
  split_bars(scene, hand);
  if (hand.fingers.size() < 2) {
    return make_error(Errc::kUnsupported,
                      "'%.60s' has one finger and %zu bars of its linkage; a hand needs two fingers",
                      model.name.c_str(), hand.bars.size());
  }
  const double pitch_m = knuckle_pitch(hand.fingers);
  for (SerialFinger& chain : hand.fingers) find_tip(scene, hand, pitch_m, chain);
  for (SerialFinger& chain : hand.fingers) find_closing(scene, chain);
  return hand;
}

}  // namespace embody::robot
