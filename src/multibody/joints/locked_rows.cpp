#include "multibody/joints/locked_rows.hpp"

#include "multibody/joints/row_terms.hpp"

namespace amontons {

// C_i = <w_i, error>, with w_i the wrenches that do no work on the dofs and `error` the small motion from
// T(q) to the pose. The error changes with the twist of A relative to B less sum_k screws_k q'_k; as <w_i,
// screws_k> = 0 the unknown q' drops out, and D v = <w_i, twist> is the row of w_i (exact at C = 0).
void append_locked_rows(const JointContext& joint, const StepBodies& bodies, const State& state,
                        const JointOptions& options, JointRows& rows) {
  const double L = options.length, compliance = joint.joint->compliance;
  std::array<Screw, 6> wrenches;
  const std::size_t count = locked_wrenches(joint.chain, L, wrenches);
  const JointWrench& last = state.joint_wrenches[joint.index];
  // The stored wrench is about the origin of frame_a, the rows are about the reference.
  const Vec3 last_torque = last.torque - cross(joint.arm, last.force);
  rows.cones.add_count<Free>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Screw& w = wrenches[i];
    const JacobianRow row = joint_row(joint, w);
    const double error = dot(w, joint.chain.error);
    // The last impulse in this basis, which is orthonormal w.r.t. <f, f> + <t, t> / L^2.
    const double x0 = dot(w.linear, last.force) + dot(w.angular, last_torque) / (L * L);
    RowTag tag{RowKind::locked, joint.index, -1};
    tag.force = w.linear;
    tag.torque = w.angular + cross(joint.arm, w.linear);
    if (compliance > 0)
      rows.append(row, compliance / (options.h * options.h), error / options.h, x0, tag);
    else
      rows.append(row, regularisation(row, bodies), recovery(error, options), x0, tag);
  }
}

}  // namespace amontons
