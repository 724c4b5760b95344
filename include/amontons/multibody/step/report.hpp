#pragma once
#include <cstddef>
#include <string>

#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// Wall clock time of the phases of a step (s). Assembly includes frames, joint rows and impacts;
// integration includes the safe step and reports. The total includes earlier attempts at the step.
struct Timings {
  double collision = 0, assembly = 0, solve = 0, integration = 0, total = 0;
};

// How the impulses of a step came about: the last of these that changed its impulses or velocities.
enum class StepPath : unsigned char {
  // The impulses are those of the solve.
  accurate,
  // The solve missed its tolerance; the joints were solved exactly for its contact impulses.
  joints_restored,
  // As joints_restored, because the budget of the step ended the solve.
  budget_spent,
  // The step would have created energy; its contact impulses were scaled down until it does not.
  impulses_scaled,
  // Bodies that would have passed fixed geometry were stopped there.
  bodies_stopped,
};

// Results of one call of Simulation::step(). With substeps, counts are sums, errors the largest, residual and
// status those of the worst solve, contacts and rows those of the last substep.
struct Report {
  double time = 0;       // s, at the end of the step
  bool advanced = true;  // false: velocities were not finite, and the state is that before the step
  // Status of the first solve that missed its tolerance, otherwise of the last solve.
  Status status = Status::converged;
  // Natural residual of Simulation::problem() at Simulation::impulses(), under the law of the simulation.
  double residual = 0;
  StepPath path = StepPath::accurate;  // with substeps, the last of the enumeration
  unsigned solves = 0;                 // calls of a solver: positions, impacts and the step itself
  std::size_t iterations = 0, products = 0, factorizations = 0;
  std::size_t contacts = 0, joint_rows = 0;
  unsigned substeps = 1;
  double penetration = 0;                         // m, the largest -gap at the start of the step, >= 0
  double joint_error = 0, joint_angle_error = 0;  // m, rad, at the start of the step; the first includes
                                                  // the error of couplings and limits of tendons
  int worst_joint = -1;                           // joint with the largest error; -1: no joint has one
  bool joints_close = true;                       // the largest error is smaller than a step before
  // J, at the end of the step. The sum is exact for projectiles and of second order elsewhere.
  double kinetic_energy = 0, potential_energy = 0, spring_energy = 0;
  // Work of all parts that can only dissipate (J): rigid contacts, joints, limits and dry friction. A
  // positive value is created energy. `balanced` is false if it exceeds rounding and the tolerance, and the
  // safe step did not help.
  double energy_balance = 0;
  bool balanced = true;
  Timings timings;
  std::string method;

  // Whether the solves reached their tolerance and the step created no energy.
  bool is_sound() const { return advanced && status == Status::converged && balanced; }
};

}  // namespace amontons
