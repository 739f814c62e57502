#pragma once
// What a person can do to make a calibration better.
#include "core/hand/calibration_problem.hpp"

namespace embody::hand {

/// Fills `motion_rad` and `advice` of `calibration`.
void advise(const CalibrationProblem& problem, const CalibrationVariables& at, const GloveLayout& glove,
            const CalibrationPrior& prior, Calibration& calibration);

}  // namespace embody::hand
