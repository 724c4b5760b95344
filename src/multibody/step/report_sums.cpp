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

// Coordinates are restored to those at the start of the step, from which the next step continues. Those of
// trees that the step has moved are exact already.
void add_energies(const Model& model, const Subset& visited, const std::vector<unsigned char>& without_rows,
                  State& state, const Observed& o, Report& report) {
  report.kinetic_energy = kinetic_energy(model, o.frames, o.start, visited);
  report.potential_energy = gravity_energy(model, o.frames);
  if (!has_springs(model)) return;
  static thread_local std::vector<double> coordinates;
  coordinates = state.coordinates;
  update_coordinates(model, o.frames, state, without_rows);
  report.spring_energy = spring_energy(model, o.frames, state);
  state.coordinates = coordinates;
}

}  // namespace amontons
