// Stage 7 of a step: the fallback for any result of the solve.
#pragma once
#include "amontons/solvers/direct/elimination.hpp"
#include "multibody/step/observe.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// For a step that missed its time, work, tolerance or energy balance: impulses that can do no harm, in three
// stages:
//   1. bilateral impulses are solved for the contact impulses, so that joints hold exactly;
//   2. contact impulses are scaled by one factor until the step creates no energy;
//   3. bodies stop at fixed geometry, and spin by no more than half a radian within the step.
// The path names the last stage that changed anything. Balance, and residual of the problem, are those of the
// new impulses.
void make_safe(const StepSetting& step, StepClock& clock, Elimination& elimination, Observed& observed,
               StepProblem& posed, Solved& solved);

}  // namespace amontons
