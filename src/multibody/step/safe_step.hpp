// The one fallback of a step: impulses that cannot do harm, whatever the solve has left.
#pragma once
#include "amontons/multibody/step/report.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/step/energy.hpp"
#include "multibody/step/lookahead.hpp"
#include "multibody/step/report_sums.hpp"

namespace amontons {

// The step that missed its time, work, tolerance or balance of energy. What is not const is changed.
struct SafeStepInput {
  const Model& model;
  const StepBodies& bodies;
  const std::vector<GyroscopicSpin>& spins;
  const Assembly& assembly;
  const StepClock& clock;
  Law law;
  double tolerance;
  double dt, recovery, margin;  // s of the whole step; m/s by which velocities take back errors; m
  double search;                // s that a search for contacts takes
  ContactFinder& finder;
  Elimination& elimination;
  std::vector<Contact>& contacts;
  StepProblem& vi;
  BodyVelocities& after;
  EnergyScratch& energy;
};

// Makes impulses and velocities safe in three stages:
//   1. bilateral impulses are those that belong to the contact impulses, so that joints hold exactly;
//   2. contact impulses are scaled down, all alike, to where the step makes no energy from nothing;
//   3. bodies stop at what is fixed, and spin by no more than half a radian within the step.
// Returns the path: the last stage that changed anything. `balance` is that of the result, the residual that
// of the problem at the impulses that come back.
StepPath make_safe(const SafeStepInput& in, EnergyBalance& balance);

}  // namespace amontons
