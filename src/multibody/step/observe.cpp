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
                        step.tree.number(), step.options.threads},
                       o.free, o.spins);
  if (step.tree.moves()) make_free_tree_velocities(o.tree_setting(step), o.loads, o.trees, o.free);
}

// The velocities with which contacts are foreseen: the free ones without efforts along joints. Such an effort
// would turn a light link alone into the floor; its joints, which are not solved yet, pass it on to the heavy
// ones.
static void foresee(Observed& o) {
  o.foreseen = o.free;
  for (std::size_t i = 0; i < o.foreseen.size(); ++i) {
    o.foreseen[i].linear -= o.mobility[i].inverse_mass * o.efforts[i].force;
    o.foreseen[i].angular -= o.mobility[i].inverse_inertia * o.efforts[i].torque;
  }
}

void place_for_report(const Model& model, const State& state, StepMemory& memory, Observed& o) {
  place_bodies(model, state, o.frames, o.mobility, o.start);
  memory.placed.positions = state.positions;
  memory.placed.orientations = state.orientations;
}

// A step changes the mobility, so that frames are known for its first look alone. Velocities in the middle
// replace those of all bodies that are not fixed.
static void place_at_start(const StepSetting& step, const State& state, Observed& o) {
  const Model& model = step.model;
  auto& placed = step.memory.placed;
  if (placed.positions != state.positions || placed.orientations != state.orientations)
    place_bodies(model, state, o.frames, o.mobility, o.start, step.options.threads);
  placed.positions.clear();
  begin_in_the_middle(model, state, o.start);
}

void observe(const StepSetting& step, StepClock& clock, State& state, Observed& o) {
  const Model& model = step.model;
  const double h = step.h, kick = step.kick();
  const Tree& tree = step.tree;
  const TreeSetting trees = o.tree_setting(step);
  place_trees(trees, state, o.trees);
  place_at_start(step, state, o);
  update_coordinates(model, o.frames, state, tree.without_rows());
  place_joints(model, o.frames, state, o.joints, tree.without_rows());
  place_tree_joints(trees, state, o.trees, o.joints);
  o.trees.stiffness.clear();
  make_tree_masses(trees, state, o.trees);
  o.errors = {joint_error(model, o.joints), line_error(model, o.frames, state), 0};
  // Motors of known effort are loads. Any other load that does not depend on the results of the step would be
  // added here.
  o.loads.assign(model.bodies(), BodyImpulse{});
  take_held_loads(state, step.last / (2 * kick), o.held);
  add_motor_loads(model, o.joints, o.held.controls, kick, o.loads);
  add_joint_forces(step.tree, o.frames, o.joints, o.held.joint_forces, kick, o.loads);
  add_actuator_loads({model, state, o.held.controls, h}, o.frames, o.joints, o.start, kick, o.loads);
  o.efforts = o.loads;
  for (std::size_t i = 0; i < o.loads.size(); ++i) {
    o.loads[i].force += kick * o.held.forces[i];
    o.loads[i].torque += kick * o.held.torques[i];
  }
  add_fluid_loads(model, o.bodies(), state, kick, o.loads, o.stopped);
  add_bond_loads(model, o.frames, state, kick, o.loads);
  make_free_velocities(step, o);
  foresee(o);
  clock.lap(&Timings::assembly);
  step.finder.find({model, o.frames, o.foreseen, h, step.margin, step.options.threads,
                    step.options.pairs.get(), &step.asleep},
                   o.contacts);
  find_known(model, state.contacts, o.frames, o.contacts, o.known);
  set_slipping_friction(model, state.contacts, o.known, o.contacts);
  for (const Contact& c : o.contacts) o.errors.penetration = std::max(o.errors.penetration, -c.gap);
  clock.search = clock.lap(&Timings::collision);
  clock.short_of_time = clock.budget.ends_within(step::policy.least_searches * clock.search);
}

void stiffen(const StepSetting& step, const State& state, const Observed& o, Stiffened& stiffened) {
  stiffened.mobility = o.mobility;
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
