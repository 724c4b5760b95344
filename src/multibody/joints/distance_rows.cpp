#include "multibody/joints/distance_rows.hpp"

#include <algorithm>

#include "multibody/joints/row_terms.hpp"

namespace amontons {

// C = |p| - L with p from the origin of frame_b to that of frame_a: D v = <p / |p|, v_A - v_B>. Both
// velocities are taken at the origin of frame_a; what the turn of B adds there lies across p.
void append_distance_rows(const JointContext& joint, const StepBodies& bodies, const State& state,
                          const JointOptions& options, JointRows& rows) {
  const Joint& rod = *joint.joint;
  const Vec3& between = joint.pose.relative.position;
  const double distance = norm(between);
  // Where the points coincide no direction is better than another; the next step knows one.
  const Vec3 direction = distance > 1e-12 * options.length ? between / distance : Vec3{0, 0, 1};
  const double last = dot(direction, state.joint_wrenches[joint.index].force);
  const JacobianRow row = joint_row(joint, {direction, {}});
  const bool soft = rod.compliance > 0, fixed = rod.lower_distance == rod.upper_distance;
  const double spring = rod.compliance / (options.h * options.h);
  RowTag tag{fixed ? RowKind::locked : RowKind::distance, joint.index, -1};
  if (fixed) {
    const double error = distance - rod.lower_distance;
    const double E = soft ? spring : regularisation(row, bodies);
    rows.cones.append(Free{});
    tag.force = direction;
    rows.append(row, E, soft ? error / options.h : recovery(error, options), last, tag);
    return;
  }
  for (const double sign : {1.0, -1.0}) {
    const double gap = sign > 0 ? distance - rod.lower_distance : rod.upper_distance - distance;
    const bool no_constraint = sign > 0 && rod.lower_distance == 0;
    if (no_constraint || !(gap < infinity) || !within_reach(row, bodies, gap, 0, options)) continue;
    rows.cones.append(NonNegative{});
    tag.force = sign * direction;
    // Of a spring nothing may be cut off: then it would not be the spring any more.
    rows.append(sign * row, spring, soft ? gap / options.h : closing(gap, options),
                std::max(sign * last, 0.0), tag);
  }
}

}  // namespace amontons
