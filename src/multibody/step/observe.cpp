#include "multibody/step/observe.hpp"

#include <algorithm>

#include "amontons/multibody/joints/actuators.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "multibody/bodies/bonds.hpp"
#include "multibody/bodies/fluid.hpp"
#include "multibody/bodies/middle.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "multibody/joints/stiffening.hpp"
#include "multibody/kinematics/joint_forces.hpp"
#include "multibody/trees/masses.hpp"
#include "multibody/trees/poses.hpp"
#include "multibody/trees/rates.hpp"

namespace amontons {

static void make_free_velocities(const StepSetting& step, Observed& o) {
  make_free_velocities({step.model, step.h, step.kick(), o.frames, o.mobility, o.start, o.loads, step.damped,
                        step.tree.number(), step.options.threads, step.visited.bodies},
                       o.free, o.spins);
  if (step.tree.moves()) make_free_tree_velocities(o.tree_setting(step), o.loads, o.trees, o.free);
}

// The velocities with which contacts are foreseen: the free ones without efforts along joints. Such an effort
// would turn a light link alone into the floor; its joints, which are not solved yet, pass it on to the heavy
// ones.
static void foresee(const StepSetting& step, Observed& o) {
  o.foreseen.resize(o.free.size());
  step.visited.bodies.each(o.free.size(), [&](std::size_t i) {
    o.foreseen[i] = o.free[i];
    o.foreseen[i].linear -= o.mobility[i].inverse_mass * o.efforts[i].force;
    o.foreseen[i].angular -= o.mobility[i].inverse_inertia * o.efforts[i].torque;
  });
}

void place_for_report(const Model& model, const State& state, const Subset& visited, Observed& o) {
  place_frames(model, state, o.frames, o.mobility, visited, 1);
  place_velocities(model, state, visited, o.start);
}

// Adds the impulses of the loads on bodies to those along joints, which are the efforts.
static void add_body_loads(const StepSetting& step, Observed& o) {
  const double kick = step.kick();
  o.efforts.resize(o.loads.size());
  step.visited.bodies.each(o.loads.size(), [&](std::size_t i) {
    o.efforts[i] = o.loads[i];
    o.loads[i].force += kick * o.held.forces[i];
    o.loads[i].torque += kick * o.held.torques[i];
  });
}

void observe(const StepSetting& step, StepClock& clock, State& state, Observed& o) {
  const Model& model = step.model;
  const double h = step.h, kick = step.kick();
  const Tree& tree = step.tree;
  const TreeSetting trees = o.tree_setting(step);
  place_trees(trees, state, o.trees);
  const Subset& visited = step.visited.bodies;
  place_frames(model, state, o.frames, o.mobility, visited, step.options.threads);
  begin_in_the_middle(model, state, visited, o.start);
  update_coordinates(model, o.frames, state, tree.without_rows());
  place_joints(model, o.frames, state, o.joints, tree.without_rows());
  place_tree_joints(trees, state, o.trees, o.joints);
  o.trees.stiffness.clear();
  make_tree_masses(trees, state, o.trees);
  o.errors = {joint_error(model, o.joints), line_error(model, o.frames, state), 0};
  // Motors of known effort are loads. Any other load that does not depend on the results of the step would be
  // added here.
  o.loads.resize(model.bodies());
  visited.each(model.bodies(), [&](std::size_t i) { o.loads[i] = {}; });
  take_held_loads(state, step.last / (2 * kick), visited, o.held);
  add_motor_loads(model, o.joints, o.held.controls, kick, o.loads);
  add_joint_forces(step.tree, o.frames, o.joints, o.held.joint_forces, kick, o.loads);
  add_actuator_loads({model, state, o.held.controls, h}, o.frames, o.joints, o.start, kick, o.loads);
  add_body_loads(step, o);
  add_fluid_loads(model, o.bodies(), state, kick, o.loads, o.stopped);
  add_bond_loads(model, o.frames, state, kick, o.loads);
  make_free_velocities(step, o);
  foresee(step, o);
  clock.lap(&Timings::assembly);
  step.finder.find(step.reach(o.frames, o.foreseen), o.contacts);
  find_known(model, state.contacts, o.frames, o.contacts, o.known);
  set_slipping_friction(model, state.contacts, o.known, o.contacts);
  for (const Contact& c : o.contacts) o.errors.penetration = std::max(o.errors.penetration, -c.gap);
  clock.search = clock.lap(&Timings::collision);
  clock.short_of_time = clock.budget.ends_within(clock.searches());
}

void stiffen(const StepSetting& step, const State& state, const Observed& o, Stiffened& stiffened) {
  stiffened.mobility.resize(o.mobility.size());
  step.visited.bodies.each(o.mobility.size(), [&](std::size_t i) { stiffened.mobility[i] = o.mobility[i]; });
  stiffen_rotations(step.model, state, step.h * step.kick(), o.frames, o.joints, stiffened);
}

void end_impacts(const StepSetting& step, bool bounced, const State& state, const Stiffened& stiffened,
                 Observed& o) {
  if (stiffened.any) {
    o.mobility = stiffened.mobility;
    o.trees.stiffness = stiffened.inertia;
    make_tree_masses(o.tree_setting(step), state, o.trees);
  }
  if (bounced || stiffened.any) make_free_velocities(step, o);
}

}  // namespace amontons
