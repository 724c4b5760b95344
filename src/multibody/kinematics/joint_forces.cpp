// Generalised forces tau along qd as loads on bodies. The loads have the same power for every velocity that
// the joints allow, sum_i tau_i qd_i = sum_b <F_b, v_b> + <T_b, omega_b>.
#include "multibody/kinematics/joint_forces.hpp"

#include <algorithm>

#include "multibody/bodies/motion.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

namespace {

void add(const Model& model, Index body, const Vec3& force, const Vec3& torque,
         std::vector<BodyImpulse>& loads) {
  if (!model.is_dynamic(body)) return;
  loads[body].force += force;
  loads[body].torque += torque;
}

// The power on a floating base is <f, v of its frame> + <t, R' omega>: f acts at the frame, and is moved to
// the centre of mass.
void add_to_base(const Model& model, Index body, const BodyFrame& frame, std::span<const double> x,
                 std::vector<BodyImpulse>& loads) {
  const Vec3 force{x[0], x[1], x[2]}, torque{x[3], x[4], x[5]};
  const Vec3 arm = frame.pose.position - frame.centre;
  add(model, body, force, rotate(frame.pose.rotation, torque) + cross(arm, force), loads);
}

// Dofs of a joint have q_i' = <dual_i, twist>: the effort tau_i is the wrench tau_i dual_i on A and its
// opposite on B, as for an effort motor. A ball turns with omega_ball = omega - sum_i axis_i q_i'. So its
// torque T acts on A, the opposite on B, and the effort -<T, axis_i> along every dof before it.
void add_to_joint(const Model& model, const JointContext& joint, std::span<const double> x,
                  std::vector<BodyImpulse>& loads) {
  const std::size_t dofs = joint.joint->dofs.size();
  Vec3 torque;
  if (x.size() > dofs) torque = rotate(joint.pose.a.rotation, Vec3{x[dofs], x[dofs + 1], x[dofs + 2]});
  for (std::size_t i = 0; i < dofs; ++i) {
    const double effort = x[i] - dot(torque, rotate(joint.pose.b.rotation, joint.chain.screws[i].angular));
    add_wrenches(model, joint_row(joint, effort * joint.duals[i]), 1, loads);
  }
  add(model, joint.joint->body_a, {}, torque, loads);
  add(model, joint.joint->body_b, {}, -torque, loads);
}

}  // namespace

// Links without a force are skipped, so that a step without forces keeps its bits.
void add_joint_forces(const Tree& tree, const BodyFrames& bodies, std::span<const JointContext> joints,
                      std::span<const double> forces, double kick, std::vector<BodyImpulse>& loads) {
  if (forces.empty()) return;
  std::vector<double> impulses;
  for (const Link& link : tree.links()) {
    const auto own = forces.subspan(link.first_v, link.v);
    if (std::all_of(own.begin(), own.end(), [](double x) { return x == 0; })) continue;
    impulses.assign(own.begin(), own.end());
    for (double& x : impulses) x *= kick;
    if (link.joint < 0)
      add_to_base(tree.model(), link.body, bodies[link.body], impulses, loads);
    else
      add_to_joint(tree.model(), joints[link.joint], impulses, loads);
  }
}

}  // namespace amontons
