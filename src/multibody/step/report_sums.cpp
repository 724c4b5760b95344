// Sums for the report, which do not affect the step.
#include "multibody/step/report_sums.hpp"

#include <algorithm>

#include "multibody/bodies/motion.hpp"

namespace amontons {

// Sums the work of all solves of a step, including impacts and repeated solves.
void add_cost(const Solution& solution, Report& report) {
  report.iterations += solution.iterations;
  report.products += solution.products;
  report.factorizations += solution.factorizations;
}

void add_status(const Solution& solution, Report& report) {
  // The first solve that missed its tolerance determines the status of the step.
  if (report.status == Status::converged) report.status = solution.status;
}

void add_result(const Problem& problem, const Solution& solution, StepPath path, double tolerance,
                Report& report) {
  const auto& A = std::get<ContactSystem>(problem.A);
  report.contacts = A.contacts.size();
  report.joint_rows = A.jacobian.size();
  report.residual = solution.residual;
  report.method = solution.method;
  report.path = std::max(report.path, path);
  add_status(solution, report);
  // A safe step changes the impulses of a solve that converged: the residual is that of the result.
  if (report.status == Status::converged && !(solution.residual <= tolerance))
    report.status = Status::made_safe;
}

// Errors at the start of the step, not at its end; the next step reports these. The velocities of this step
// are known too late to evaluate their poses without another search for contacts.
void add_errors(const JointError& error, double line_error, const std::vector<Contact>& contacts,
                Report& report) {
  for (const Contact& c : contacts) report.penetration = std::max(report.penetration, -c.gap);
  if (error.distance > report.joint_error || error.angle > report.joint_angle_error)
    report.worst_joint = error.joint;
  report.joint_error = std::max({report.joint_error, error.distance, line_error});
  report.joint_angle_error = std::max(report.joint_angle_error, error.angle);
}

void add_balance(const EnergyBalance& balance, Report& report) {
  report.energy_balance += balance.work;
  report.balanced = report.balanced && balance.work <= balance.allowed;  // false for NaN
}

// Kinetic energy at the end; energies of gravity and springs half a step earlier: see Report. Coordinates are
// restored to those at the start of the step, from which the next step continues.
void add_energies(const Model& model, State& state, const BodyFrames& frames,
                  const BodyVelocities& velocities, double h, Report& report) {
  report.kinetic_energy = kinetic_energy(model, frames, velocities);
  report.potential_energy = gravity_energy(model, frames, velocities, 0.5 * h);
  if (!has_springs(model)) return;
  static thread_local BodyFrames middle;
  static thread_local std::vector<double> coordinates;
  middle = frames;
  for (std::size_t i = 0; i < middle.size(); ++i) {
    middle[i].pose = moved(frames[i], velocities[i], -0.5 * h);
    middle[i].centre -= 0.5 * h * velocities[i].linear;
  }
  coordinates = state.coordinates;
  update_coordinates(model, middle, state);
  report.spring_energy = spring_energy(model, middle, state);
  state.coordinates = coordinates;
}

}  // namespace amontons
