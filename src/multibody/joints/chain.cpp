#include "multibody/joints/chain.hpp"

namespace amontons {

namespace {

// The columns of the spatial Jacobian: dof i moves A about or along its axis as the dofs before it have
// placed that axis, T'(q) T^-1 = sum_i Ad(exp(s_1 q_1) ... exp(s_(i-1) q_(i-1))) s_i q'_i. `t` becomes T(q);
// slides are complete, of hinges `points` is where the axis passes.
void place_axes(const Joint& joint, std::span<const double> q, std::array<Screw, 6>& screws,
                std::array<Vec3, 6>& points, Transform& t) {
  for (std::size_t i = 0; i < joint.dofs.size(); ++i) {
    const Dof& dof = joint.dofs[i];
    const Vec3 axis = rotate(t.rotation, dof.axis);
    if (dof.kind == Dof::Kind::slide) {
      screws[i] = {axis, {}};
      t.position += q[i] * axis;
      continue;
    }
    points[i] = t(dof.anchor);
    screws[i] = {{}, axis};
    // exp of a hinge: the rotation about a point p is x -> p + R (x - p).
    const Quat rotation = exponential(q[i] * dof.axis);
    t = t * Transform{dof.anchor - rotate(rotation, dof.anchor), rotation};
  }
}

// The reference: see ChainKinematics.
Vec3 reference_point(const Joint& joint, bool spherical, const std::array<Vec3, 6>& points,
                     const Vec3& origin) {
  Vec3 reference = origin;
  for (std::size_t i = 0; i < joint.dofs.size() && !spherical; ++i)
    if (joint.dofs[i].kind == Dof::Kind::hinge) reference = points[i];
  return reference;
}

}  // namespace

ChainKinematics chain_kinematics(const Joint& joint, const Transform& relative, std::span<const double> q) {
  ChainKinematics chain;
  chain.dofs = joint.dofs.size();
  chain.spherical = joint.spherical || joint.kind == JointKind::distance;
  std::array<Vec3, 6> points;
  Transform& t = chain.target;
  place_axes(joint, q, chain.screws, points, t);
  chain.reference = reference_point(joint, chain.spherical, points, t.position);
  // A rotation about an axis through p moves the reference r by axis x (r - p).
  for (std::size_t i = 0; i < chain.dofs; ++i)
    if (joint.dofs[i].kind == Dof::Kind::hinge)
      chain.screws[i].linear = cross(chain.screws[i].angular, chain.reference - points[i]);
  // X T^-1 with the present pose X moves the reference by this; written as a difference of positions for the
  // origin itself, where nothing then cancels.
  const Quat rotation = relative.rotation * conjugate(t.rotation);
  const Vec3 lever = chain.reference - t.position;
  chain.error = {(relative.position - t.position) + (rotate(rotation, lever) - lever), logarithm(rotation)};
  return chain;
}

bool is_chain(const Joint& joint) { return joint.kind == JointKind::chain || joint.upper_distance == 0; }

}  // namespace amontons
