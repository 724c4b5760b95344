#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"

// Begin and end of a step: the velocities of bodies without impulses, and their motion with the velocities
// after the impulses.
namespace amontons {

// Turn of a body within a step (rad) above which means over the step say little about its ends.
inline constexpr double resolved_turn = 0.25;

// The gyroscopic part of a body's rotation.
struct GyroscopicSpin {
  Vec3 mean;  // the angular velocity whose exponential is the torque-free rotation over the step, world
  Vec3 lag;   // omega - mean: restores the true angular velocity after the step
};

// The mean angular velocity of a torque-free rotation over h: the body turns by exp(h mean). Body axes.
Vec3 torque_free_mean(const Mat3& inertia, const Vec3& omega, double h);

// The pose of a body after motion with velocity v for h, which may be negative.
Transform moved(const BodyFrame& body, const BodyVelocity& v, double h);

// Bodies at the start of a step of length h, and the impulses of loads over the kick. `damped`: the inertia
// that stiffening adds also acts as a damper. Bodies of trees (`in_tree`, per body; -1: none, or empty) have
// no gyroscopic part here.
struct FreeMotion {
  const Model& model;
  double h, kick;
  const BodyFrames& frames;
  const BodyMobilities& mobility;
  const BodyVelocities& start;
  const std::vector<BodyImpulse>& loads;
  bool damped = false;
  std::span<const Index> in_tree = {};
  unsigned threads = 1;  // 0: one per core
  Subset visited = {};
};
// v_free = v + kick g + M^-1 loads, and the mean of the torque-free rotation over h in place of omega.
void make_free_velocities(const FreeMotion& in, BodyVelocities& free, std::vector<GyroscopicSpin>& spins);

// The motion after the solve of a step. `start` are the velocities before it, `v` those after it, over h.
// `ahead`, per body: the share of v - start that the velocities in the state are ahead of v.
struct Drift {
  const BodyVelocities &start, &v;
  double h;
  std::span<const double> ahead;
  unsigned threads = 1;  // 0: one per core
  Subset visited = {};
};

// Moves the bodies of the state, except those of trees. Velocities in the state are those of its instant, and
// middle velocities those with which the bodies moved.
void integrate(const Model& model, const BodyFrames& frames, const std::vector<GyroscopicSpin>& spins,
               const Drift& drift, State& state, std::span<const Index> in_tree = {});

}  // namespace amontons
