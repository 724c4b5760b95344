#include "amontons/multibody/model/model.hpp"

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

void check_material(const Material& m, const std::string& who) {
  AMONTONS_REQUIRE(m.friction >= 0 && std::isfinite(m.friction),
                   who + ": the coefficient of friction must be finite and not negative");
  AMONTONS_REQUIRE(m.restitution >= 0 && m.restitution <= 1, who + ": restitution must lie in [0, 1]");
  AMONTONS_REQUIRE(m.compliance >= 0 && std::isfinite(m.compliance),
                   who + ": compliance must be finite and not negative");
}

void check_not_negative(double value, const std::string& who, const char* what) {
  AMONTONS_REQUIRE(value >= 0 && std::isfinite(value),
                   who + ": " + what + " must be finite and not negative");
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

std::pair<Index, Index> ordered(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

Model::Model(ModelDescription description) : d_(std::move(description)) {
  AMONTONS_REQUIRE(is_finite(d_.gravity), "gravity is not finite");
  const Index bodies = static_cast<Index>(d_.bodies.size()), geoms = static_cast<Index>(d_.geoms.size()),
              joints = static_cast<Index>(d_.joints.size());
  check_names(d_.bodies, "body");
  check_names(d_.geoms, "geom");
  check_names(d_.joints, "joint");
  for (std::size_t i = 0; i < d_.bodies.size(); ++i) {
    check_body(d_.bodies[i], label("body", d_.bodies[i].name, i));
    if (d_.bodies[i].motion == Motion::dynamic) total_mass_ += d_.bodies[i].mass;
  }
  std::vector<double> radii;
  for (std::size_t g = 0; g < d_.geoms.size(); ++g) {
    const Geom& geom = d_.geoms[g];
    const std::string who = label("geom", geom.name, g);
    AMONTONS_REQUIRE(geom.body >= world && geom.body < bodies,
                     who + ": body " + std::to_string(geom.body) + " does not exist");
    check_frame(geom.frame, who, "frame");
    check_material(geom.material, who);
    AMONTONS_REQUIRE(is_finite(geom.surface_velocity), who + ": the surface velocity is not finite");
    try {
      validate(geom.shape);
    } catch (const InputError& error) {
      throw InputError(who + ": " + error.what());
    }
    AMONTONS_REQUIRE(!is_static_only(geom.shape) || !is_dynamic(geom.body),
                     who + ": planes, meshes and height fields do not move; give the body convex shapes");
    if (is_dynamic(geom.body)) radii.push_back(bounding_radius(geom.shape));
  }
  if (!radii.empty()) {
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    length_ = *middle;
  }
  first_dof_.push_back(0);
  for (std::size_t j = 0; j < d_.joints.size(); ++j) {
    const Joint& joint = d_.joints[j];
    check_joint(joint, label("joint", joint.name, j), bodies);
    first_dof_.push_back(first_dof_.back() + joint.dofs.size());
    // A joint to the world does not keep a body from touching the rest of the world.
    if (!joint.collide && joint.body_b != world) excluded_.push_back(ordered(joint.body_a, joint.body_b));
  }
  for (std::size_t k = 0; k < d_.couplings.size(); ++k) {
    const Coupling& c = d_.couplings[k];
    const std::string who = label("coupling", c.name, k);
    AMONTONS_REQUIRE(c.joint_a >= 0 && c.joint_a < joints && c.joint_b >= -1 && c.joint_b < joints,
                     who + ": that joint does not exist");
    const auto has_dof = [&](Index joint, Index dof) {
      return dof >= 0 && dof < static_cast<Index>(d_.joints[joint].dofs.size());
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
  for (const auto& [a, b] : d_.excluded_bodies) {
    AMONTONS_REQUIRE(a >= world && a < bodies && b >= world && b < bodies,
                     "excluded pair: a body does not exist");
    excluded_.push_back(ordered(a, b));
  }
  std::sort(excluded_.begin(), excluded_.end());
  for (const PairMaterial& p : d_.pair_materials) {
    AMONTONS_REQUIRE(p.geom_a >= 0 && p.geom_a < geoms && p.geom_b >= 0 && p.geom_b < geoms,
                     "material of a pair: a geom does not exist");
    check_material(p.material, "material of a pair");
    pairs_.push_back({ordered(p.geom_a, p.geom_b), p.material});
  }
  // Of two materials for one pair the later one holds.
  std::stable_sort(pairs_.begin(), pairs_.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
}

bool Model::may_touch(Index geom_a, Index geom_b) const {
  const Geom &a = d_.geoms[geom_a], &b = d_.geoms[geom_b];
  if (a.body == b.body || (!is_dynamic(a.body) && !is_dynamic(b.body))) return false;
  if (!((a.category & b.mask) || (b.category & a.mask))) return false;
  return !std::binary_search(excluded_.begin(), excluded_.end(), ordered(a.body, b.body));
}

Material Model::material(Index geom_a, Index geom_b) const {
  const auto key = ordered(geom_a, geom_b);
  const auto after = std::upper_bound(pairs_.begin(), pairs_.end(), key,
                                      [](const auto& k, const auto& pair) { return k < pair.first; });
  if (after != pairs_.begin() && std::prev(after)->first == key) return std::prev(after)->second;
  const Material &a = d_.geoms[geom_a].material, &b = d_.geoms[geom_b].material;
  Material m;
  switch (d_.friction_rule) {
    case FrictionRule::geometric_mean:
      m.friction = std::sqrt(a.friction * b.friction);
      break;
    case FrictionRule::maximum:
      m.friction = std::max(a.friction, b.friction);
      break;
    case FrictionRule::minimum:
      m.friction = std::min(a.friction, b.friction);
      break;
    case FrictionRule::mean:
      m.friction = 0.5 * (a.friction + b.friction);
      break;
  }
  m.restitution = std::max(a.restitution, b.restitution);
  m.compliance = a.compliance + b.compliance;
  return m;
}

}  // namespace amontons
