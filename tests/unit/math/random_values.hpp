#pragma once
// Seeded random vectors for the tests of core/math. The engine is fixed by the standard; the mapping to doubles is
// ours.
#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace embody::test {

class RandomValues {
 public:
  explicit RandomValues(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [low, high).
  double operator()(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }

  template <int N>
  Eigen::Matrix<double, N, 1> vector(double low, double high) {
    Eigen::Matrix<double, N, 1> v;
    for (Eigen::Index i = 0; i < N; ++i) v(i) = (*this)(low, high);
    return v;
  }

  /// Rotation vector with a uniformly distributed angle in [0, most_rad).
  Eigen::Vector3d rotation(double most_rad) {
    Eigen::Vector3d axis = vector<3>(-1.0, 1.0);
    while (axis.norm() < 0.1) axis = vector<3>(-1.0, 1.0);
    return (*this)(0.0, most_rad) * axis.normalized();
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace embody::test
