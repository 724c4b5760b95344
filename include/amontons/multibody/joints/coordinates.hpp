#pragma once
#include <span>

#include "amontons/multibody/bodies/bodies.hpp"

namespace amontons {

struct JointContext;  // a joint in the world, src/multibody/joints/joint_context.hpp

// Updates state.coordinates, or separate coordinates, from the poses. The result is the one next to the
// present coordinates (so that turns are counted). A joint whose coordinates are all zero is searched from
// several starts. The turn of a single hinge is chosen within the limits if possible.
// Joints that `known` marks (per joint, or empty) are left as they are.
void update_coordinates(const Model& model, const BodyFrames& bodies, State& state,
                        std::span<const unsigned char> known = {});
void update_coordinates(const Model& model, const BodyFrames& bodies, std::span<double> coordinates,
                        std::span<const unsigned char> known = {});

// Bodies at their initial poses and velocities, coordinates found from the poses, no loads.
State initial_state(const Model& model);

// Largest violation of locked directions in the present pose: of a position (m) and of an angle (rad).
// Positions are taken at the anchor of the joint's last hinge or the origin of frame_a. Compliant joints are
// springs and do not count.
struct JointError {
  double distance = 0, angle = 0;
  Index joint = -1;  // joint of the largest distance, or angle times Model::length()
};
JointError joint_error(const Model& model, const BodyFrames& bodies, const State& state);
JointError joint_error(const Model& model, std::span<const JointContext> joints);

// Largest violation of rigid couplings, of the limits of tendons and of the clearance of joints (m); angles
// count times Model::length().
double line_error(const Model& model, const BodyFrames& bodies, const State& state);

// Whether spring_energy() can be nonzero.
bool has_springs(const Model& model);
// Energy of all joint springs (J): 1/2 k (q - rest)^2, that of ball joints, and that of compliant joints and
// couplings. Gains of motors are not springs.
double spring_energy(const Model& model, const BodyFrames& bodies, const State& state);

}  // namespace amontons
