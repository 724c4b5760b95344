#include "multibody/step/move_on.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "amontons/multibody/joints/actuators.hpp"
#include "multibody/bodies/bonds.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "multibody/step/ahead.hpp"
#include "multibody/step/sleep.hpp"
#include "multibody/trees/rates.hpp"
#include "multibody/trees/reactions.hpp"

namespace amontons {

namespace {

// Slip below this speed (m/s) is an error of the solve, or rounding. A contact that sticks at its limit would
// otherwise count as slipping, and lose its static friction.
double least_slip(const StepSetting& step, const Solved& solved) {
  const double bodies = std::sqrt(static_cast<double>(step.model.bodies()));
  const double fall = step.fall();
  const double residual = std::max(step.options.tolerance, solved.solution.residual);
  double fastest = 0;
  step.visited.bodies.each(solved.after.size(), [&](std::size_t i) {
    const BodyVelocity& v = solved.after[i];
    fastest = std::max(fastest, norm(v.linear) + step.model.length() * norm(v.angular));
  });
  // The residual r bounds the error of a velocity by r sqrt(n) g h for n bodies (rest.cpp).
  return residual * bodies * fall + std::sqrt(std::numeric_limits<double>::epsilon()) * fastest;
}

// Contacts of islands at rest keep the impulses of the state, unless those have changed (step/carry).
std::vector<Index>& find_same(const StepSetting& step, const StepProblem& posed, const Solved& solved,
                              const Observed& o, double last_kick) {
  static thread_local std::vector<Index> same;
  same.assign(o.contacts.size(), -1);
  if (!solved.islands.any_rests || step.kick() != last_kick) return same;
  const std::vector<Index>& home = posed.problem->graph.islands.of_block;
  for (std::size_t i = 0; i < o.known.size(); ++i)
    if (const Island& island = solved.islands.each[home[i]]; island.rests && !island.changed)
      same[i] = o.known[i];
  return same;
}

}  // namespace

void move_on(const StepSetting& step, const StepProblem& posed, Solved& solved, Observed& o, State& state) {
  const std::span<const double> x = solved.solution.x;
  store_impulses(*posed.problem, step.options.law, solved.solution, solved.after, o.contacts,
                 step.options.threads);
  const double least = least_slip(step, solved);
  keep_for_warm_start(
      {*posed.problem, x, o.contacts, find_same(step, posed, solved, o, state.impulse_step), least}, o.frames,
      step.options.threads, state.contacts);
  carry_asleep(step.asleep, state.contacts);
  store_joint_impulses(posed.rows, x.last(posed.rows.jacobian.size()), state);
  store_slips(posed.rows, *posed.problem, solved.solution, least, state);
  TreeStep& trees = o.trees;
  if (step.tree.moves()) {
    read_rates(step.tree, trees, o.frames, solved.after, trees.after);
    store_drive_impulses(o.tree_setting(step), trees, state);
    const std::span<double> w = impulses_on_bodies(*posed.problem, x);
    push_asleep(step.asleep, w);
    store_tree_reactions(o.tree_setting(step), o.joints, w, trees, state);
  }
  static thread_local std::vector<double> ahead;
  find_ahead(step, posed, state.impulse_step, o, solved, ahead);
  state.impulse_step = step.kick();
  state.last_step = step.h;
  keep_held_loads(step.visited.bodies, state);
  integrate(step.model, o.frames, o.spins,
            {o.start, solved.after, step.h, ahead, step.options.threads, step.visited.bodies}, state,
            step.tree.number());
  if (step.tree.moves()) {
    move_trees(o.tree_setting(step), solved.after, trees.after, trees.after, trees, state);
    leave_tree_velocities(o.tree_setting(step), ahead, trees, state);
  }
  advance_activations(step.model, step.h, state);
  open_bonds(step.model, state);
}

}  // namespace amontons
