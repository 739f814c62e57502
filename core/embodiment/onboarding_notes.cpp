// What a person has to check by eye after onboarding: one sentence for every guess.
#include <algorithm>
#include <cstdarg>
#include <cstdio>

#include "core/embodiment/onboarding.hpp"

namespace embody {
namespace {

using robot::HandAnatomy;
using robot::RobotModel;
using robot::SerialFinger;
using robot::ThumbRule;
using robot::TipRule;

using Notes = std::vector<std::string>;

__attribute__((format(printf, 2, 3))) void note(Notes& notes, const char* format, ...) {
  char text[512];
  va_list args;
  va_start(args, format);
  std::vsnprintf(text, sizeof text, format, args);
  va_end(args);
  notes.emplace_back(text);
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string joint_names(const RobotModel& model, const std::vector<std::size_t>& joints) {
  std::vector<std::string> names;
  names.reserve(joints.size());
  for (const std::size_t j : joints) names.push_back(model.joints[j].name);
  return joined(names);
}

std::string fingers_with(const HandAnatomy& hand, bool (*has)(const SerialFinger&)) {
  std::vector<std::string> names;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (hand.fingers[f] && has(*hand.fingers[f])) names.emplace_back(kFingerNames[f]);
  }
  return joined(names);
}

void note_thumb(const RobotModel& model, const HandAnatomy& hand, Notes& notes) {
  const std::string& link = model.links[hand.finger(Finger::kThumb)->last_link].name;
  switch (hand.thumb_rule) {
    case ThumbRule::kAxis:
      break;
    case ThumbRule::kBase:
      note(notes, "Thumb: '%s' was taken because its base is apart; its axis does not tell.", link.c_str());
      break;
    case ThumbRule::kName:
      note(notes, "Thumb: '%s' was taken for its name; the geometry does not tell.", link.c_str());
      break;
    case ThumbRule::kFirst:
      note(notes, "No thumb stands out: '%s' was taken; exchange the tables if another finger should be the thumb.",
           link.c_str());
  }
}

void note_tips(const HandAnatomy& hand, Notes& notes) {
  const auto by_rule = [&](bool (*has)(const SerialFinger&), const char* what) {
    if (const std::string names = fingers_with(hand, has); !names.empty()) {
      note(notes, "Tip of %s: %s; correct tip_m and the pads.", names.c_str(), what);
    }
  };
  by_rule([](const SerialFinger& c) { return c.tip_rule == TipRule::kPhalanx; },
          "the URDF has no frame there, taken as 0.8 of the last phalanx beyond the last joint");
  by_rule([](const SerialFinger& c) { return c.tip_rule == TipRule::kProportions; },
          "the URDF tells no length, taken as 4.4 spacings of the knuckles, as in a human hand");
  by_rule([](const SerialFinger& c) { return c.tip_rule == TipRule::kLinkOrigin; },
          "the URDF tells neither direction nor length, taken as the last joint");
}

void note_joints(const RobotModel& model, const HandAnatomy& hand, Notes& notes) {
  if (!hand.wrist_joints.empty()) {
    note(notes, "Joints before the palm stand still at 0: %s.", joint_names(model, hand.wrist_joints).c_str());
  }
  for (const SerialFinger& bar : hand.bars) {
    note(notes, "'%s' was taken for the second bar of a linkage, not for a finger.",
         model.links[bar.last_link].name.c_str());
  }
  for (const SerialFinger& extra : hand.left_out) {
    note(notes, "The finger with '%s' is the sixth or later and stands still.",
         model.links[extra.last_link].name.c_str());
  }
  if (const std::string unsure = fingers_with(hand, [](const SerialFinger& c) { return !c.closing_sure; });
      !unsure.empty()) {
    note(notes, "Closing direction of %s: the joints may turn as far either way, positive was taken.", unsure.c_str());
  }
}

void note_motors(const RobotModel& model, const EmbodimentConfig& config, Notes& notes) {
  std::vector<std::string> endless, sliding;
  for (const std::string& motor : config.motors) {
    const robot::Joint& joint = model.joints[*model.find_joint(motor)];
    if (joint.type == robot::JointType::kContinuous) endless.push_back(motor);
    if (joint.type == robot::JointType::kPrismatic) sliding.push_back(motor);
  }
  if (!endless.empty()) note(notes, "Without limits in the URDF, +-pi was taken: %s.", joined(endless).c_str());
  if (!sliding.empty()) {
    note(notes, "Sliding joints, whose limits are in m and whose open end may be the other one: %s.",
         joined(sliding).c_str());
  }
}

/// Joints of one finger that flex independently in the URDF although most hands drive them together.
void note_couplings(const RobotModel& model, const HandAnatomy& hand, Notes& notes) {
  std::vector<std::string> fingers;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!hand.fingers[f]) continue;
    std::size_t independent = 0;
    for (std::size_t i = hand.fingers[f]->knuckle; i < hand.fingers[f]->joints.size(); ++i) {
      if (!model.joints[hand.fingers[f]->joints[i]].mimic) ++independent;
    }
    if (independent > 1) fingers.emplace_back(kFingerNames[f]);
  }
  if (!fingers.empty()) {
    note(notes,
         "Every joint of %s has a motor of its own in the URDF; if one motor or tendon moves several of them, name it "
         "in "
         "motors and add [[couplings]].",
         joined(fingers).c_str());
  }
  note(
      notes,
      "A URDF cannot say what is not proportional (cranks, tendons that bend one joint after the other) nor what moves "
      "joints of several fingers: compare motors with the hand's manual.");
}

void note_score(const OnboardingScore& score, Notes& notes) {
  if (score.scale < 0.8 || score.scale > 1.25) {
    note(notes, "The robot's fingers are %.2f times as long as the human's: expect the finger tips to miss by some cm.",
         score.scale);
  }
  for (std::size_t f = 1; f < kFingers; ++f) {
    if (!score.fingers[f] || score.fingers[f]->pinch_m.value_or(0.0) <= 2.5 * kDefaultPadRadius_m) continue;
    note(notes, "Thumb and %s come no nearer than %.0f mm: no pinch, or thumb and tips are not where they were taken.",
         kFingerNames[f], 1e3 * *score.fingers[f]->pinch_m);
  }
}

}  // namespace

std::vector<std::string> onboarding_notes(const RobotModel& model, const HandAnatomy& hand,
                                          const EmbodimentConfig& config, const OnboardingScore& score) {
  Notes notes;
  note_thumb(model, hand, notes);
  if (!hand.side_sure) {
    note(notes, "Side: the thumb stands in the middle or beside one finger; right was taken.");
  } else {
    note(notes, "Side: %s, guessed from where the thumb stands; a hand of the other side needs another file_side.",
         kSideNames[static_cast<std::size_t>(hand.side)]);
  }
  note_tips(hand, notes);
  note_joints(model, hand, notes);
  note_motors(model, config, notes);
  note_couplings(model, hand, notes);
  note_score(score, notes);
  note(notes, "Pads are capsules of at most %.0f mm radius along the last links: measure the hand's.",
       1e3 * kDefaultPadRadius_m);
  return notes;
}

}  // namespace embody
