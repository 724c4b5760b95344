// The fallback of a step: impulses that can do no harm, for any result of the solve.
#pragma once
#include "amontons/multibody/step/report.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/step/energy.hpp"
#include "multibody/step/lookahead.hpp"
#include "multibody/step/report_sums.hpp"

namespace amontons {

// A step that missed its time, work, tolerance or energy balance. Members that are not const are changed.
struct SafeStepInput {
  const Model& model;
  const StepBodies& bodies;
  const std::vector<GyroscopicSpin>& spins;
  const Assembly& assembly;
  const StepClock& clock;
  Law law;
  double tolerance;
  double dt, recovery, margin;  // s of the whole step; m/s of the correction of errors by velocities; m
  double search;                // s, time of a search for contacts
  ContactFinder& finder;
  Elimination& elimination;
  std::vector<Contact>& contacts;
  StepProblem& vi;
  BodyVelocities& after;
  EnergyScratch& energy;
};

// Makes impulses and velocities safe in three stages:
//   1. bilateral impulses are solved for the contact impulses, so that joints hold exactly;
//   2. contact impulses are scaled by one factor until the step creates no energy;
//   3. bodies stop at fixed geometry, and spin by no more than half a radian within the step.
// Returns the path: the last stage that changed anything. `balance` is that of the result. The residual is
// that of the problem at the returned impulses.
StepPath make_safe(const SafeStepInput& in, EnergyBalance& balance);

}  // namespace amontons
