#pragma once
#include <vector>

#include "multibody/joints/joint_context.hpp"

namespace amontons {

// Mobility with light links stiffened, in force after the impacts, and what their inertias gain.
struct Stiffened {
  BodyMobilities mobility;
  std::vector<Mat3> inertia;
  bool any = false;
};

// Adds the geometric stiffness of the joints' forces of the last step to the effective inertia, if the step
// is too long to resolve it. `square`: the step times the kick (s^2). `stiffened` has the mobility of the
// bodies and gets that of this inertia.
void stiffen_rotations(const Model& model, const State& state, double square, const BodyFrames& frames,
                       const JointContexts& joints, Stiffened& stiffened);

}  // namespace amontons
