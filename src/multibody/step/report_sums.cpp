#include "multibody/step/report_sums.hpp"

#include <algorithm>

#include "amontons/multibody/joints/coordinates.hpp"
#include "multibody/bodies/motion.hpp"

namespace amontons {

// Errors are those at the start of the step; the next step reports those at its end. The velocities of this
// step are known too late to evaluate their poses without another search for contacts.
void add_part(const PositionErrors& errors, const StepProblem& posed, const Solved& solved, double tolerance,
              StepSums& sums, Report& report) {
  const JointError& joint = errors.joint;
  report.penetration = std::max(report.penetration, errors.penetration);
  if (joint.distance > report.joint_error || joint.angle > report.joint_angle_error)
    report.worst_joint = joint.joint;
  report.joint_error = std::max({report.joint_error, joint.distance, errors.line});
  report.joint_angle_error = std::max(report.joint_angle_error, joint.angle);
  const auto& A = std::get<ContactSystem>(posed.problem->A);
  report.contacts = A.contacts.size();
  report.joint_rows = A.jacobian.size();
  report.residual = solved.solution.residual;
  report.method = solved.solution.method;
  report.path = std::max(report.path, solved.path);
  report.energy_balance += solved.balance.work;
  report.balanced = report.balanced && solved.balance.holds();
  // A safe step changes the impulses of a solve that converged: the residual is that of the result.
  sums.add_status(solved.solution.status);
  if (!(report.residual <= tolerance)) sums.add_status(Status::made_safe);
  report.status = sums.status;
  report.solves = sums.solves;
  report.iterations = sums.iterations;
  report.products = sums.products;
  report.factorizations = sums.factorizations;
}

// Coordinates of trees half a step back, from the rates of the step, which belong to its middle. To fit all
// coordinates to the poses there would take a tenth of the step of a robot.
static void half_a_step_back(const Forest& moved, const TreeStep& trees, double h, State& state) {
  for (const TreeBody& b : moved.bodies)
    for (std::size_t j = 0; b.joint >= 0 && j < b.dofs; ++j)
      state.coordinates[b.first_dof + j] -= 0.5 * h * trees.after[b.first + j];
}

// Kinetic energy at the end; energies of gravity and springs half a step earlier: see Report. Coordinates are
// restored to those at the start of the step, from which the next step continues.
void add_energies(const Model& model, const Forest& moved_trees, State& state, const Observed& o, double h,
                  Report& report) {
  report.kinetic_energy = kinetic_energy(model, o.frames, o.start);
  report.potential_energy = gravity_energy(model, o.frames, o.start, 0.5 * h);
  if (!has_springs(model)) return;
  static thread_local BodyFrames middle;
  static thread_local std::vector<double> coordinates;
  middle = o.frames;
  for (std::size_t i = 0; i < middle.size(); ++i) {
    middle[i].pose = moved(o.frames[i], o.start[i], -0.5 * h);
    middle[i].centre -= 0.5 * h * o.start[i].linear;
  }
  coordinates = state.coordinates;
  half_a_step_back(moved_trees, o.trees, h, state);
  update_coordinates(model, middle, state, moved_trees.has_joint);
  report.spring_energy = spring_energy(model, middle, state);
  state.coordinates = coordinates;
}

}  // namespace amontons
