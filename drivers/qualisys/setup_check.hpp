#pragma once
// Is what QTM says about itself fit to drive a robot, and has it stayed so? Pure functions; each refusal is a sentence.
#include <array>
#include <string>
#include <vector>

#include "core/hal/types.hpp"
#include "drivers/qualisys/parameters.hpp"

namespace embody::qualisys {

/// What the hand needs of QTM.
struct Wanted {
  std::vector<std::string> markers;   ///< by slot: 1 to kMaxMarkers distinct names
  std::vector<std::string> optional;  ///< of them those that QTM may lack: their slots are then never visible
  std::string rigid_body;             ///< empty: none
};

/// Where the hand's markers and body are in QTM's data.
struct DataMap {
  static constexpr std::size_t kNone = SIZE_MAX;

  std::size_t labels{0};  ///< in each frame
  std::array<std::size_t, kMaxMarkers> label_of_slot{};
  /// Disabled bodies stay in QTM's list. Whether they keep their place in the data is not documented and was not tried
  /// on hardware, so both counts are understood.
  std::size_t bodies{0};
  std::size_t body{kNone};
  std::size_t enabled_bodies{0};
  std::size_t body_among_enabled{kNone};
};

/// kInvalidArgument unless the markers' names fit into a MarkerFrame and are distinct.
[[nodiscard]] Status check_names(const std::vector<std::string>& markers);

/// Errors: kRefused (not calibrated, wrong axis, body disabled or not in the world's frame), kNotFound (markers, body),
/// kMalformed (no capture rate).
[[nodiscard]] Status check_setup(const Parameters& parameters, const Wanted& wanted);

/// What may keep QTM from sending labelled markers or bodies, as a sentence; empty when nothing does.
[[nodiscard]] std::string processing_warning(const Parameters& parameters, const Wanted& wanted);

/// What differs between two valid parameter sets, as one sentence; success when nothing that matters does.
[[nodiscard]] Status check_unchanged(const Parameters& before, const Parameters& now);

/// @pre check_setup() succeeded.
[[nodiscard]] DataMap make_map(const Parameters& parameters, const Wanted& wanted);

}  // namespace embody::qualisys
