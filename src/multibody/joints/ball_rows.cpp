#include "multibody/joints/ball_rows.hpp"

#include <algorithm>

#include "multibody/joints/row_terms.hpp"

// The rotation vector r of the ball has r' = omega to first order in r, and d|r|/dt = <omega, r / |r|>
// exactly. Rows about the axes of frame_b are D v = s omega_i, with s = length.
namespace amontons {
namespace {

JacobianRow rotation_row(const JointContext& joint, const Vec3& axis) {
  return joint_row(joint, {{}, joint.length * axis});
}

Vec3 unit(int axis) {
  Vec3 v;
  v[axis] = 1;
  return v;
}

RowTag tag_of(const JointContext& joint, RowKind kind, Index axis) {
  return {kind, joint.index, axis, 1, {}, {}, joint.length};
}

// Spring k towards r = 0 and damper d, as the drive of a dof (append_drive): with r+ = r + h omega
//   omega + E x + c = 0,  E = 1 / (h^2 k + h d),  c = E h k r.
void append_springs(const JointContext& joint, double stiff, const Vec3& last, const JointOptions& options,
                    JointRows& rows) {
  const double h = options.h, s = joint.length;
  const Vec3& r = joint.chain.error.angular;
  for (int axis = 0; axis < 3; ++axis) {
    rows.cones.append(Free{});
    rows.append(rotation_row(joint, unit(axis)), 1 / stiff,
                h * joint.joint->ball_stiffness * r[axis] / (s * stiff), last[axis] / s,
                tag_of(joint, RowKind::ball, axis));
  }
}

// |r| <= limit: C = s (limit - |r|), D = -s <omega, r / |r|>. Near r = 0 it has no direction, and no limit is
// that small.
void append_limit(const JointContext& joint, const StepBodies& bodies, const State& state,
                  const JointOptions& options, JointRows& rows) {
  const double s = joint.length, limit = joint.joint->ball_limit;
  const Vec3& r = joint.chain.error.angular;
  const double angle = norm(r);
  if (!(limit < infinity) || angle < 1e-9) return;
  const Vec3 axis = r / angle;
  const JacobianRow row = -1.0 * rotation_row(joint, axis);
  const double gap = s * (limit - angle);
  if (!within_reach(row, bodies, gap, 0, options)) return;
  RowTag tag = tag_of(joint, RowKind::limit, -1);
  tag.torque = -s * axis;
  const double last = -dot(axis, state.joint_wrenches[joint.index].torque) / s;
  rows.cones.append(NonNegative{});
  rows.append(row, 0, closing(gap, options), std::max(last, 0.0), tag);
}

}  // namespace

void append_ball_rows(const JointContext& joint, const StepBodies& bodies, const State& state,
                      const JointOptions& options, JointRows& rows) {
  const Joint& ball = *joint.joint;
  const double h = options.h, s = joint.length;
  const Vec3& last = state.ball_impulses[joint.index];
  const double stiff = (h * h * ball.ball_stiffness + h * ball.ball_damping) / (s * s);
  if (stiff > 0) append_springs(joint, stiff, last, options, rows);
  const double bound = h * ball.ball_friction / s;
  for (int axis = 0; bound > 0 && axis < 3; ++axis) {
    add_interval(rows, bound);
    // The state holds the sum with the spring and damper, which then take all of it.
    const double x0 = stiff > 0 ? 0 : std::clamp(last[axis] / s, -bound, bound);
    rows.append(rotation_row(joint, unit(axis)), 0, 0, x0, tag_of(joint, RowKind::ball, axis));
  }
  append_limit(joint, bodies, state, options, rows);
}

}  // namespace amontons
