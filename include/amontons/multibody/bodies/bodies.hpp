#pragma once
#include <vector>

#include "amontons/multibody/model/state.hpp"

// Bodies over one step. Where they stand and how heavy they are is constant while a step looks for its
// velocities; the velocities stand apart: those at the start, the free ones (loads and no impulses) and those
// after the step are arrays of one type.
namespace amontons {

// Where a body stands, and its inertia there: what a step reads of poses, made once at its start.
struct BodyFrame {
  Vec3 centre;     // centre of mass, world, m
  Transform pose;  // body frame in the world
  Mat3 inertia;    // about the centre of mass, world axes; zero unless dynamic
};

// A body's block of M^-1: what an impulse does to its velocity. Zero unless dynamic.
struct BodyMobility {
  double inverse_mass = 0;
  Mat3 inverse_inertia;    // about the centre of mass, world axes
  bool stiffened = false;  // not the inverse of BodyFrame::inertia: see stiffen_rotations()
};

// The velocity of the centre of mass is not that of the state, which is of the frame's origin.
struct BodyVelocity {
  Vec3 linear, angular;  // of the centre of mass, world, m/s, rad/s
};

// What acts on a body over a step: force and torque about the centre of mass, world axes, N s and N m s.
struct BodyImpulse {
  Vec3 force, torque;
};

// Arrays of one entry per body of the model.
using BodyFrames = std::vector<BodyFrame>;
using BodyMobilities = std::vector<BodyMobility>;
using BodyVelocities = std::vector<BodyVelocity>;

// What the rows of a step read of the bodies.
struct StepBodies {
  const BodyFrames& frames;
  const BodyMobilities& mobility;
  const BodyVelocities& start;  // of the step
  const BodyVelocities& free;   // with all loads, without impulses
};

// Frames, mobilities and velocities of the state. Bodies that are fixed have no velocity, whatever the state
// says.
void place_bodies(const Model& model, const State& state, BodyFrames& frames, BodyMobilities& mobility,
                  BodyVelocities& velocities);

// Linear and angular momentum about the world's origin (N s, N m s), kinetic energy (J), of dynamic bodies.
struct Momentum {
  Vec3 linear, angular;
};
Momentum momentum(const Model& model, const State& state);
// J, 1/2 m v^2 + 1/2 omega' I omega of the state's velocities, or of given ones.
double kinetic_energy(const Model& model, const State& state);
double kinetic_energy(const Model& model, const BodyFrames& frames, const BodyVelocities& velocities);
// -m g . x of the centres of mass, `before` seconds ago along their present velocities.
double gravity_energy(const Model& model, const BodyFrames& frames, const BodyVelocities& velocities,
                      double before);

}  // namespace amontons
