// Momenta and forces refer to the world's origin, as twists do, so that those of bodies add.
#include "amontons/multibody/kinematics/dynamics.hpp"

#include <algorithm>
#include <cmath>

#include "multibody/joints/tendons.hpp"

namespace amontons {

namespace {

// I_O = R I R' + m (<c, c> 1 - c c') by Steiner's theorem; skew(c)' skew(c) is that bracket.
SpatialInertia inertia_of(const Body& body, const Transform& pose) {
  const Mat3 R = to_matrix(pose.rotation), c = skew(pose(body.centre_of_mass));
  return {body.mass, body.mass * pose(body.centre_of_mass),
          R * body.inertia * transposed(R) + body.mass * (transposed(c) * c)};
}

// I a + v x* (I v), with gravity as an upward acceleration of the ground.
Twist force_of(const SpatialInertia& inertia, const Twist& v, Twist a, const Vec3& gravity) {
  a.linear -= gravity;
  const Twist p = momentum_of(inertia, v);
  Twist force = momentum_of(inertia, a);
  force += {cross(v.angular, p.linear), cross(v.angular, p.angular) + cross(v.linear, p.linear)};
  return force;
}

}  // namespace

std::vector<double> point_jacobian(const Tree& tree, const TreePose& pose, Index body, const Vec3& point) {
  const std::size_t nv = tree.nv();
  std::vector<double> J(6 * nv);
  for (Index k = tree.link_of(body); k >= 0; k = tree.link_of(tree.links()[k].parent)) {
    const Link& link = tree.links()[k];
    for (std::size_t c = link.first_v; c < link.first_v + link.v; ++c) {
      const Vec3 v = velocity_at(pose.columns[c], point), &w = pose.columns[c].angular;
      for (int i = 0; i < 3; ++i) {
        J[static_cast<std::size_t>(i) * nv + c] = v[i];
        J[static_cast<std::size_t>(i + 3) * nv + c] = w[i];
      }
    }
  }
  return J;
}

// A tendon's line is given as wrenches on bodies; their power on the columns of the tree is the rate.
std::vector<double> tendon_jacobian(const Tree& tree, const State& state, const TreePose& pose,
                                    std::span<const double> q, Index tendon) {
  const Model& model = tree.model();
  State at;
  at.coordinates = joint_coordinates_at(tree, pose, q, state.coordinates);
  BodyFrames frames(pose.bodies.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].pose = pose.bodies[i];
    frames[i].centre = pose.bodies[i](model.body(static_cast<Index>(i)).centre_of_mass);
  }
  const WideRow row = tendon_line(model, frames, at, tendon).row;
  std::vector<double> out(tree.nv());
  for (std::size_t i = 0; i < row.body.size(); ++i) {
    const auto& j = row.j[i];
    const Vec3 f{j[0], j[1], j[2]};
    const Twist wrench{f, Vec3{j[3], j[4], j[5]} + cross(frames[row.body[i]].centre, f)};
    for (Index k = tree.link_of(row.body[i]); k >= 0; k = tree.link_of(tree.links()[k].parent))
      for (std::size_t c = tree.links()[k].first_v; c < tree.links()[k].first_v + tree.links()[k].v; ++c)
        out[c] += power(wrench, pose.columns[c]);
  }
  return out;
}

namespace {

double product(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// The rate of j qd at constant qd, by a central difference of j along qd, because tendon paths have no closed
// second derivatives here. The error is 1e-10 of j's third derivative, and 1e-11 by rounding.
double line_acceleration(const Tree& tree, const State& state, std::span<const double> q,
                         std::span<const double> qd, Index tendon) {
  double fastest = 1;
  for (const double rate : qd) fastest = std::max(fastest, std::abs(rate));
  const double h = 1e-5 / fastest;
  double change = 0;
  for (const double sign : {1.0, -1.0}) {
    const std::vector<double> there = moved_along(tree, q, qd, sign * h);
    change += sign * product(tendon_jacobian(tree, state, pose_of(tree, state, there), there, tendon), qd);
  }
  return change / (2 * h);
}

}  // namespace

// With the inertia I of all links that a link supports, a unit of its column s gives the momentum I s. So M =
// <s', I s> for every column s' of the link and of its ancestors.
std::vector<double> mass_matrix(const Tree& tree, const State& state, const TreePose& pose,
                                std::span<const double> q) {
  const Model& model = tree.model();
  const std::size_t nv = tree.nv();
  std::vector<double> M(nv * nv);
  std::vector<SpatialInertia> inertia(tree.links().size());
  for (std::size_t k = 0; k < inertia.size(); ++k) {
    const Index body = tree.links()[k].body;
    inertia[k] = inertia_of(model.body(body), pose.bodies[body]);
  }
  for (std::size_t n = tree.order().size(); n-- > 0;) {
    const std::size_t k = tree.order()[n];
    const Link& link = tree.links()[k];
    for (std::size_t c = link.first_v; c < link.first_v + link.v; ++c) {
      const Twist momentum = momentum_of(inertia[k], pose.columns[c]);
      for (Index l = static_cast<Index>(k); l >= 0; l = tree.link_of(tree.links()[l].parent)) {
        const Link& carrier = tree.links()[l];
        for (std::size_t d = carrier.first_v; d < carrier.first_v + carrier.v; ++d)
          M[c * nv + d] = M[d * nv + c] = power(momentum, pose.columns[d]);
      }
    }
    if (const Index parent = tree.link_of(link.parent); parent >= 0) inertia[parent] += inertia[k];
    if (link.joint < 0) continue;
    const auto& dofs = model.joint(link.joint).dofs;
    for (std::size_t i = 0; i < dofs.size(); ++i) M[(link.first_v + i) * (nv + 1)] += dofs[i].armature;
    for (std::size_t i = dofs.size(); i < link.v; ++i)
      M[(link.first_v + i) * (nv + 1)] += model.joint(link.joint).ball_armature;
  }
  const auto& tendons = model.description().tendons;
  for (std::size_t t = 0; t < tendons.size(); ++t) {
    if (tendons[t].armature == 0) continue;
    const std::vector<double> j = tendon_jacobian(tree, state, pose, q, static_cast<Index>(t));
    for (std::size_t c = 0; c < nv; ++c)
      for (std::size_t d = 0; d < nv; ++d) M[c * nv + d] += tendons[t].armature * j[c] * j[d];
  }
  return M;
}

std::vector<BodyMomentum> body_momenta(const Tree& tree, const State& state, const TreePose& pose,
                                       std::span<const double> qd, std::span<const double> qdd) {
  const Model& model = tree.model();
  const TreeMotion motion = motion_of(tree, state, pose, qd, qdd);
  std::vector<BodyMomentum> out;
  for (std::size_t i = 0; i < model.bodies(); ++i) {
    const Body& body = model.body(static_cast<Index>(i));
    const SpatialInertia inertia = inertia_of(body, pose.bodies[i]);
    out.push_back({pose.bodies[i](body.centre_of_mass), momentum_of(inertia, motion.velocities[i]),
                   force_of(inertia, motion.velocities[i], motion.accelerations[i],
                            model.description().bodies[i].gravity_scale * model.description().gravity)});
  }
  return out;
}

// The forces of bodies are summed along the tree, and projected on the columns of each link.
std::vector<double> inverse_dynamics(const Tree& tree, const State& state, const TreePose& pose,
                                     std::span<const double> q, std::span<const double> qd,
                                     std::span<const double> qdd) {
  const Model& model = tree.model();
  const TreeMotion motion = motion_of(tree, state, pose, qd, qdd);
  std::vector<Twist> force(tree.links().size());
  std::vector<double> tau(tree.nv());
  for (std::size_t n = tree.order().size(); n-- > 0;) {
    const std::size_t k = tree.order()[n];
    const Link& link = tree.links()[k];
    const SpatialInertia inertia = inertia_of(model.body(link.body), pose.bodies[link.body]);
    force[k] += force_of(inertia, motion.velocities[link.body], motion.accelerations[link.body],
                         model.body(link.body).gravity_scale * model.description().gravity);
    for (std::size_t c = link.first_v; c < link.first_v + link.v; ++c)
      tau[c] = power(force[k], pose.columns[c]);
    if (const Index parent = tree.link_of(link.parent); parent >= 0) force[parent] += force[k];
    if (link.joint < 0) continue;
    const auto& dofs = model.joint(link.joint).dofs;
    for (std::size_t i = 0; i < dofs.size(); ++i)
      tau[link.first_v + i] += dofs[i].armature * qdd[link.first_v + i];
    for (std::size_t i = dofs.size(); i < link.v; ++i)
      tau[link.first_v + i] += model.joint(link.joint).ball_armature * qdd[link.first_v + i];
  }
  const auto& tendons = model.description().tendons;
  for (std::size_t t = 0; t < tendons.size(); ++t) {
    if (tendons[t].armature == 0) continue;
    const auto index = static_cast<Index>(t);
    const std::vector<double> j = tendon_jacobian(tree, state, pose, q, index);
    const double growth = product(j, qdd) + line_acceleration(tree, state, q, qd, index);
    for (std::size_t c = 0; c < tau.size(); ++c) tau[c] += tendons[t].armature * growth * j[c];
  }
  return tau;
}

std::vector<double> generalised_forces(const Tree& tree, const TreePose& pose, std::span<const Vec3> forces,
                                       std::span<const Vec3> torques) {
  const Model& model = tree.model();
  std::vector<Twist> sum(tree.links().size());
  std::vector<double> tau(tree.nv());
  for (std::size_t n = tree.order().size(); n-- > 0;) {
    const std::size_t k = tree.order()[n];
    const Link& link = tree.links()[k];
    const Vec3 centre = pose.bodies[link.body](model.body(link.body).centre_of_mass);
    sum[k] += {forces[link.body], torques[link.body] + cross(centre, forces[link.body])};
    for (std::size_t c = link.first_v; c < link.first_v + link.v; ++c)
      tau[c] = power(sum[k], pose.columns[c]);
    if (const Index parent = tree.link_of(link.parent); parent >= 0) sum[parent] += sum[k];
  }
  return tau;
}

}  // namespace amontons
