#pragma once
// Register values of every kind: near, far, huge, not a number, any bit pattern.
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "drivers/sim/ur/registers.hpp"

namespace embody::sim {

class Adversary {
 public:
  explicit Adversary(unsigned seed) : random_(seed) {}
  RegisterInputs operator()(const Vector6& q) {
    RegisterInputs in;
    if (pick(8) != 0) ++sequence_;
    if (pick(400) == 0) silent_ = 40;
    if (silent_ > 0) sequence_ = last_.sequence, --silent_;
    constexpr std::array<std::int32_t, 8> kModes{0, 0, 0, 1, 2, -1, 3, 1 << 30};
    if (pick(100) == 0) mode_ = kModes[pick(kModes.size())];
    if (mode_ != 1 && pick(4) == 0) mode_ = 1;
    in.sequence = sequence_;
    in.mode = mode_;
    in.packages = ++packages_;
    wild_ = pick(10) == 0;
    if (pick(50) == 0) hurry_ = !hurry_;
    for (int i = 0; i < 6; ++i) {
      in.q_target_rad[i] = number(q[i]);
      in.qd_target_rad_s[i] = number(0.0) * (hurry_ ? 20.0 : 1.0);
    }
    return last_ = in;
  }

 private:
  std::uint64_t pick(std::uint64_t n) { return random_() % n; }
  double number(double near) {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    if (!wild_) return near + 0.05 * unit(random_);
    switch (pick(20)) {
      case 0:
        return std::nan("");
      case 1:
        return std::numeric_limits<double>::infinity();
      case 2:
        return std::bit_cast<double>(random_());
      case 3:
        return 1e300;
      default:
        return pick(3) == 0 ? 7.0 * unit(random_) : near + 0.05 * unit(random_);
    }
  }
  std::mt19937_64 random_;
  RegisterInputs last_;
  std::int32_t sequence_{0};
  std::int32_t mode_{0};
  std::uint64_t packages_{0};
  int silent_{0};
  bool wild_{false};
  bool hurry_{false};  ///< large velocities
};

}  // namespace embody::sim
