// A step continues the last one: its velocities in the middle, and the loads held over it.
//
// Poses are those of instants n h. The velocities that move bodies from one to the next are those of the
// middles between them. So impulses act from middle to middle, over the kick (h' + h) / 2 with the last step
// h'. The first step has no middle before it: h' = 0, and it begins with the velocities of the state.
#pragma once
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"

namespace amontons {

// Lets a step begin with the velocities in the state if the last step did not leave them there, or there was
// none. That holds for all bodies, since the kick is one. Driven bodies always have the velocity that they
// are given.
void begin_with_velocities(const Model& model, const Subset& visited, State& state);

// The velocities in the state become those with which the next step begins.
void show_middle(const Model& model, State& state);
// The next step begins with the velocities in the state, and goes on from the last step if there was one.
void begin_with_shown(State& state);

// The velocities of centres of mass in the middle of the last step.
void begin_in_the_middle(const Model& model, const State& state, const Subset& visited,
                         BodyVelocities& velocities);

// Loads that are held over steps. A load that changes at the start of a step acts over the second part of
// its kick.
struct HeldLoads {
  std::vector<Vec3> forces, torques;
  std::vector<double> controls, joint_forces;
};
// Means over a kick: `share` of those of the last step, and the rest of the present ones.
void take_held_loads(const State& state, double share, const Subset& visited, HeldLoads& held);
// After a step: its loads are those of the last one.
void keep_held_loads(const Subset& visited, State& state);

}  // namespace amontons
