#pragma once
#include "amontons/multibody/bodies/bodies.hpp"

namespace amontons {

// The largest violation of locked directions in the present pose: of a position (m), at the anchor of the
// joint's last hinge or the origin of frame_a, and of an angle (rad). Compliant joints are springs and do not
// count.
struct JointError {
  double distance = 0, angle = 0;
};
JointError joint_error(const Model& model, const std::vector<BodyFrame>& bodies, const State& state);

// Energy of all joint springs, J: 1/2 k (q - rest)^2, that of ball joints, and what compliant joints and
// couplings hold. Gains of motors are not springs.
double spring_energy(const Model& model, const std::vector<BodyFrame>& bodies, const State& state);

}  // namespace amontons
