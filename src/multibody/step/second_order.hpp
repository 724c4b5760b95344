// Terms of rows beyond D v+ = 0 that make smooth motion of second order.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>

#include "amontons/multibody/joints/joints.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

// The largest speed (m/s) that loads explain along a row, over the two kicks beside an instant. `fall`: that
// of gravity in a step. `change`: that of all loads in this step. A faster approach strikes, and a faster
// change may be a jump.
inline double smooth_speed(double fall, double change = 0) { return 2 * std::max(fall, std::abs(change)); }

struct StepSetting;
struct Observed;

// Adds to c of the rigid locked rows. The slips in the state become those of the last step.
void reflect_joints(const StepSetting& step, const Observed& o, State& state, JointRows& rows);

// A step that moves bodies with the velocities v for h.
struct JointMotion {
  const Model& model;
  const BodyFrames& frames;
  const JointContexts& joints;
  const BodyVelocities& v;
  double h;
};
// Adds what closes joints at the end of the step to c of the rigid locked rows for which counts(i) holds.
// Returns the largest error there (m); angles count times Model::length.
double close_joints(const JointMotion& in, const State& state, const std::function<bool(std::size_t)>& counts,
                    JointRows& rows);

// The terms of b of contacts, for those that turn as bodies roll with the velocities of the reach. Terms
// below `least` (m/s) count as none. Replaces `turns` if one changes by more than that; returns whether it
// does.
bool find_turns(const Reach& reach, double least, const std::vector<Contact>& contacts, ContactFinder& finder,
                std::vector<Vec3>& turns);

}  // namespace amontons
