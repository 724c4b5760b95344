// Whether a step made energy from nothing.
#pragma once
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"
#include "multibody/bodies/motion.hpp"

namespace amontons {

// One solve and the velocities before and after it.
struct EnergyInput {
  const Model& model;
  const BodyFrames& frames;
  const BodyVelocities &start, &free, &after;
  const std::vector<GyroscopicSpin>& spins;
  const Problem& problem;
  const Solution& solution;
  const JointRows& rows;
  double dt;        // s, of the whole step, for what is allowed
  double recovery;  // m/s, at which velocities may take back errors of position
  double closing;   // m/s, at which those of closed contacts are kept from growing
};

// J: the work of what can only dissipate, and how much of it may be positive. It is the work along the mean
// velocity of the step, or that along the actual motion where the first exceeds the allowance.
struct EnergyBalance {
  double work, allowed;
  bool holds() const { return work <= allowed; }
};
// Memory: mean velocities of the step, those of the bodies that impulses move (zeros for others), and the
// change of the velocities.
struct EnergyScratch {
  BodyVelocities all, moved, change;
};
EnergyBalance energy_balance(const EnergyInput& in, EnergyScratch& scratch);

// J along the mean velocity alone, a quadratic in the impulses.
double work_along_mean(const EnergyInput& in, EnergyScratch& scratch);

}  // namespace amontons
