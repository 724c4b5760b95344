// Stage 2 of a step: position errors are removed by displacing bodies, not by giving them velocities.
#pragma once
#include "amontons/multibody/joints/rows.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "multibody/step/observe.hpp"
#include "multibody/step/step_sums.hpp"

namespace amontons {

// Largest error (m) that is not corrected; angles count times length.
double allowed_error(double length);

// Rows and problem of a correction: their memory is kept between steps. A large pile needs a correction in
// most steps, with a row per contact.
struct PositionMemory {
  JointRows joints, rows;
  Problem problem;
  Elimination elimination;
};

// If a position error exceeds the allowed one, displaces bodies and observes again. Overlaps and errors of
// rigid joints and limits are removed as far as possible, by at most step.displacing * h. Bodies under
// tension are moved along it, not folded: light links are stiffened before, and in any case for the rest of
// the step. Velocities of centres of mass stay, and so do angular momenta unless that would create energy.
// Returns whether anything moved.
bool correct(const StepSetting& step, StepClock& clock, PositionMemory& memory, State& state,
             Observed& observed, Stiffened& stiffened, StepSums& sums);

}  // namespace amontons
