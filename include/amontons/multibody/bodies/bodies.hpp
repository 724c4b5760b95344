#pragma once
#include <memory>
#include <vector>

#include "amontons/multibody/model/state.hpp"
#include "amontons/problem/contact_system.hpp"

// Bodies over one step. Their poses and inertias are constant while a step solves for velocities. Velocities
// are separate arrays of one type: at the start, free (loads and no impulses), and after the step.
namespace amontons {

// The pose of a body and its inertia there: the part of the pose that a step reads, made once at its start.
struct BodyFrame {
  Vec3 centre;     // centre of mass, world, m
  Transform pose;  // body frame in the world
  Mat3 inertia;    // about the centre of mass, world axes; zero unless dynamic
};

// A body's block of M^-1: the change of its velocity per impulse. Zero unless dynamic.
struct BodyMobility {
  double inverse_mass = 0;
  Mat3 inverse_inertia;    // about the centre of mass, world axes
  bool stiffened = false;  // not the inverse of BodyFrame::inertia: see stiffen_rotations()
};

// Velocity of the centre of mass; the state has that of the frame's origin instead.
struct BodyVelocity {
  Vec3 linear, angular;  // of the centre of mass, world, m/s, rad/s
};

// Impulse on a body over a step: of force and torque about the centre of mass, world axes, N s and N m s.
struct BodyImpulse {
  Vec3 force, torque;
};

// Arrays of one entry per body of the model.
using BodyFrames = std::vector<BodyFrame>;
using BodyMobilities = std::vector<BodyMobility>;
using BodyVelocities = std::vector<BodyVelocity>;

// The data of bodies that the rows of a step read.
struct StepBodies {
  const BodyFrames& frames;
  const BodyMobilities& mobility;
  const BodyVelocities& start;  // at the start of the step
  const BodyVelocities& free;   // with all loads, without impulses
  // Bodies that move in coordinates of their joints; null if there are none.
  std::shared_ptr<const ConstrainedBodies> trees = {};
};

// Frames, mobilities and velocities of the state. Fixed bodies have zero velocity, whatever the state
// contains.
void place_bodies(const Model& model, const State& state, BodyFrames& frames, BodyMobilities& mobility,
                  BodyVelocities& velocities);
// Frames and mobilities alone, of the bodies visited.
void place_frames(const Model& model, const State& state, BodyFrames& frames, BodyMobilities& mobility,
                  const Subset& visited, unsigned threads);
// Velocities alone. The frames are those of the state.
void place_velocities(const Model& model, const State& state, const Subset& visited,
                      BodyVelocities& velocities);

// Linear and angular momentum about the world's origin (N s, N m s), kinetic energy (J), of dynamic bodies.
struct Momentum {
  Vec3 linear, angular;
};
Momentum momentum(const Model& model, const State& state);
// J, 1/2 m v^2 + 1/2 omega' I omega of the state's velocities, or of given ones.
double kinetic_energy(const Model& model, const State& state);
double kinetic_energy(const Model& model, const BodyFrames& frames, const BodyVelocities& velocities,
                      const Subset& visited = {});
// J, -m g . x of the centres of mass.
double gravity_energy(const Model& model, const BodyFrames& frames);

}  // namespace amontons
