#include "multibody/bodies/middle.hpp"

#include <algorithm>

namespace amontons {

// One body with other velocities than those that the step left begins a new motion. The kick is then a half
// for all: two kicks of different lengths in one problem would give contacts between their bodies no common
// time.
void begin_with_velocities(const Model& model, const Subset& visited, State& state) {
  const auto is_left = [&](std::size_t i) {
    const MiddleVelocity& middle = state.middle_velocities[i];
    return !model.is_dynamic(static_cast<Index>(i)) || (state.linear_velocities[i] == middle.left_linear &&
                                                        state.angular_velocities[i] == middle.left_angular);
  };
  const std::size_t bodies = state.middle_velocities.size();
  bool goes_on = state.last_step > 0;
  visited.each(bodies, [&](std::size_t i) { goes_on = goes_on && is_left(i); });
  if (!goes_on) state.last_step = 0;
  visited.each(bodies, [&](std::size_t i) {
    if (goes_on && model.is_dynamic(static_cast<Index>(i))) return;
    state.middle_velocities[i].linear = state.linear_velocities[i];
    state.middle_velocities[i].angular = state.angular_velocities[i];
  });
}

void begin_with_shown(State& state) {
  for (std::size_t i = 0; i < state.middle_velocities.size(); ++i) {
    const Vec3 &linear = state.linear_velocities[i], &angular = state.angular_velocities[i];
    state.middle_velocities[i] = {linear, angular, linear, angular};
  }
}

void show_middle(const Model& model, State& state) {
  begin_with_velocities(model, {}, state);
  for (std::size_t i = 0; i < state.middle_velocities.size(); ++i) {
    state.linear_velocities[i] = state.middle_velocities[i].linear;
    state.angular_velocities[i] = state.middle_velocities[i].angular;
  }
  begin_with_shown(state);
}

// The state has velocities of the origins of frames. They follow from those of the centres with the turned
// arm (bodies/motion.cpp), so that this gives back what the step had, up to rounding.
void begin_in_the_middle(const Model& model, const State& state, const Subset& visited,
                         BodyVelocities& velocities) {
  velocities.resize(model.bodies());
  visited.each(model.bodies(), [&](std::size_t i) {
    const Body& body = model.description().bodies[i];
    velocities[i] = {};
    if (body.motion == Motion::still) return;
    const MiddleVelocity& middle = state.middle_velocities[i];
    const Vec3 arm = rotate(state.orientations[i], body.centre_of_mass);
    velocities[i] = {middle.linear + cross(middle.angular, arm), middle.angular};
  });
}

// A load f' over the last half step and f over the next one give the impulse h' f' / 2 + h f / 2, which is
// the kick times f + share (f' - f) with share = h' / (h' + h). Equal loads keep their bits.
void take_held_loads(const State& state, double share, const Subset& visited, HeldLoads& held) {
  const auto mean = [&](const auto& present, const auto& last, const Subset& of, auto& result) {
    result.resize(present.size());
    of.each(present.size(), [&](std::size_t i) {
      result[i] = present[i];
      if (i < last.size()) result[i] += share * (last[i] - present[i]);
    });
  };
  mean(state.forces, state.held_forces, visited, held.forces);
  mean(state.torques, state.held_torques, visited, held.torques);
  mean(state.controls, state.held_controls, {}, held.controls);
  mean(state.joint_forces, state.held_joint_forces, {}, held.joint_forces);
}

void keep_held_loads(const Subset& visited, State& state) {
  state.held_forces.resize(state.forces.size());
  state.held_torques.resize(state.torques.size());
  visited.each(state.forces.size(), [&](std::size_t i) {
    state.held_forces[i] = state.forces[i];
    state.held_torques[i] = state.torques[i];
  });
  state.held_controls = state.controls;
  state.held_joint_forces = state.joint_forces;
}

}  // namespace amontons
