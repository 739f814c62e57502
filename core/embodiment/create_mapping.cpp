// Construction of an EmbodimentMapping: the configuration checked against the hand's URDF.
#include <algorithm>
#include <cmath>

#include "core/embodiment/embodiment_mapping.hpp"

namespace embody {
namespace {

using robot::Coupling;
using robot::HandKinematics;
using robot::JointType;
using robot::kNoIndex;
using robot::RobotModel;

Error config_error(const char* key, const char* what) {
  return make_error(Errc::kInvalidArgument, "embodiment configuration: %s %s", key, what);
}

Status check(const RobotModel& model, const EmbodimentConfig& config) {
  if (model.links.empty() || model.links[0].name != config.root_link) {
    return config_error("root_link", "is not the root of the URDF");
  }
  if (!config.X_PM.allFinite()) return config_error("X_PM", "is not finite");
  if (!std::isfinite(config.finger_zero_offset_rad)) return config_error("finger_zero_offset_rad", "is not finite");
  if (!std::isfinite(config.thumb_opposed_from_rad)) return config_error("thumb_opposed_from_rad", "is not finite");
  if (config.motors.empty() || config.motors.size() > kMaxHandJoints) {
    return config_error("motors", "must name 1 to 32 motors");
  }
  for (const auto* limits : {&config.motor_lower_rad, &config.motor_upper_rad}) {
    const bool finite = std::all_of(limits->begin(), limits->end(), [](double x) { return std::isfinite(x); });
    if (limits->size() != config.motors.size() || !finite) {
      return config_error("motor_lower_rad and motor_upper_rad", "need one finite angle per motor");
    }
  }
  for (const double weight : {config.orientation_m, config.pinch_m, config.temporal_m_rad, config.collision_margin_m}) {
    if (!(weight >= 0.0) || !std::isfinite(weight)) {
      return config_error("orientation_m, pinch_m, temporal_m_rad, collision_margin_m", "must not be negative");
    }
  }
  return {};
}

Result<HandKinematics> make_kinematics(const RobotModel& model, const EmbodimentConfig& config) {
  robot::HandKinematicsSpec spec;
  spec.motors = config.motors;
  for (const JointCoupling& coupling : config.couplings) {
    if (coupling.motor_rad.size() != coupling.joint_rad.size()) {
      return config_error("couplings", "need as many entries in motor_rad as in joint_rad");
    }
    robot::NamedCoupling named{coupling.joint, coupling.motor, {}};
    for (std::size_t i = 0; i < coupling.motor_rad.size(); ++i) {
      named.knots.push_back({coupling.motor_rad[i], coupling.joint_rad[i]});
    }
    spec.couplings.push_back(std::move(named));
  }
  for (const std::string& name : config.zero_offset_joints) {
    spec.zero_offsets.push_back({name, config.finger_zero_offset_rad});
  }
  for (const FingerPoints& finger : config.fingers) {
    if (finger.link.empty()) continue;
    spec.points.push_back({finger.link, finger.tip_m});
    spec.points.push_back({finger.middle_link.empty() ? finger.link : finger.middle_link, finger.middle_m});
  }
  return HandKinematics::create(model, spec);
}

/// Range of a motor within the limits of the URDF joint of its name, such that every joint that follows it linearly
/// stays within its limits (knots are within them already), and the kinks in there.
Result<MotorRange> motor_range(const HandKinematics& hand, std::size_t motor, const std::string& name, double lower,
                               double upper) {
  std::vector<double> kinks;
  if (const auto own = hand.model().find_joint(name)) {
    lower = std::max(lower, hand.model().joints[*own].lower);
    upper = std::min(upper, hand.model().joints[*own].upper);
  }
  for (std::size_t j = 0; j < hand.couplings().size(); ++j) {
    const Coupling& c = hand.couplings()[j];
    if (c.motor != motor) continue;
    for (const robot::Knot& knot : c.knots) kinks.push_back(knot.motor);
    if (!c.knots.empty() || c.multiplier == 0.0) continue;
    const double a = (hand.model().joints[j].lower - c.offset) / c.multiplier;
    const double b = (hand.model().joints[j].upper - c.offset) / c.multiplier;
    lower = std::max(lower, std::min(a, b));
    upper = std::min(upper, std::max(a, b));
  }
  MotorRange range{lower, upper, {}};
  std::sort(kinks.begin(), kinks.end());
  kinks.erase(std::unique(kinks.begin(), kinks.end()), kinks.end());
  for (const double kink : kinks) {
    if (!(kink > lower && kink < upper)) continue;
    if (!range.kinks_rad.push_back(kink)) {
      return make_error(Errc::kUnsupported, "embodiment configuration: couplings of one motor have more than %zu knots",
                        kMaxKinks);
    }
  }
  return range;
}

}  // namespace

Result<EmbodimentMapping> EmbodimentMapping::create(const RobotModel& model, const EmbodimentConfig& config) {
  if (const Status status = check(model, config); !status) return status.error();
  Result<HandKinematics> kinematics = make_kinematics(model, config);
  if (!kinematics) return kinematics.error();
  EmbodimentMapping mapping(std::move(*kinematics));
  mapping.config_ = config;
  mapping.X_PM_ = math::exp_se3(config.X_PM);
  mapping.motor_names_ = config.motors;
  mapping.weights_.orientation_m = config.orientation_m;
  mapping.weights_.collision_m = config.collision_margin_m;
  if (config.pinch_m > 0.0 || config.collision_margin_m > 0.0) mapping.options_.max_iterations *= 3;  // stiff terms
  if (const Status status = mapping.make_ranges(config); !status) return status.error();
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].type == JointType::kFixed) continue;
    mapping.urdf_joints_.push_back(j);
    mapping.urdf_joint_names_.push_back(model.joints[j].name);
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (config.fingers[f].link.empty()) continue;
    const Result<RobotFinger> chain = RobotFinger::create(mapping.kinematics_, config.fingers[f]);
    if (!chain) {
      return make_error(chain.error().code, "embodiment configuration: [%s] %s", kFingerNames[f],
                        chain.error().detail.c_str());
    }
    mapping.chains_[f] = *chain;
    for (const std::size_t motor : chain->motors()) mapping.moves_[motor].set(f);
  }
  return mapping;
}

Status EmbodimentMapping::make_ranges(const EmbodimentConfig& config) {
  for (std::size_t m = 0; m < config.motors.size(); ++m) {
    auto range = motor_range(kinematics_, m, config.motors[m], config.motor_lower_rad[m], config.motor_upper_rad[m]);
    if (!range) return range.error();
    if (!(range->lower_rad <= range->upper_rad)) {
      return make_error(Errc::kInvalidArgument, "embodiment configuration: motor '%.60s' has an empty range",
                        config.motors[m].c_str());
    }
    if (config.motors[m] == config.thumb_motor) {
      thumb_motor_ = m;
      if (config.thumb_mode == ThumbMode::kOpposed) {
        *range = range->within(config.thumb_opposed_from_rad, range->upper_rad);
      }
      if (config.thumb_mode == ThumbMode::kLateral) *range = range->within(range->lower_rad, 0.0);
      lateral_ = config.thumb_mode == ThumbMode::kLateral;
    }
    ranges_.push_back(*range);
    last_rad_[m] = std::clamp(0.0, range->lower_rad, range->upper_rad);
  }
  if (!config.thumb_motor.empty() && thumb_motor_ == kNoIndex) {
    return config_error("thumb_motor", "is none of the motors");
  }
  return {};
}

}  // namespace embody
