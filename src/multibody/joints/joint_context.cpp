#include "multibody/joints/joint_context.hpp"

namespace amontons {

// The present poses, for functions that only measure; place_joints() is for functions that make rows.
JointPose joint_pose(const Joint& joint, const BodyFrames& bodies) {
  const auto pose = [&](Index body) { return body < 0 ? Transform{} : bodies[body].pose; };
  return joint_pose(joint, pose(joint.body_a), pose(joint.body_b));
}

std::span<const double> coordinates_of(const Model& model, const State& state, std::size_t j) {
  const std::size_t first = model.first_dof(j);
  return std::span(state.coordinates).subspan(first, model.first_dof(j + 1) - first);
}

// Two bodies that impulses cannot move have no rows: their part of A would be zero, and a violated joint
// between them would make the problem infeasible.
bool is_active(const Model& model, const Joint& joint) {
  return model.is_dynamic(joint.body_a) || model.is_dynamic(joint.body_b);
}

// Forces act at A's reference point, which is T(q)'s reference moved by the error. An impulse and its
// opposite then act at one point of the world, even if the joint is violated.
void place(JointContext& joint, const JointPose& pose, const Vec3& centre_a, const Vec3& centre_b,
           std::span<const double> q) {
  // All quantities are in the axes of frame_b except the arms r_a and r_b, which are world vectors.
  joint.pose = pose;
  joint.axes = to_matrix(pose.b.rotation);
  joint.arm = {};
  Vec3 point = pose.a.position;
  if (is_chain(*joint.joint)) {
    joint.chain = chain_kinematics(*joint.joint, pose.relative, q);
    joint.duals = dual_wrenches(joint.chain, joint.length);
    if (!joint.chain.spherical) {
      joint.arm = (joint.chain.reference + joint.chain.error.linear) - pose.relative.position;
      point += joint.axes * joint.arm;
    }
  }
  if (joint.body_a >= 0) joint.r_a = point - centre_a;
  if (joint.body_b >= 0) joint.r_b = point - centre_b;
}

namespace {

// A fixed body counts as the world: its velocity is zero. Rows without it are cheaper, and empty if both
// sides are fixed. Kinematic bodies stay, because rows must include their velocity.
void fill(JointContext& context, const Model& model, const BodyFrames& bodies, const State& state,
          std::size_t j) {
  const auto unless_fixed = [&](Index body) {
    return body >= 0 && model.body(body).motion != Motion::still ? body : world;
  };
  const Joint* joint = &model.joint(static_cast<Index>(j));
  // Screws of a hinge do not depend on its angle.
  const bool known = context.joint == joint && context.length == model.length() && is_hinge(*joint);
  context.joint = joint;
  context.index = static_cast<Index>(j);
  context.body_a = unless_fixed(context.joint->body_a);
  context.body_b = unless_fixed(context.joint->body_b);
  context.length = model.length();
  if (context.in_tree) return;  // place_tree_joints()
  const auto centre = [&](Index body) { return body >= 0 ? bodies[body].centre : Vec3{}; };
  place(context, joint_pose(*context.joint, bodies), centre(context.body_a), centre(context.body_b),
        coordinates_of(model, state, j));
  if (!known && is_chain(*joint))
    context.locked_count = locked_wrenches(context.chain, context.length, context.locked);
}

}  // namespace

void place_joints(const Model& model, const BodyFrames& bodies, const State& state, JointContexts& joints,
                  std::span<const unsigned char> in_tree) {
  joints.resize(model.joints());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    joints[j].in_tree = !in_tree.empty() && in_tree[j];
    fill(joints[j], model, bodies, state, j);
  }
}

Screw joint_twist(const JointContext& joint, const BodyVelocity& a, const BodyVelocity& b) {
  Vec3 linear, angular;
  if (joint.body_a >= 0) {
    linear = a.linear + cross(a.angular, joint.r_a);
    angular = a.angular;
  }
  if (joint.body_b >= 0) {
    linear -= b.linear + cross(b.angular, joint.r_b);
    angular -= b.angular;
  }
  const Mat3 to_joint = transposed(joint.axes);
  return {to_joint * linear, to_joint * angular};
}

Screw joint_twist(const JointContext& joint, const BodyVelocities& v) {
  const auto of = [&](Index body) { return body < 0 ? BodyVelocity{} : v[body]; };
  return joint_twist(joint, of(joint.body_a), of(joint.body_b));
}

// The power of a wrench (f, t) at a point P of the world on a body is <f, v + w x r> + <t, w> with r from the
// centre of mass to P. This equals <f, v> + <r x f + t, w>. So the row is (f, r x f + t) on A. B gets the
// opposite wrench at the same P, so that linear and angular momentum are conserved to rounding.
JacobianRow joint_row(const JointContext& joint, const Screw& wrench) {
  const Vec3 f = joint.axes * wrench.linear, t = joint.axes * wrench.angular;
  JacobianRow row{joint.body_a, joint.body_b, {}, {}};
  if (joint.body_a >= 0) {
    const Vec3 m = cross(joint.r_a, f) + t;
    row.a = {f.x, f.y, f.z, m.x, m.y, m.z};
  }
  if (joint.body_b >= 0) {
    const Vec3 m = cross(joint.r_b, f) + t;
    row.b = {-f.x, -f.y, -f.z, -m.x, -m.y, -m.z};
  }
  return row;
}

// -1 turns C <= 0 into C >= 0.
JacobianRow dof_row(const JointContext& joint, std::size_t dof) {
  const double s = joint.scale(dof);
  JacobianRow row = joint_row(joint, s * joint.duals[dof]);
  if (!joint.in_tree) return row;
  row.coordinate = joint.first_coordinate + static_cast<Index>(dof);
  row.scale = s;
  return row;
}

JacobianRow operator*(double s, const JacobianRow& row) {
  JacobianRow out = row;
  for (double& c : out.a) c *= s;
  for (double& c : out.b) c *= s;
  out.scale *= s;
  return out;
}

void add_wrench(const Model& model, Index body, const std::array<double, 6>& j, double impulse,
                std::vector<BodyImpulse>& loads) {
  if (!model.is_dynamic(body)) return;
  loads[body].force += impulse * Vec3{j[0], j[1], j[2]};
  loads[body].torque += impulse * Vec3{j[3], j[4], j[5]};
}

void add_wrenches(const Model& model, const JacobianRow& row, double impulse,
                  std::vector<BodyImpulse>& loads) {
  add_wrench(model, row.body_a, row.a, impulse, loads);
  add_wrench(model, row.body_b, row.b, impulse, loads);
}

}  // namespace amontons
