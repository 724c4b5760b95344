// Clearance in a joint. Its coordinates are two slides x, y in the frame of B and the turn of A about their
// normal. Each side that may touch is a contact with friction in the plane of the slides, on rows of these
// coordinates.
//
// Journal (radius R) in a bearing of radius R + clearance: the gap along a direction n is clearance - <n, (x,
// y)>. The disc of allowed places is convex, so that a half-plane normal to any n contains it. n points to
// where the journal would be after the step with its velocity at the start: a journal at rest presses along
// (x, y). The journal touches at R n from its centre, where its surface slips with <t, (x', y')> + R turn'.
//
// Slider of a length l in a guide of its height plus twice the clearance: the corners at +-l/2 have the
// offset y +- l/2 sin(turn), and may touch either side. They slip along x.
#include "multibody/joints/clearance_rows.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/elementary.hpp"
#include "amontons/base/policy.hpp"

namespace amontons {
namespace {

// The wrench whose rate is x times that of the first slide, and so on. A dual wrench does work on its own
// coordinate alone, so that the sum has the rate of the sum.
Screw combined(const JointContext& joint, double x, double y, double turn) {
  Screw w{};
  const double factors[3] = {x, y, turn};
  for (int k = 0; k < 3; ++k) {
    w.linear += factors[k] * joint.duals[k].linear;
    w.angular += factors[k] * joint.duals[k].angular;
  }
  return w;
}

// One side that may touch. Its impulse is a wrench on A, as that of a locked direction, so that the reaction
// of the joint contains it. `press` is the direction that opens the gap, `slip` that of friction, as
// wrenches.
void append_side(const RowInput& in, const JointContext& joint, double gap, const Screw& press,
                 const Screw& slip, JointRows& rows) {
  const JacobianRow normal = joint_row(joint, press);
  const double speed = std::max(std::abs(row_velocity(normal, in.bodies.start)),
                                std::abs(row_velocity(normal, in.bodies.free)));
  if (!within_reach(gap, speed, in.options)) return;
  // The impulse of the last step may have been on another side, and is a start only.
  const auto block = [&](const Screw& w, const RowTerms& terms) {
    RowTag tag{RowKind::clearance, joint.index, -1};
    tag.force = w.linear;
    tag.torque = w.angular + cross(joint.arm, w.linear);
    return BlockRow{joint_row(joint, w), terms, 0, tag};
  };
  const RowTerms touching{0, closing(gap, in.options), Restraint::inequality, gap};
  const BlockRow first = block(press, touching);
  if (!(joint.joint->clearance_friction > 0))
    return rows.append(NonNegative{}, first.row, first.terms, first.start, first.tag);
  rows.append_block(PlanarFriction{joint.joint->clearance_friction}, {first, block(slip, {0, 0})});
}

}  // namespace

void append_clearance_rows(const RowInput& in, const JointContext& joint, JointRows& rows) {
  const Joint& made = *joint.joint;
  const std::span<const double> q = coordinates_of(in.model, in.state, joint.index);
  // A tilted slider touches with two corners, diagonally; a straight one with both of a side.
  if (made.guide_length > 0) {
    const double arm = 0.5 * made.guide_length, sine = elementary::sin(q[2]), cosine = elementary::cos(q[2]);
    for (const double end : {1.0, -1.0})
      for (const double side : {1.0, -1.0})
        append_side(in, joint, made.clearance - side * (q[1] + end * arm * sine),
                    combined(joint, 0, -side, -side * end * arm * cosine), combined(joint, 1, 0, 0), rows);
    return;
  }
  const auto rate = [&](std::size_t k) {
    return row_velocity(joint_row(joint, joint.duals[k]), in.bodies.start);
  };
  double x = q[0] + in.options.h * rate(0), y = q[1] + in.options.h * rate(1);
  double size = elementary::hypot(x, y);
  if (!(size > base::policy.rounding * in.options.length)) {  // in the middle any direction serves
    x = 1;
    y = 0;
    size = 1;
  }
  x /= size;
  y /= size;
  append_side(in, joint, made.clearance - (x * q[0] + y * q[1]), combined(joint, -x, -y, 0),
              combined(joint, -y, x, made.journal_radius), rows);
}

}  // namespace amontons
