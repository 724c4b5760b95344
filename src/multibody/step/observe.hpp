// Stage 1 of a step: bodies, joints, free velocities and contacts, before any impulse.
#pragma once
#include <vector>

#include "amontons/multibody/joints/coordinates.hpp"
#include "multibody/bodies/middle.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/stiffening.hpp"
#include "multibody/step/clock.hpp"
#include "multibody/step/setting.hpp"
#include "multibody/trees/tree_step.hpp"

namespace amontons {

// Errors of the poses at the start of a step: of joints, of couplings and tendons (m), of contacts (m, >= 0).
struct PositionErrors {
  JointError joint;
  double line = 0, penetration = 0;
};

// Memory that the stages keep from step to step. No result depends on it.
struct StepMemory {
  TreeMemory trees;
  std::vector<Index> changed;  // bodies with other bits in the state than at the start of the last step
  // The number of the islands asleep of whose bodies the arrays of the stages hold the data; 0: of none.
  std::uint64_t holds = 0;
  // The bodies whose data a step beside these islands makes. It makes those of all bodies if the last step
  // was not beside the same islands. This is the only rule: a set of islands that changes, a copy of a
  // simulation, or an attempt that did not end, make a step that visits all.
  Visited visited(const Sleepers& asleep) const {
    return holds == asleep.number ? asleep.visited() : Visited{};
  }
  // The same at the start of a step. Until its end the arrays are a mixture of two steps.
  Visited begin(const Sleepers& asleep) {
    const Visited all = visited(asleep);
    holds = 0;
    return all;
  }
};

// Poses (frames) are those at the start of the step and stay. The velocities are separate arrays: at its
// start, free (with all loads, without impulses), and foreseen (free without efforts along joints).
struct Observed {
  BodyFrames frames;
  JointContexts joints;
  PositionErrors errors;
  BodyMobilities mobility;
  BodyVelocities start, free, foreseen;
  std::vector<BodyImpulse> loads, efforts;  // efforts along joints are among the loads
  std::vector<GyroscopicSpin> spins;
  std::vector<Contact> contacts;
  std::vector<Index> known;            // per contact: its number among those of the last step; -1: none
  std::vector<JointWrench> impacts;    // of the locked directions of each joint, at the start of the step
  std::vector<unsigned char> stopped;  // bodies that a thick fluid stops within the step
  HeldLoads held;                      // over the kick
  TreeStep trees;                      // bodies that move in coordinates of their joints
  TreeSetting tree_setting(const StepSetting& step) const {
    return {step.model, step.tree, frames, start, step.memory.trees, step.h, step.last};
  }
  StepBodies bodies() const { return {frames, mobility, start, free, trees.constrained}; }
};

// Frames, mobility and velocities of the poses of the state, for the report of the step that led there. The
// next step begins with these frames.
void place_for_report(const Model& model, const State& state, const Subset& visited, Observed& observed);

// Bodies, joints, free velocities, and the contacts that the foreseen velocities could close. Coordinates of
// the state follow its poses.
void observe(const StepSetting& step, StepClock& clock, State& state, Observed& observed);

// Stiffens light links under high tension; in force after the impacts.
void stiffen(const StepSetting& step, const State& state, const Observed& observed, Stiffened& stiffened);

// After impacts: the mobility is that with stiff links, and free velocities follow from the start velocities.
void end_impacts(const StepSetting& step, bool bounced, const State& state, const Stiffened& stiffened,
                 Observed& observed);

}  // namespace amontons
