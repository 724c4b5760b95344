// Test whether a step created energy.
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
  const std::vector<Contact>& contacts;  // of the problem
  const Solution& solution;
  const JointRows& rows;
  double dt;        // s, of the whole step; the allowance refers to it
  double recovery;  // m/s, of the correction of position errors by velocities
  Subset visited = {};
};

// J: the work of all parts that can only dissipate, and its largest allowed value. The work is taken along
// the mean velocity of the step or, if that exceeds the allowance, along the actual motion.
struct EnergyBalance {
  double work, allowed;
  bool holds() const { return work <= allowed; }
};
EnergyBalance energy_balance(const EnergyInput& in);

// Work (J) along the mean velocity, a quadratic in the impulses.
double work_along_mean(const EnergyInput& in);

}  // namespace amontons
