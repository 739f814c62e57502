#include "drivers/ur_rtde/control_script.hpp"

#include <array>
#include <charconv>
#include <string_view>

#include "drivers/ur_rtde/arm_package.hpp"

namespace embody::rtde {
namespace {

// Words in capitals between @ are replaced by numbers. Written for somebody who reads it at the teach pendant. Only one
// thread, no nested functions, no mixed types: what is known to behave the same on every controller since CB3.
constexpr std::string_view kTemplate = R"(def embody_control():
  # embody: moves the arm to joint targets that a computer writes into RTDE registers.
  #   read:    int 24  sequence, changes with each command
  #            int 25  mode: 0 hold, 1 track, 9 exit
  #            float 24-29  target joint positions, rad
  #            float 30-35  target joint velocities, rad/s
  #   written: int 24  newest sequence seen
  #            int 25  state: 0 starting, 1 hold, 2 tracking, 3 stale, 9 ended
  #            int 26  fault: 1 stale, 2 first target too far, 4 target out of range,
  #                    16 the arm was stopped or moved by something else
  #            int 27  version of this table
  # The arm stands still until mode 0 was followed by mode 1 with a changing sequence
  # and a target near the arm. It brakes when the sequence stands still.
  # This is no safety function: the safety settings of the robot apply on top of it.

  # Limits of each joint, base to wrist 3.
  VMAX = @VMAX@ # rad/s
  AMAX = @AMAX@ # rad/s^2
  QMIN = @QMIN@ # rad
  QMAX = @QMAX@ # rad
  KP = @KP@ # 1/s, velocity per distance close to the target
  NEAR = @NEAR@ # rad, largest distance of the first target
  AWAY = @AWAY@ # rad, larger than any lag of the robot's set-point behind this program
  FAST = @FAST@ # rad/s, at this speed the robot's set-point cannot be standing still
  dt = get_steptime()
  STALE = floor(@STALE@ / dt + 0.5) # control cycles without a new sequence (more time at a reduced speed slider)

  # At rest first: an earlier program may have been moving the arm.
  write_output_integer_register(25, 0)
  write_output_integer_register(26, 0)
  stopj(@STOP@)

  state = 1
  fault = 0
  armed = False # mode has been 0 since the last fault
  last = read_input_integer_register(24)
  age = STALE
  cmd = get_target_joint_positions()
  vel = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
  tgt = cmd
  ff = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
  x = cmd

  # The controller ends this program when no commands arrive at all.
  rtde_set_watchdog("input_int_register_24", @WATCHDOG@, "stop")
  write_output_integer_register(24, last)
  write_output_integer_register(25, state)
  write_output_integer_register(27, @VERSION@)

  mode = read_input_integer_register(25)
  while mode != 9:
    # Is the sender alive? Its sequence must change; that packages arrive is not enough.
    seq = read_input_integer_register(24)
    if seq != last:
      age = 0
      last = seq
    elif age < STALE:
      age = age + 1
    end

    # After a pause or a safeguard stop the arm is not where this program left it:
    # go on from where it stands, at rest and disarmed. Never back to the old target.
    here = get_target_joint_positions()
    speed = get_target_joint_speeds()
    k = 0
    lost = False
    while k < 6:
      if not (norm(cmd[k] - here[k]) < AWAY[k]):
        lost = True
      end
      if (norm(vel[k]) > FAST[k]) and (norm(speed[k]) < 0.001):
        lost = True
      end
      k = k + 1
    end
    if lost:
      cmd = here
      tgt = here
      vel = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
      ff = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
      state = 1
      fault = 16
      armed = False
    end

    if mode != 1:
      state = 1
      fault = 0
      armed = (mode == 0)
    elif age >= STALE:
      if state == 2:
        fault = 1
      end
      state = 3
      armed = False
    elif armed or (state == 2):
      # Comparisons are such that a value that is not a number fails them.
      ok = True
      k = 0
      while k < 6:
        x[k] = read_input_float_register(24 + k)
        if not ((x[k] >= QMIN[k]) and (x[k] <= QMAX[k])):
          ok = False
          fault = 4
        end
        ff[k] = read_input_float_register(30 + k)
        if not (norm(ff[k]) < VMAX[k]):
          ff[k] = 0.0
        end
        k = k + 1
      end
      if ok and (state != 2):
        k = 0
        while k < 6:
          if not (norm(x[k] - cmd[k]) < NEAR):
            ok = False
            fault = 2
          end
          k = k + 1
        end
      end
      if ok:
        tgt = x
        state = 2
      else:
        # Tracking goes on towards the last good target; arming has failed.
        ff = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        armed = False
      end
    end

    # Bounded velocity and acceleration. The approach uses half of the acceleration,
    # the other half is left for the velocity that comes with the target.
    k = 0
    while k < 6:
      want = 0.0
      if state == 2:
        d = tgt[k] - cmd[k]
        want = sqrt(AMAX[k] * norm(d))
        if want > KP * norm(d):
          want = KP * norm(d)
        end
        if d < 0.0:
          want = -want
        end
        want = want + ff[k]
        if want > VMAX[k]:
          want = VMAX[k]
        elif want < -VMAX[k]:
          want = -VMAX[k]
        end
        # Never faster towards the end of the range than it can brake.
        room = QMAX[k] - cmd[k]
        if room < 0.0:
          room = 0.0
        end
        top = sqrt(AMAX[k] * room)
        if top > KP * room:
          top = KP * room
        end
        if want > top:
          want = top
        end
        room = cmd[k] - QMIN[k]
        if room < 0.0:
          room = 0.0
        end
        top = sqrt(AMAX[k] * room)
        if top > KP * room:
          top = KP * room
        end
        if want < -top:
          want = -top
        end
      end
      dv = want - vel[k]
      if dv > AMAX[k] * dt:
        dv = AMAX[k] * dt
      elif dv < -AMAX[k] * dt:
        dv = -AMAX[k] * dt
      end
      vel[k] = vel[k] + dv
      cmd[k] = cmd[k] + vel[k] * dt
      k = k + 1
    end

    write_output_integer_register(24, last)
    write_output_integer_register(25, state)
    write_output_integer_register(26, fault)
    servoj(cmd, t=dt, lookahead_time=@LOOKAHEAD@, gain=@GAIN@)
    mode = read_input_integer_register(25)
  end

  write_output_integer_register(25, 9)
  stopj(@STOP@)
end
)";

/// Shortest text that reads back as the same float; always with a point, never with an exponent.
std::string number(double value) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed).ptr;
  std::string digits(text.data(), end);
  if (digits.find('.') == std::string::npos) digits += ".0";
  return digits;
}

std::string list(const Vector6& values) {
  std::string text = "[";
  for (int i = 0; i < 6; ++i) text += (i > 0 ? ", " : "") + number(values[i]);
  return text + "]";
}

void replace_all(std::string& text, std::string_view word, const std::string& value) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + value.size())) {
    text.replace(at, word.size(), value);
  }
}

/// How far the controller's set-point may be behind the program: the look-ahead at full speed, and something more.
/// Whole thousandths, for the reader.
Vector6 away_rad(const ControlScriptConfig& config) {
  constexpr double kReserve = 0.05;
  const Eigen::Array<double, 6, 1> away = kReserve + 1.5 * config.lookahead_s * config.max_velocity_rad_s.array();
  return ((1e3 * away).ceil() / 1e3).matrix();
}

/// A speed that the program reaches from rest only after the look-ahead has passed.
Vector6 fast_rad_s(const ControlScriptConfig& config) {
  constexpr double kReserve = 0.1;
  const Eigen::Array<double, 6, 1> fast = kReserve + 1.5 * config.lookahead_s * config.max_acceleration_rad_s2.array();
  return ((1e3 * fast).ceil() / 1e3).matrix();
}

struct Bound {
  const char* name;
  double value;
  double least;
  double most;
};

Status check(const Bound& bound) {
  if (bound.value >= bound.least && bound.value <= bound.most) return {};
  return make_error(Errc::kInvalidArgument, "the control script's %s is %g; choose %g to %g", bound.name, bound.value,
                    bound.least, bound.most);
}

Status check_joints(const ControlScriptConfig& config) {
  constexpr double kSmallest = 1e-3;
  constexpr double kTurn = 6.2832;
  for (int i = 0; i < 6; ++i) {
    const std::array bounds{
        Bound{"largest joint velocity (rad/s)", config.max_velocity_rad_s[i], kSmallest, 6.3},
        Bound{"largest joint acceleration (rad/s^2)", config.max_acceleration_rad_s2[i], kSmallest, 40.0},
        Bound{"smallest joint angle (rad)", config.min_angle_rad[i], -kTurn, kTurn},
        Bound{"largest joint angle (rad)", config.max_angle_rad[i], -kTurn, kTurn}};
    for (const Bound& bound : bounds) {
      if (const Status valid = check(bound); !valid) return valid;
    }
    if (!(config.min_angle_rad[i] < config.max_angle_rad[i])) {
      return make_error(Errc::kInvalidArgument, "the control script's range of joint %d is empty: %g to %g rad", i + 1,
                        config.min_angle_rad[i], config.max_angle_rad[i]);
    }
  }
  return {};
}

Status check_scalars(const ControlScriptConfig& config) {
  const double stale_s = to_seconds(config.stale_after);
  const std::array bounds{Bound{"approach gain (1/s)", config.approach_gain_1_s, 1.0, 60.0},
                          Bound{"arming tolerance (rad)", config.arm_tolerance_rad, 1e-4, 0.5},
                          Bound{"time until commands are stale (s)", stale_s, 0.02, 0.2},
                          Bound{"servoj look-ahead time (s)", config.lookahead_s, 0.03, 0.2},
                          Bound{"servoj gain", config.gain, 100.0, 2000.0},
                          Bound{"deceleration at its end (rad/s^2)", config.stop_deceleration_rad_s2, 0.1, 40.0},
                          Bound{"watchdog frequency (Hz)", config.watchdog_hz, 0.5, 50.0}};
  for (const Bound& bound : bounds) {
    if (const Status valid = check(bound); !valid) return valid;
  }
  if (1.0 / config.watchdog_hz <= stale_s) {
    return make_error(Errc::kInvalidArgument,
                      "the control script's watchdog (%g Hz) would end it before commands count as stale (%g s)",
                      config.watchdog_hz, stale_s);
  }
  return {};
}

}  // namespace

Result<std::string> control_script(const ControlScriptConfig& config) {
  if (const Status valid = check_joints(config); !valid) return valid.error();
  if (const Status valid = check_scalars(config); !valid) return valid.error();
  std::string text(kTemplate);
  replace_all(text, "@VMAX@", list(config.max_velocity_rad_s));
  replace_all(text, "@AMAX@", list(config.max_acceleration_rad_s2));
  replace_all(text, "@QMIN@", list(config.min_angle_rad));
  replace_all(text, "@QMAX@", list(config.max_angle_rad));
  replace_all(text, "@KP@", number(config.approach_gain_1_s));
  replace_all(text, "@NEAR@", number(config.arm_tolerance_rad));
  replace_all(text, "@AWAY@", list(away_rad(config)));
  replace_all(text, "@FAST@", list(fast_rad_s(config)));
  replace_all(text, "@STALE@", number(to_seconds(config.stale_after)));
  replace_all(text, "@STOP@", number(config.stop_deceleration_rad_s2));
  replace_all(text, "@WATCHDOG@", number(config.watchdog_hz));
  replace_all(text, "@LOOKAHEAD@", number(config.lookahead_s));
  replace_all(text, "@GAIN@", number(config.gain));
  replace_all(text, "@VERSION@", std::to_string(kProgramVersion));
  return text;
}

}  // namespace embody::rtde
