#include "multibody/step/safe_step.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/ablation.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/fixed_contacts.hpp"

namespace amontons {

namespace {

EnergyInput energy_input(const SafeStepInput& in) {
  return {in.model,    in.bodies.frames,   in.bodies.start, in.bodies.free, in.after,
          in.spins,    *in.vi.problem,     in.vi.solution,  in.vi.rows,     in.dt,
          in.recovery, in.assembly.closing};
}

// Scales the contact impulses by s, and finds the bilateral impulses and velocities that follow. If the
// mechanism has no factorisation, bilateral impulses are scaled too.
void scale_to(const SafeStepInput& in, const std::vector<double>& x, double s) {
  Solution& solution = in.vi.solution;
  for (std::size_t i = 0; i < x.size(); ++i) solution.x[i] = s * x[i];
  project(in.vi.problem->K, solution.x, solution.x);  // intervals may exclude zero
  in.elimination.restore_joints(*in.vi.problem, solution.x);
  in.after = in.bodies.free;
  apply_impulses(*in.vi.problem, solution.x, in.after);
}

// The largest s in [0, 1] at which the work J(s) = none + b s + c s^2 is not positive, from J at 0, 1/2 and
// 1, where J(1) > 0. It is 0 if there is none. J is not positive up to its smaller root for c < 0, and
// between its roots for c > 0. Both ends are the same root of the formula.
double largest_passive_share(double none, double half, double whole) {
  const double c = 2 * (whole - 2 * half + none), b = whole - none - c;
  const double share = c != 0 ? (-b + std::sqrt(b * b - 4 * none * c)) / (2 * c) : -none / b;
  return share > 0 && share <= 1 ? share : 0;  // false for NaN: there is no root
}

// Stages 1 and 2. With exact joints the work is a quadratic in the scale of the other impulses. Joints and
// springs act at every scale: a stretched spring without impulse would gain energy without a source.
EnergyBalance scale_impulses(const SafeStepInput& in, StepPath& path) {
  const std::vector<double> x = in.vi.solution.x;
  const EnergyInput energy = energy_input(in);
  const auto balance_at = [&](double s) {
    scale_to(in, x, s);
    return energy_balance(energy, in.energy);
  };
  EnergyBalance balance = balance_at(1);
  if (balance.holds() || off("scale impulses")) return balance;
  const auto work_at = [&](double s) {
    scale_to(in, x, s);
    return work_along_mean(energy, in.energy);
  };
  path = StepPath::impulses_scaled;
  const double share = largest_passive_share(work_at(0), work_at(0.5), work_at(1));
  balance = balance_at(share);
  if (!balance.holds() && share > 0) balance = balance_at(0);
  if (balance.holds()) return balance;
  // Joints that turn by radians within the step create energy even without contacts: bodies then move freely.
  std::fill(in.vi.solution.x.begin(), in.vi.solution.x.end(), 0.0);
  project(in.vi.problem->K, in.vi.solution.x, in.vi.solution.x);
  in.after = in.bodies.free;
  apply_impulses(*in.vi.problem, in.vi.solution.x, in.after);
  return energy_balance(energy, in.energy);
}

// Stage 3. Later steps correct errors between bodies, but a body that has left through its floor does not
// come back.
bool stop_bodies(const SafeStepInput& in) {
  if (off("stop bodies")) return false;
  const double h = in.assembly.h, error = in.assembly.most_closed;
  slow_spins(in.model, in.bodies.start, h, in.after);
  const std::size_t known = in.contacts.size();
  if (!in.clock.over(in.search))
    in.finder.find_fixed({in.model, in.bodies.frames, in.after, h, in.margin}, in.contacts);
  if (in.contacts.size() > known) {
    take_in(in.bodies, in.assembly, in.contacts, known, in.vi);
    in.vi.solution.x = in.vi.x0;
  }
  const std::vector<Index>& row = in.vi.problem->graph.first_row;
  std::vector<double> least;
  for (const Contact& c : in.contacts) least.push_back(-(std::max(c.gap, 0.0) + error) / h);
  const auto impulses =
      stop_at_fixed({in.model, in.bodies.mobility, in.contacts, least, error, h, &in.bodies.start}, in.after);
  for (std::size_t i = 0; i < impulses.size(); ++i) in.vi.solution.x[row[i]] += impulses[i];
  return !impulses.empty();
}

}  // namespace

StepPath make_safe(const SafeStepInput& in, EnergyBalance& balance) {
  const Status status = in.vi.solution.status;
  StepPath path = status == Status::converged  ? StepPath::accurate
                  : status == Status::deadline ? StepPath::budget_spent
                                               : StepPath::joints_restored;
  balance = scale_impulses(in, path);
  if (stop_bodies(in)) path = StepPath::bodies_stopped;
  const bool missed = in.vi.solution.residual > in.tolerance;
  measure(*in.vi.problem, in.law, in.vi.solution);
  // The result of the solve may be a solution once the joints are exact.
  if (missed && in.vi.solution.residual <= in.tolerance) in.vi.solution.status = Status::converged;
  return path;
}

}  // namespace amontons
