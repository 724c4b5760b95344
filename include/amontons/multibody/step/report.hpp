#pragma once
#include <cstddef>
#include <string>

#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// Wall clock of the phases of a step, s. Assembly has frames, joint rows and impacts in it; what total has
// more are checks and reports.
struct Timings {
  double collision = 0, assembly = 0, solve = 0, integration = 0, total = 0;
};

// Which way a step took: the last of these that changed its impulses or velocities.
enum class StepPath : unsigned char {
  // The impulses are those that the solve found.
  accurate,
  // The solve missed its tolerance; the joints were solved exactly for the contact impulses that it left.
  joints_restored,
  // The same, as the budget of the step ended the solve.
  budget_spent,
  // The step would have made energy from nothing; its contact impulses were scaled down until it does not.
  impulses_scaled,
  // Bodies that would have passed fixed geometry were stopped there.
  bodies_stopped,
};

// What one call of Simulation::step() did. With substeps, counts are sums, errors the largest, residual and
// status those of the worst solve, contacts and rows those of the last one.
struct Report {
  double time = 0;       // s, at the end of the step
  bool advanced = true;  // false: velocities came out not finite, and the state is that before the step
  // Status of the first solve that missed its tolerance, or else of the last solve.
  Status status = Status::converged;
  // Of Simulation::problem() at Simulation::impulses(), under the law of the simulation.
  double residual = 0;
  StepPath path = StepPath::accurate;  // with substeps, the last of the enumeration
  unsigned solves = 0;                 // calls of a solver: positions, impacts and the step itself
  std::size_t iterations = 0, products = 0, factorizations = 0;
  std::size_t contacts = 0, joint_rows = 0;
  unsigned substeps = 1;
  double penetration = 0;                         // m, the largest -gap at the start of the step, >= 0
  double joint_error = 0, joint_angle_error = 0;  // m, rad, at the start of the step; the first one
                                                  // of couplings and limits of tendons too
  int worst_joint = -1;                           // that of the largest error; -1: none has one
  bool joints_close = true;                       // that error is smaller than a step before
  // J. The energy of gravity and that of springs are those of half a step before the end: symplectic Euler
  // moves with the velocity at the end, so that T(v+) + V(q+) is off by h/2 v . grad V, while with V(q+ - h
  // v+ / 2) the sum is exact for projectiles and second order elsewhere.
  double kinetic_energy = 0, potential_energy = 0, spring_energy = 0;
  // J, the work of what can only dissipate: rigid contacts, joints, limits and dry friction. Positive is
  // energy from nothing; `balanced` is false where that is more than rounding and the tolerance explain, in a
  // step that its repair did not help.
  double energy_balance = 0;
  bool balanced = true;
  Timings timings;
  std::string method;

  // Whether the solves reached their tolerance and the step made no energy from nothing.
  bool is_sound() const { return advanced && status == Status::converged && balanced; }
};

}  // namespace amontons
