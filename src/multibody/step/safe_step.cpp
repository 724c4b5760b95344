#include "multibody/step/safe_step.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/solvers/driver/driver.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/step/fixed_contacts.hpp"
#include "multibody/step/pose.hpp"

namespace amontons {

namespace {

// Velocities of impulses that were changed.
void follow(const Observed& o, const StepProblem& posed, Solved& solved) {
  solved.after = o.free;
  apply_impulses(*posed.problem, solved.solution.x, solved.after);
}

// Scales the contact impulses by s, and finds the bilateral impulses and velocities that follow. If the
// mechanism has no factorisation, bilateral impulses are scaled too.
void scale_to(const std::vector<double>& x, double s, const Observed& o, const StepProblem& posed,
              Elimination& elimination, Solved& solved) {
  Solution& solution = solved.solution;
  for (std::size_t i = 0; i < x.size(); ++i) solution.x[i] = s * x[i];
  project(posed.problem->K, solution.x, solution.x);  // intervals may exclude zero
  elimination.restore_joints(*posed.problem, solution.x);
  follow(o, posed, solved);
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
void scale_impulses(const StepSetting& step, const Observed& o, const StepProblem& posed,
                    Elimination& elimination, Solved& solved) {
  const std::vector<double> x = solved.solution.x;
  const EnergyInput energy{step, o, posed, solved};
  EnergyBalance& balance = solved.balance;
  const auto balance_at = [&](double s) {
    scale_to(x, s, o, posed, elimination, solved);
    return energy_balance(energy);
  };
  balance = balance_at(1);
  if (balance.holds()) return;
  const auto work_at = [&](double s) {
    scale_to(x, s, o, posed, elimination, solved);
    return work_along_mean(energy);
  };
  solved.path = StepPath::impulses_scaled;
  const double share = largest_passive_share(work_at(0), work_at(0.5), work_at(1));
  balance = balance_at(share);
  if (!balance.holds() && share > 0) balance = balance_at(0);
  if (balance.holds()) return;
  // Joints that turn by radians within the step create energy even without contacts: bodies then move freely.
  std::fill(solved.solution.x.begin(), solved.solution.x.end(), 0.0);
  project(posed.problem->K, solved.solution.x, solved.solution.x);
  follow(o, posed, solved);
  balance = energy_balance(energy);
}

// Stage 3. Later steps correct errors between bodies, but a body that has left through its floor does not
// come back.
void stop_bodies(const StepSetting& step, const StepClock& clock, Observed& o, StepProblem& posed,
                 Solved& solved) {
  const double h = step.h, error = allowed_error(step.model.length());
  slow_spins(step.model, o.start, h, solved.after);
  const std::size_t known = o.contacts.size();
  if (!clock.budget.ends_within(clock.timings.collision))
    step.finder.find_fixed(step.reach(o.frames, solved.after), o.contacts);
  if (o.contacts.size() > known) {
    take_in(solved, known, o, posed);
    write_b(o, posed);
    solved.solution.x = posed.x0;
  }
  const std::vector<Index>& row = posed.problem->graph.first_row;
  std::vector<double> least;
  for (const Contact& c : o.contacts) least.push_back(-(std::max(c.gap, 0.0) + error) / h);
  const auto impulses = stop_at_fixed({step.model, o.mobility, o.contacts, least, h, &o.start}, solved.after);
  for (std::size_t i = 0; i < impulses.size(); ++i) solved.solution.x[row[i]] += impulses[i];
  if (!impulses.empty()) solved.path = StepPath::bodies_stopped;
}

}  // namespace

void make_safe(const StepSetting& step, StepClock& clock, Elimination& elimination, Observed& o,
               StepProblem& posed, Solved& solved) {
  Solution& solution = solved.solution;
  solved.path = solution.status == Status::converged  ? StepPath::accurate
                : solution.status == Status::deadline ? StepPath::budget_spent
                                                      : StepPath::joints_restored;
  scale_impulses(step, o, posed, elimination, solved);
  stop_bodies(step, clock, o, posed, solved);
  const bool missed = solution.residual > step.options.tolerance;
  measure(*posed.problem, step.options.law, solution);
  // The result of the solve may be a solution once the joints are exact.
  if (missed && solution.residual <= step.options.tolerance) solution.status = Status::converged;
}

}  // namespace amontons
