#include "amontons/multibody/model/description.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "amontons/base/error.hpp"

namespace amontons {

namespace {

std::string label(const char* kind, const std::string& name, std::size_t index) {
  return name.empty() ? std::string(kind) + " " + std::to_string(index)
                      : std::string(kind) + " \"" + name + "\"";
}

bool is_finite(const Transform& t) {
  const Quat& q = t.rotation;
  return amontons::is_finite(t.position) && std::isfinite(q.w + q.x + q.y + q.z);
}

void check_frame(const Transform& frame, const std::string& who, const char* what) {
  AMONTONS_REQUIRE(is_finite(frame), who + ": the " + what + " is not finite");
  AMONTONS_REQUIRE(std::abs(norm(frame.rotation) - 1) < 1e-6,
                   who + ": the orientation of the " + what + " is not a unit quaternion; normalise it");
}

// Principal moments must be positive and obey a + b >= c, else no distribution of mass has them. Both follow
// from trace(I)/2 1 - I, the second moment of mass, being positive semidefinite; checked by its leading
// minors in every order, with room for rounding.
void check_inertia(const Mat3& I, const std::string& who) {
  double scale = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      AMONTONS_REQUIRE(std::isfinite(I(i, j)), who + ": the inertia is not finite");
      scale = std::max(scale, std::abs(I(i, j)));
    }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < i; ++j)
      AMONTONS_REQUIRE(std::abs(I(i, j) - I(j, i)) <= asymmetry_of_rounding * scale,
                       who + ": the inertia is not symmetric; symmetrise it");
  const auto minors = [](const Mat3& m, double& two, double& three) {
    two = std::min({m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0), m(0, 0) * m(2, 2) - m(0, 2) * m(2, 0),
                    m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)});
    three = determinant(m);
  };
  double two, three;
  minors(I, two, three);
  AMONTONS_REQUIRE(I(0, 0) > 0 && I(1, 1) > 0 && I(2, 2) > 0 && two > 0 && three > 0,
                   who + ": the inertia is not positive definite; every principal moment must be > 0");
  const double half = 0.5 * (I(0, 0) + I(1, 1) + I(2, 2));
  const Mat3 second = Mat3::diagonal(half, half, half) + -1.0 * I;
  minors(second, two, three);
  const double room = 1e-6;
  AMONTONS_REQUIRE(
      second(0, 0) >= -room * scale && second(1, 1) >= -room * scale && second(2, 2) >= -room * scale &&
          two >= -room * scale * scale && three >= -room * scale * scale * scale,
      who + ": one principal moment of inertia exceeds the sum of the others, which no body has");
}

void check_body(const Body& body, const std::string& who) {
  check_frame(body.pose, who, "pose");
  AMONTONS_REQUIRE(is_finite(body.linear_velocity) && is_finite(body.angular_velocity),
                   who + ": the initial velocity is not finite");
  AMONTONS_REQUIRE(is_finite(body.centre_of_mass), who + ": the centre of mass is not finite");
  if (body.motion != Motion::dynamic) {
    AMONTONS_REQUIRE(body.motion == Motion::kinematic ||
                         (body.linear_velocity == Vec3{} && body.angular_velocity == Vec3{}),
                     who + ": a fixed body has no velocity; make it kinematic");
    return;
  }
  AMONTONS_REQUIRE(body.mass > 0 && std::isfinite(body.mass),
                   who + ": the mass is " + std::to_string(body.mass) +
                       " kg; it must be positive and finite (or make the body fixed)");
  check_inertia(body.inertia, who);
}

void check_not_negative(double value, const std::string& who, const char* what) {
  AMONTONS_REQUIRE(value >= 0 && std::isfinite(value),
                   who + ": " + what + " must be finite and not negative");
}

void check_material(const Material& m, const std::string& who) {
  check_not_negative(m.friction, who, "the coefficient of friction");
  check_not_negative(m.torsional_friction, who, "torsional friction");
  check_not_negative(m.rolling_friction, who, "rolling friction");
  AMONTONS_REQUIRE(std::isfinite(m.friction_across),
                   who + ": the friction across the direction is not finite");
  AMONTONS_REQUIRE(m.restitution >= 0 && m.restitution <= 1, who + ": restitution must lie in [0, 1]");
  check_not_negative(m.compliance, who, "compliance");
}

void check_dof(const Dof& dof, const std::string& who) {
  AMONTONS_REQUIRE(is_finite(dof.axis) && std::abs(norm(dof.axis) - 1) < 1e-6,
                   who + ": the axis is not a unit vector; normalise it");
  AMONTONS_REQUIRE(is_finite(dof.anchor), who + ": the anchor is not finite");
  AMONTONS_REQUIRE(dof.lower <= dof.upper, who + ": the lower limit exceeds the upper limit; swap them");
  AMONTONS_REQUIRE(dof.lower < infinity && dof.upper > -infinity, who + ": the limits leave no coordinate");
  check_not_negative(dof.stiffness, who, "stiffness");
  check_not_negative(dof.damping, who, "damping");
  check_not_negative(dof.friction, who, "friction");
  check_not_negative(dof.armature, who, "armature");
  check_not_negative(dof.motor.gain, who, "the gain of the motor");
  check_not_negative(dof.motor.damping_gain, who, "the damping gain of the motor");
  AMONTONS_REQUIRE(std::isfinite(dof.rest), who + ": the rest coordinate of the spring is not finite");
  AMONTONS_REQUIRE(dof.motor.max_effort > 0, who + ": the largest effort of the motor must be positive");
  AMONTONS_REQUIRE(std::isfinite(dof.motor.target), who + ": the target of the motor is not finite");
}

void check_joint(const Joint& joint, const std::string& who, Index bodies) {
  for (Index body : {joint.body_a, joint.body_b})
    AMONTONS_REQUIRE(body >= world && body < bodies,
                     who + ": body " + std::to_string(body) + " does not exist");
  AMONTONS_REQUIRE(joint.body_a != world, who + ": body A must not be the world; swap the bodies");
  AMONTONS_REQUIRE(joint.body_a != joint.body_b, who + " joins a body to itself; it needs two bodies");
  check_frame(joint.frame_a, who, "frame on body A");
  check_frame(joint.frame_b, who, "frame on body B");
  check_not_negative(joint.compliance, who, "compliance");
  check_not_negative(joint.ball_stiffness, who, "stiffness");
  check_not_negative(joint.ball_damping, who, "damping");
  check_not_negative(joint.ball_friction, who, "friction");
  AMONTONS_REQUIRE(joint.ball_limit > 0, who + ": the limit of the rotation must be positive");
  AMONTONS_REQUIRE(joint.dofs.size() <= 6, who + ": a joint has at most six degrees of freedom");
  AMONTONS_REQUIRE(joint.kind == JointKind::chain || (joint.dofs.empty() && !joint.spherical),
                   who + ": a distance joint has no degrees of freedom");
  AMONTONS_REQUIRE(joint.lower_distance >= 0 && joint.lower_distance <= joint.upper_distance &&
                       joint.lower_distance < infinity,
                   who + ": the limits of the distance must satisfy 0 <= lower <= upper");
  for (std::size_t k = 0; k < joint.dofs.size(); ++k)
    check_dof(joint.dofs[k], joint.dofs.size() > 1 ? who + ", dof " + std::to_string(k) : who);
}

template <class Items>
void check_names(const Items& items, const char* kind) {
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (!items[i].name.empty())
      AMONTONS_REQUIRE(first.emplace(items[i].name, i).second,
                       std::string(kind) + " \"" + items[i].name + "\" occurs twice; names must be unique");
}

void check_geom(const ModelDescription& d, const Geom& geom, const std::string& who) {
  AMONTONS_REQUIRE(geom.body >= world && geom.body < static_cast<Index>(d.bodies.size()),
                   who + ": body " + std::to_string(geom.body) + " does not exist");
  check_frame(geom.frame, who, "frame");
  check_material(geom.material, who);
  AMONTONS_REQUIRE(is_finite(geom.surface_velocity), who + ": the surface velocity is not finite");
  AMONTONS_REQUIRE(is_finite(geom.friction_direction), who + ": the friction direction is not finite");
  AMONTONS_REQUIRE(geom.material.friction_across < 0 || !(geom.friction_direction == Vec3{}),
                   who + ": friction across a direction needs the direction; give friction_direction");
  try {
    validate(geom.shape);
  } catch (const InputError& error) {
    throw InputError(who + ": " + error.what());
  }
  const bool dynamic = geom.body >= 0 && d.bodies[geom.body].motion == Motion::dynamic;
  AMONTONS_REQUIRE(!is_static_only(geom.shape) || !dynamic,
                   who + ": planes, meshes and height fields do not move; give the body convex shapes");
}

void check_coupling(const ModelDescription& d, const Coupling& c, const std::string& who) {
  const Index joints = static_cast<Index>(d.joints.size());
  AMONTONS_REQUIRE(c.joint_a >= 0 && c.joint_a < joints && c.joint_b >= -1 && c.joint_b < joints,
                   who + ": that joint does not exist");
  const auto has_dof = [&](Index joint, Index dof) {
    return dof >= 0 && dof < static_cast<Index>(d.joints[joint].dofs.size());
  };
  AMONTONS_REQUIRE(has_dof(c.joint_a, c.dof_a) && (c.joint_b < 0 || has_dof(c.joint_b, c.dof_b)),
                   who + ": that joint has no such degree of freedom");
  AMONTONS_REQUIRE(c.joint_b < 0 || c.joint_a != c.joint_b || c.dof_a != c.dof_b,
                   who + " couples a degree of freedom to itself");
  AMONTONS_REQUIRE(!c.coefficients.empty(), who + ": give the coefficients of the polynomial");
  for (double value : c.coefficients)
    AMONTONS_REQUIRE(std::isfinite(value), who + ": a coefficient is not finite");
  check_not_negative(c.compliance, who, "compliance");
}

void check_pairs(const ModelDescription& d) {
  const Index bodies = static_cast<Index>(d.bodies.size()), geoms = static_cast<Index>(d.geoms.size());
  for (const auto& [a, b] : d.excluded_bodies)
    AMONTONS_REQUIRE(a >= world && a < bodies && b >= world && b < bodies,
                     "excluded pair: a body does not exist");
  for (const PairMaterial& p : d.pair_materials) {
    AMONTONS_REQUIRE(p.geom_a >= 0 && p.geom_a < geoms && p.geom_b >= 0 && p.geom_b < geoms,
                     "material of a pair: a geom does not exist");
    check_material(p.material, "material of a pair");
    const Geom &a = d.geoms[p.geom_a], &b = d.geoms[p.geom_b];
    AMONTONS_REQUIRE(p.material.friction_across < 0 || !(a.friction_direction == Vec3{}) ||
                         !(b.friction_direction == Vec3{}),
                     "material of a pair: friction across a direction needs the direction; give one of \"" +
                         a.name + "\" and \"" + b.name + "\" a friction_direction");
  }
}

}  // namespace

void check(const ModelDescription& d) {
  AMONTONS_REQUIRE(is_finite(d.gravity), "gravity is not finite");
  check_names(d.bodies, "body");
  check_names(d.geoms, "geom");
  check_names(d.joints, "joint");
  for (std::size_t i = 0; i < d.bodies.size(); ++i)
    check_body(d.bodies[i], label("body", d.bodies[i].name, i));
  for (std::size_t g = 0; g < d.geoms.size(); ++g)
    check_geom(d, d.geoms[g], label("geom", d.geoms[g].name, g));
  for (std::size_t j = 0; j < d.joints.size(); ++j)
    check_joint(d.joints[j], label("joint", d.joints[j].name, j), static_cast<Index>(d.bodies.size()));
  for (std::size_t k = 0; k < d.couplings.size(); ++k)
    check_coupling(d, d.couplings[k], label("coupling", d.couplings[k].name, k));
  check_pairs(d);
}

}  // namespace amontons
