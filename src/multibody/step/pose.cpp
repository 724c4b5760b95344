#include "multibody/step/pose.hpp"

#include <algorithm>

#include "amontons/base/policy.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "multibody/joints/dof_rows.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/positions.hpp"
#include "multibody/step/second_order.hpp"
#include "multibody/step/sleep.hpp"
#include "multibody/trees/momenta.hpp"
#include "multibody/trees/rates.hpp"

namespace amontons {

Assembly assembly_of(const StepSetting& step, const std::vector<Contact>& contacts, std::size_t joint_rows) {
  const double error = allowed_error(step.model.length());
  const double fall = step.fall();
  const bool keeps_closed = step.recovery > 0 || !step.damped;
  const bool overlaps =
      step.asleep.overlap > error || std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
        return c.gap < -error && !(c.material.compliance > 0);
      });
  const std::size_t all_contacts = contacts.size() + step.asleep.contacts.size();
  const bool few = 3 * all_contacts + joint_rows + step.asleep.rows.size() <= step::policy.few_rows;
  const double drift = step::policy.steps_of_slack * step.options.tolerance * fall * step.h;
  // Overlaps close by three digits of the speed of a fall, which is invisible. Tests of heights, slopes and
  // internal edges need it.
  return {.h = step.h,
          .kick = step.kick(),
          .recovery_speed = step.recovery,
          .closing = keeps_closed && !overlaps ? base::policy.three_digits * fall : 0,
          .at_once = step.options.closing_at_once,
          .slack = few ? 0 : std::min(drift, error),
          .model = &step.model,
          .threads = step.options.threads};
}

double least_turn(const StepSetting& step) { return step::policy.least_turn * step.fall(); }

// Bodies of trees came along their joints. Bodies that moved back along their velocities would have others
// there: an inertia along a tendon would take the difference for an acceleration.
static void find_past_of_trees(const StepSetting& step, const State& state, Observed& o, JointRows& rows) {
  const auto has_inertia = [](const Tendon& t) { return t.armature > 0; };
  const auto& tendons = step.model.description().tendons;
  if (!step.tree.moves() || std::none_of(tendons.begin(), tendons.end(), has_inertia)) return;
  past_of({step.model, o.bodies(), o.joints, state, step.joint_options(o.held.controls)}, rows);
  change_past(o.tree_setting(step), o.trees, rows.past);
}

// The impulses of the last step, for rows that exist in this one. A resting scene needs equal forces, so
// impulses are scaled by the ratio of the kicks.
static void warm_start(const StepSetting& step, const State& state, const Observed& o, StepProblem& posed) {
  posed.x0.clear();
  posed.again = false;
  if (!step.options.warm_start || !(state.impulse_step > 0)) return;
  const double scale = step.kick() / state.impulse_step;
  warm_start_contacts(state.contacts, o.known, scale, o.contacts, posed.x0);
  for (double x : posed.rows.x0) posed.x0.push_back(scale * x);
}

// Contacts turn with the velocities that the impulses of the last step would give: for smooth motion a
// prediction of second order. Without such impulses, with the velocities at the start.
static void turn_ahead(const StepSetting& step, Observed& o, StepProblem& posed) {
  const BodyVelocities& v = posed.x0.empty() ? o.start : posed.predicted;
  find_turns(step.reach(o.frames, v), least_turn(step), o.contacts, step.finder, posed.turns);
}

void pose(const StepSetting& step, const StepClock& clock, State& state, Observed& o, StepProblem& posed) {
  const Model& model = step.model;
  posed.rows.clear();
  find_past_of_trees(step, state, o, posed.rows);
  JointOptions options = step.joint_options(o.held.controls);
  options.left_out = step.asleep.joints;
  append_joint_rows(model, o.bodies(), o.joints, state, options, posed.rows);
  know_asleep(step.asleep, posed.rows);
  if (!step.damped) reflect_joints(step, o, state, posed.rows);
  if (state.impulse_step > 0)
    hold_contacts(state.contacts, o.known, step.kick() / state.impulse_step, o.contacts);
  posed.assembly = assembly_of(step, o.contacts, posed.rows.tags.size());
  if (!posed.problem) posed.problem = std::make_shared<Problem>();
  posed.problem->law = step.options.law;
  assemble_system(o.bodies(), o.contacts, posed.rows, posed.assembly, *posed.problem);
  warm_start(step, state, o, posed);
  std::span<double> w;
  const bool touching = !o.contacts.empty() || step.asleep.any();
  if ((!posed.x0.empty() || !step.asleep.pushes.empty()) && (step.tree.moves() || touching)) {
    w = impulses_on_bodies(*posed.problem, posed.x0);
    push_asleep(step.asleep, w);
  }
  // The motion of trees over the step depends on its impulses: those of the last step foresee them, which
  // makes the motion of second order with contacts, too.
  if (step.tree.moves()) foresee_tree_velocities(o.tree_setting(step), w, o.trees, o.free);
  // Turns and the test of rest both need them. That test looks at all bodies awake while others sleep, even
  // if none of those awake touches anything: a control may move them. With trees M^-1 D'x0 is known along the
  // coordinates already.
  posed.predicted.clear();
  if (!w.empty() && touching) {
    const Subset& visited = step.visited.bodies;
    posed.predicted.resize(o.free.size());
    visited.each(o.free.size(), [&](std::size_t i) { posed.predicted[i] = o.free[i]; });
    add_moved(*posed.problem, w, !step.tree.moves() ? nullptr : o.trees.caused.data(), visited,
              posed.predicted);
    stop_asleep(step.asleep, visited, posed.predicted);
  }
  posed.turns.clear();
  if (!step.damped && !o.contacts.empty() && !clock.short_of_time) turn_ahead(step, o, posed);
  write_b(o, posed);
}

void write_b(const Observed& o, StepProblem& posed) {
  write_b(o.free, o.contacts, posed.rows, posed.assembly, posed.turns, *posed.problem);
}

void take_in(const Solved& solved, std::size_t known, Observed& o, StepProblem& posed) {
  std::size_t before = 0, added = 0;
  for (std::size_t i = 0; i < o.contacts.size(); ++i)
    (i < known ? before : added) += static_cast<std::size_t>(o.contacts[i].rows);
  posed.turns.clear();
  posed.begin_at(solved);
  posed.x0.insert(posed.x0.begin() + static_cast<std::ptrdiff_t>(before), added, 0.0);
  assemble_system(o.bodies(), o.contacts, posed.rows, posed.assembly, *posed.problem);
}

}  // namespace amontons
