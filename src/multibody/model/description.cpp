#include "amontons/multibody/model/description.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "amontons/base/error.hpp"

namespace amontons {

namespace {

// The name of a thing in messages: its name, otherwise its place in the model.
std::string label(const char* kind, const std::string& name, std::size_t index) {
  return name.empty() ? std::string(kind) + " " + std::to_string(index)
                      : std::string(kind) + " \"" + name + "\"";
}

// The sum of the components is finite only if each is.
bool is_finite(const Transform& t) {
  const Quat& q = t.rotation;
  return amontons::is_finite(t.position) && std::isfinite(q.w + q.x + q.y + q.z);
}

// Messages name the body, geom or joint first, then the error, then the remedy if there is one.
void require(bool ok, const std::string& who, const char* message) {
  AMONTONS_REQUIRE(ok, who + ": " + message);
}

struct Named {
  double value;
  const char* what;
};
void check_not_negative(const std::string& who, std::initializer_list<Named> values) {
  for (const auto& [value, what] : values)
    AMONTONS_REQUIRE(value >= 0 && std::isfinite(value),
                     who + ": " + what + " must be finite and not negative");
}

// 1e-6 admits values stored in single precision.
void check_frame(const Transform& frame, const std::string& who, const char* what) {
  AMONTONS_REQUIRE(is_finite(frame), who + ": the " + what + " is not finite");
  AMONTONS_REQUIRE(std::abs(norm(frame.rotation) - 1) < 1e-6,
                   who + ": the orientation of the " + what + " is not a unit quaternion; normalise it");
}

// The smallest principal minors of each order. By Sylvester's criterion a symmetric matrix is positive
// definite if they are positive, and semidefinite if none is negative.
std::array<double, 3> least_minors(const Mat3& m) {
  const auto two = [&](int i, int j) { return m(i, i) * m(j, j) - m(i, j) * m(j, i); };
  return {std::min({m(0, 0), m(1, 1), m(2, 2)}), std::min({two(0, 1), two(0, 2), two(1, 2)}), determinant(m)};
}

// Principal moments must be positive and satisfy a + b >= c, otherwise no mass distribution has them. Both
// follow if trace(I)/2 1 - I, the second moment of mass, is positive semidefinite. Rods and plates are at the
// bound a + b = c, and files round inertias to six digits: hence a tolerance.
void check_inertia(const Mat3& I, const std::string& who) {
  constexpr double room = 1e-6;
  double scale = 0;
  for (const Vec3& row : I.row) {
    require(is_finite(row), who, "the inertia is not finite");
    scale = std::max({scale, std::abs(row.x), std::abs(row.y), std::abs(row.z)});
  }
  for (int i = 0; i < 3; ++i)
    require(std::abs(I(i, (i + 1) % 3) - I((i + 1) % 3, i)) <= asymmetry_of_rounding * scale, who,
            "the inertia is not symmetric; symmetrise it");
  const auto [one, two, three] = least_minors(I);
  require(one > 0 && two > 0 && three > 0, who,
          "the inertia is not positive definite; every principal moment must be > 0");
  const double half = 0.5 * (I(0, 0) + I(1, 1) + I(2, 2));
  const auto [a, b, c] = least_minors(Mat3::diagonal(half, half, half) + -1.0 * I);
  require(a >= -room * scale && b >= -room * scale * scale && c >= -room * scale * scale * scale, who,
          "one principal moment of inertia exceeds the sum of the others, which no body has");
}

// Mass and inertia of a body that impulses do not move are never read, so they may have any value.
void check_body(const Body& body, const std::string& who) {
  check_frame(body.pose, who, "pose");
  require(is_finite(body.linear_velocity) && is_finite(body.angular_velocity), who,
          "the initial velocity is not finite");
  require(is_finite(body.centre_of_mass), who, "the centre of mass is not finite");
  require(std::isfinite(body.gravity_scale), who, "the gravity scale is not finite");
  // A kinematic body keeps its given velocity. A velocity of a fixed body would be misleading, because it
  // does not move.
  if (body.motion != Motion::dynamic) {
    require(body.motion == Motion::kinematic ||
                (body.linear_velocity == Vec3{} && body.angular_velocity == Vec3{}),
            who, "a fixed body has no velocity; make it kinematic");
    return;
  }
  AMONTONS_REQUIRE(body.mass > 0 && std::isfinite(body.mass),
                   who + ": the mass is " + std::to_string(body.mass) +
                       " kg; it must be positive and finite (or make the body fixed)");
  check_inertia(body.inertia, who);
}

// A negative static friction means that there is none beside the kinetic one.
void check_static(double kinetic, double stuck, double speed, const std::string& who) {
  require(std::isfinite(stuck), who, "the static friction is not finite");
  require(stuck < 0 || stuck >= kinetic, who,
          "the static friction is less than the kinetic one; swap them, or leave the static one out");
  require(speed >= 0 && std::isfinite(speed), who, "the Stribeck speed must be finite and not negative");
}

// A negative friction_across means that there is none.
void check_material(const Material& m, const std::string& who) {
  check_not_negative(who, {{m.friction, "the coefficient of friction"},
                           {m.torsional_friction, "torsional friction"},
                           {m.rolling_friction, "rolling friction"},
                           {m.compliance, "compliance"},
                           {m.relaxation_time, "relaxation time"},
                           {m.rest_offset, "rest offset"}});
  check_static(m.friction, m.friction_static, m.stribeck_speed, who);
  require(std::isfinite(m.friction_across), who, "the friction across the direction is not finite");
  require(m.restitution >= 0 && m.restitution <= 1, who, "restitution must lie in [0, 1]");
}

// Limits may be infinite and may coincide (a locked dof); lower = +inf or upper = -inf admits no coordinate.
// Springs, dampers and friction with negative coefficients would create energy.
void check_dof(const Dof& dof, const std::string& who) {
  require(is_finite(dof.axis) && std::abs(norm(dof.axis) - 1) < 1e-6, who,
          "the axis is not a unit vector; normalise it");
  require(is_finite(dof.anchor), who, "the anchor is not finite");
  require(dof.lower <= dof.upper, who, "the lower limit exceeds the upper limit; swap them");
  require(dof.lower < infinity && dof.upper > -infinity, who, "the limits leave no coordinate");
  check_not_negative(who, {{dof.stiffness, "stiffness"},
                           {dof.damping, "damping"},
                           {dof.friction, "friction"},
                           {dof.armature, "armature"},
                           {dof.motor.kp, "kp of the motor"},
                           {dof.motor.kd, "kd of the motor"}});
  check_static(dof.friction, dof.friction_static, dof.stribeck_speed, who);
  require(std::isfinite(dof.rest), who, "the rest coordinate of the spring is not finite");
  require(dof.motor.max_effort > 0, who, "the largest effort of the motor must be positive");
  require(std::isfinite(dof.motor.control), who, "the control of the motor is not finite");
  const MotorKind kind = dof.motor.kind;
  require(dof.motor.kp == 0 || kind == MotorKind::position, who,
          "kp is of motors to positions; a velocity motor takes kd, an effort motor none");
  require(dof.motor.kd == 0 || kind == MotorKind::velocity || dof.motor.kp > 0, who,
          "kd is of velocity motors and of position motors with kp; give kp, or damping of the joint");
  require(dof.lower_effort <= dof.upper_effort && dof.lower_effort < infinity && dof.upper_effort > -infinity,
          who, "the bounds of the effort of actuators leave none; the lower one comes first");
}

// Rows of clearance read two slides and the hinge about their normal, in this order.
void check_clearance(const Joint& joint, const std::string& who) {
  check_not_negative(who, {{joint.clearance, "clearance"},
                           {joint.guide_length, "the length of the slider"},
                           {joint.journal_radius, "the radius of the journal"},
                           {joint.clearance_friction, "the friction of the clearance"}});
  if (joint.clearance == 0) return;
  using Kind = Dof::Kind;
  const auto& dofs = joint.dofs;
  require(joint.kind == JointKind::chain && !joint.spherical && dofs.size() == 3 &&
              dofs[0].kind == Kind::slide && dofs[1].kind == Kind::slide && dofs[2].kind == Kind::hinge,
          who,
          "clearance needs two slides and a hinge about their normal, as add_revolute_joint(clearance=) "
          "makes them");
}

// More than six dofs have dependent axes in every pose, so that coordinates are not unique. Body A must be
// one of the model, because frames, coordinates and reactions are defined on A.
void check_joint(const Joint& joint, const std::string& who, Index bodies) {
  // B may be the world.
  for (Index body : {joint.body_a, joint.body_b})
    AMONTONS_REQUIRE(body >= world && body < bodies,
                     who + ": body " + std::to_string(body) + " does not exist");
  require(joint.body_a != world, who, "body A must not be the world; swap the bodies");
  AMONTONS_REQUIRE(joint.body_a != joint.body_b, who + " joins a body to itself; it needs two bodies");
  check_frame(joint.frame_a, who, "frame on body A");
  check_frame(joint.frame_b, who, "frame on body B");
  check_not_negative(who, {{joint.compliance, "compliance"},
                           {joint.ball_stiffness, "stiffness"},
                           {joint.ball_damping, "damping"},
                           {joint.ball_armature, "armature"},
                           {joint.ball_friction, "friction"}});
  require(joint.ball_limit > 0, who, "the limit of the rotation must be positive");
  require(joint.dofs.size() <= 6, who, "a joint has at most six degrees of freedom");
  require(joint.kind == JointKind::chain || (joint.dofs.empty() && !joint.spherical), who,
          "a distance joint has no degrees of freedom");
  require(joint.lower_distance >= 0 && joint.lower_distance <= joint.upper_distance &&
              joint.lower_distance < infinity,
          who, "the limits of the distance must satisfy 0 <= lower <= upper");
  check_clearance(joint, who);
  for (std::size_t k = 0; k < joint.dofs.size(); ++k)
    check_dof(joint.dofs[k], joint.dofs.size() > 1 ? who + ", dof " + std::to_string(k) : who);
}

// Files and users refer to things by name; things without one are known only by index.
template <class Items>
void check_names(const Items& items, const char* kind) {
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (!items[i].name.empty())
      AMONTONS_REQUIRE(first.emplace(items[i].name, i).second,
                       std::string(kind) + " \"" + items[i].name + "\" occurs twice; names must be unique");
}

// Planes, meshes and height fields have no volume. They collide with convex shapes, but not with each other,
// and belong on fixed and kinematic bodies.
void check_geom(const ModelDescription& d, const Geom& geom, const std::string& who) {
  AMONTONS_REQUIRE(geom.body >= world && geom.body < static_cast<Index>(d.bodies.size()),
                   who + ": body " + std::to_string(geom.body) + " does not exist");
  check_frame(geom.frame, who, "frame");
  check_material(geom.material, who);
  require(is_finite(geom.surface_velocity) && is_finite(geom.surface_spin), who,
          "the surface velocity is not finite");
  require(is_finite(geom.friction_direction), who, "the friction direction is not finite");
  require(geom.material.friction_across < 0 || !(geom.friction_direction == Vec3{}), who,
          "friction across a direction needs the direction; give friction_direction");
  // Errors of a shape, preceded by the geom's name.
  try {
    validate(geom.shape);
  } catch (const InputError& error) {
    throw InputError(who + ": " + error.what());
  }
  const bool dynamic = geom.body >= 0 && d.bodies[geom.body].motion == Motion::dynamic;
  require(!is_static_only(geom.shape) || !dynamic, who,
          "planes, meshes and height fields do not move; give the body convex shapes");
}

// Indices of joints and dofs form a two-level index: both must exist.
void require_dof(const ModelDescription& d, Index joint, Index dof, const std::string& who) {
  require(joint >= 0 && joint < static_cast<Index>(d.joints.size()), who, "that joint does not exist");
  require(dof >= 0 && dof < static_cast<Index>(d.joints[joint].dofs.size()), who,
          "that joint has no such degree of freedom");
}
void require_tendon(const ModelDescription& d, Index tendon, const std::string& who) {
  require(tendon >= 0 && tendon < static_cast<Index>(d.tendons.size()), who, "that tendon does not exist");
}
void require_body(const ModelDescription& d, Index body, const std::string& who) {
  AMONTONS_REQUIRE(body >= world && body < static_cast<Index>(d.bodies.size()),
                   who + ": body " + std::to_string(body) + " does not exist");
}

// A coupling relates two different coordinates, or holds one at a constant.
void check_coupling(const ModelDescription& d, const Coupling& c, const std::string& who) {
  require(c.joint_a < 0 || c.tendon_a < 0, who, "names a joint and a tendon in one place; give one of them");
  require(c.joint_b < 0 || c.tendon_b < 0, who, "names a joint and a tendon in one place; give one of them");
  c.tendon_a >= 0 ? require_tendon(d, c.tendon_a, who) : require_dof(d, c.joint_a, c.dof_a, who);
  require(c.joint_b >= -1 && c.tendon_b >= -1, who, "that joint does not exist");
  if (c.joint_b >= 0) require_dof(d, c.joint_b, c.dof_b, who);
  if (c.tendon_b >= 0) require_tendon(d, c.tendon_b, who);
  AMONTONS_REQUIRE(c.joint_b < 0 || c.joint_a != c.joint_b || c.dof_a != c.dof_b,
                   who + " couples a degree of freedom to itself");
  AMONTONS_REQUIRE(c.tendon_b < 0 || c.tendon_a != c.tendon_b, who + " couples a tendon to itself");
  require(!c.coefficients.empty(), who, "give the coefficients of the polynomial");
  for (double value : c.coefficients) require(std::isfinite(value), who, "a coefficient is not finite");
  check_not_negative(who, {{c.compliance, "compliance"}, {c.backlash, "backlash"}});
  require(c.compliance == 0 || c.backlash == 0, who, "compliance and backlash exclude each other");
}

// A path goes from point to point: obstacles are between two points, and the parts on both sides of a pulley
// have at least two points. A path that begins with a pulley uses its divisor from the start.
void check_path(const ModelDescription& d, const std::vector<PathElement>& path, const std::string& who) {
  using Kind = PathElement::Kind;
  std::size_t points = 0;
  Kind before = Kind::pulley;
  for (const PathElement& e : path) {
    const bool obstacle = e.kind == Kind::sphere || e.kind == Kind::cylinder, first = &e == &path.front();
    require(before == Kind::point || e.kind == Kind::point || (first && !obstacle), who,
            "its path has an obstacle or a pulley without a point before it; add the point");
    if (e.kind == Kind::pulley) {
      require(points > 1 || first, who, "its path has a part of a single point; give it another one");
      require(e.divisor > 0 && std::isfinite(e.divisor), who, "the divisor of a pulley must be positive");
      points = 0;
    } else {
      require_body(d, e.body, who);
      check_frame(e.frame, who, "place on the path");
    }
    if (obstacle) {
      require(e.radius > 0 && std::isfinite(e.radius), who, "the radius of an obstacle must be positive");
      require_body(d, e.side_body, who);
      require(!e.side || is_finite(*e.side), who, "a side point is not finite");
    }
    if (e.kind == Kind::point) ++points;
    before = e.kind;
  }
  require(points > 1 && before == Kind::point, who, "its path must end with a part of two points at least");
}

// A rope rubs between two parts of it: at an end, or beside a pulley that divides the path, there is only
// one.
void check_rubs(const std::vector<PathElement>& path, const std::string& who) {
  using Kind = PathElement::Kind;
  const auto divides = [&](std::size_t i) { return i >= path.size() || path[i].kind == Kind::pulley; };
  for (std::size_t i = 0; i < path.size(); ++i) {
    const PathElement& e = path[i];
    check_not_negative(who, {{e.friction, "friction"}, {e.turns, "the number of turns"}});
    const bool end = i == 0 || divides(i - 1) || divides(i + 1);
    require(e.friction == 0 || (e.kind != Kind::pulley && !(e.kind == Kind::point && end)), who,
            "friction is on a point or an obstacle between two others; take it off the ends and pulleys");
    require(e.turns == 0 || e.kind == Kind::cylinder, who, "only a cylinder takes turns");
  }
}

// A belt goes around two parallel cylinders on different bodies. Its spans are the outer tangents of both
// circles. They exist if neither circle is within the other, in the initial pose that is checked here; the
// line of centres then has a direction.
void check_belt(const ModelDescription& d, const Tendon& t, const std::string& who) {
  const auto& path = t.path;
  require(path.size() == 2 && path[0].kind == PathElement::Kind::cylinder &&
              path[1].kind == PathElement::Kind::cylinder && path[0].body != path[1].body,
          who, "a closed tendon is a belt: give it two cylinders on two bodies, and nothing else");
  for (const PathElement& e : path) {
    require_body(d, e.body, who);
    check_frame(e.frame, who, "place on the path");
    require(e.radius > 0 && std::isfinite(e.radius), who, "the radius of a pulley must be positive");
    check_not_negative(who, {{e.friction, "friction"}});
    require(e.turns == 0, who, "a belt takes no turns");
  }
  const auto placed = [&](const PathElement& e) {
    return e.body < 0 ? e.frame : d.bodies[e.body].pose * e.frame;
  };
  const Transform one = placed(path[0]), two = placed(path[1]);
  const Vec3 axis = rotate(one.rotation, {0, 0, 1}), way = two.position - one.position;
  require(norm(cross(axis, rotate(two.rotation, {0, 0, 1}))) < 1e-6, who,
          "the cylinders of a belt must be parallel; turn the frame of one of them");
  require(norm(way - dot(way, axis) * axis) > std::abs(path[0].radius - path[1].radius), who,
          "one cylinder of the belt is within the other; move them apart");
}

// A rope that rubs is an unknown tension on both sides of each place, which only its length or its own spring
// can hold. The rows of one rope share an auxiliary body of six components: a knot between each two places,
// and one for each body that is not at such a place.
void check_rope(const Tendon& t, const std::string& who) {
  std::size_t rubs = 0, others = 0;
  for (const PathElement& e : t.path) {
    if (e.friction > 0) ++rubs;
    if (e.friction == 0 && e.body >= 0) ++others;
  }
  if (rubs == 0 && !t.closed) return;
  require(t.upper < infinity || t.stiffness > 0, who,
          "a rope with friction on its path needs a largest length or a stiffness; give limits or stiffness");
  require(t.upper == infinity || t.stiffness == 0, who,
          "a rope with friction on its path has a largest length or a stiffness, not both");
  require(t.lower == -infinity && t.damping == 0 && t.friction == 0 && t.armature == 0, who,
          "a rope with friction on its path takes no lower limit, damping, armature or friction along it");
  require(rubs <= 5 && rubs + others <= 7, who,
          "a rope takes at most five places with friction, and with the moving bodies between them seven; "
          "divide it over a body in between");
}

void check_tendon(const ModelDescription& d, const Tendon& t, const std::string& who) {
  require(t.terms.empty() != t.path.empty(), who,
          "a tendon has either joints with coefficients or a path; give one of them");
  for (const TendonTerm& term : t.terms) {
    require_dof(d, term.joint, term.dof, who);
    require(std::isfinite(term.coefficient), who, "a coefficient is not finite");
  }
  require(!t.closed || !t.path.empty(), who, "a closed tendon needs a path");
  if (t.closed)
    check_belt(d, t, who);
  else if (!t.path.empty())
    check_path(d, t.path, who);
  if (!t.closed) check_rubs(t.path, who);
  check_rope(t, who);
  require(t.lower <= t.upper, who, "the lower limit exceeds the upper limit; swap them");
  require(t.lower < infinity && t.upper > -infinity, who, "the limits leave no length");
  check_not_negative(who, {{t.stiffness, "stiffness"},
                           {t.damping, "damping"},
                           {t.friction, "friction"},
                           {t.armature, "armature"}});
  require(std::isfinite(t.rest_lower) && std::isfinite(t.rest_upper) && t.rest_lower <= t.rest_upper, who,
          "the rest lengths of the spring must be finite, the lower one first");
}

// An actuator on a tendon pulls all along it, which friction on its path contradicts.
void check_pull(const ModelDescription& d, const Transmission& t, const std::string& who) {
  const Tendon& pulled = d.tendons[t.tendon];
  const bool rubs = pulled.closed || std::any_of(pulled.path.begin(), pulled.path.end(),
                                                 [](const PathElement& e) { return e.friction > 0; });
  require(!rubs, who, "the tendon has friction on its path; drive a pulley or a body at its end instead");
}

void check_transmission(const ModelDescription& d, const Transmission& t, const std::string& who) {
  using Kind = Transmission::Kind;
  require(std::isfinite(t.gear), who, "the gear is not finite");
  if (t.kind == Kind::dof) return require_dof(d, t.joint, t.dof, who);
  if (t.kind == Kind::tendon) {
    require_tendon(d, t.tendon, who);
    return check_pull(d, t, who);
  }
  require_body(d, t.body, who);
  require_body(d, t.reference_body, who);
  check_frame(t.frame, who, "frame");
  check_frame(t.reference, who, "reference frame");
  if (t.kind == Kind::wrench)
    return require(is_finite(t.force) && is_finite(t.torque), who, "force or torque is not finite");
  require(t.rod > 0 && std::isfinite(t.rod), who, "the rod of a slider-crank must have a positive length");
}

void check_actuator(const ModelDescription& d, const Actuator& a, const std::string& who) {
  check_transmission(d, a.transmission, who);
  for (const auto& law : {a.gain, a.bias})
    for (double value : law) require(std::isfinite(value), who, "a gain or bias is not finite");
  require(a.lower_force <= a.upper_force, who, "the limits of the force are in the wrong order; swap them");
  require(a.lower_force < infinity && a.upper_force > -infinity, who, "the limits leave no force");
  require(a.lower_control <= a.upper_control, who, "the limits of the control are in the wrong order");
  require(a.lower_activation <= a.upper_activation, who,
          "the limits of the activation are in the wrong order");
  require(std::isfinite(a.control) && std::isfinite(a.activation), who,
          "the initial control or activation is not finite");
  check_not_negative(who, {{a.time_constant, "the time constant"}});
}

// Pairs of geoms and bodies have no name for a message; their order is that of the description.
void check_pairs(const ModelDescription& d) {
  const Index bodies = static_cast<Index>(d.bodies.size()), geoms = static_cast<Index>(d.geoms.size());
  for (const auto& [a, b] : d.excluded_bodies)
    AMONTONS_REQUIRE(a >= world && a < bodies && b >= world && b < bodies,
                     "excluded pair: a body does not exist");
  for (const auto& [a, b] : d.excluded_geoms)
    AMONTONS_REQUIRE(a >= 0 && a < geoms && b >= 0 && b < geoms, "excluded pair: a geom does not exist");
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

void check_fluid(const ModelDescription& d) {
  check_not_negative("fluid", {{d.fluid.density, "density"}, {d.fluid.viscosity, "viscosity"}});
  AMONTONS_REQUIRE(is_finite(d.fluid.wind), "fluid: the wind is not finite");
  for (const FluidBox& box : d.fluid_boxes) {
    AMONTONS_REQUIRE(box.body >= 0 && box.body < static_cast<Index>(d.bodies.size()),
                     "fluid box: a body does not exist");
    const std::string who = "fluid box of body \"" + d.bodies[box.body].name + "\"";
    check_frame(box.frame, who, "frame");
    check_not_negative(who, {{box.size.x, "size"}, {box.size.y, "size"}, {box.size.z, "size"}});
  }
}

// Bonds have no name; their order is that of the description.
void check_bonds(const ModelDescription& d) {
  const Index bodies = static_cast<Index>(d.bodies.size());
  for (std::size_t k = 0; k < d.bonds.size(); ++k) {
    const Bond& b = d.bonds[k];
    const std::string who = "bond " + std::to_string(k);
    require(b.body_a >= world && b.body_a < bodies && b.body_b >= world && b.body_b < bodies, who,
            "a body does not exist");
    require(b.body_a != b.body_b, who, "it holds a body to itself; name two bodies");
    require(is_finite(b.point_a) && is_finite(b.point_b), who, "a point is not finite");
    require(std::abs(norm(b.normal) - 1) < 1e-6, who, "the normal is no unit vector; normalise it");
    check_not_negative(who, {{b.tension, "the tension"}, {b.opening, "the opening"}});
    require(b.tension > 0 && b.opening > 0, who, "the tension and the opening must be positive");
  }
}

}  // namespace

// In the order in which a user writes a model, so that the first message concerns the first cause.
void check(const ModelDescription& d) {
  AMONTONS_REQUIRE(is_finite(d.gravity), "gravity is not finite");
  check_names(d.bodies, "body");
  check_names(d.geoms, "geom");
  check_names(d.joints, "joint");
  check_names(d.tendons, "tendon");
  check_names(d.actuators, "actuator");
  for (std::size_t i = 0; i < d.bodies.size(); ++i)
    check_body(d.bodies[i], label("body", d.bodies[i].name, i));
  for (std::size_t g = 0; g < d.geoms.size(); ++g)
    check_geom(d, d.geoms[g], label("geom", d.geoms[g].name, g));
  for (std::size_t j = 0; j < d.joints.size(); ++j)
    check_joint(d.joints[j], label("joint", d.joints[j].name, j), static_cast<Index>(d.bodies.size()));
  for (std::size_t k = 0; k < d.tendons.size(); ++k)
    check_tendon(d, d.tendons[k], label("tendon", d.tendons[k].name, k));
  for (std::size_t k = 0; k < d.actuators.size(); ++k)
    check_actuator(d, d.actuators[k], label("actuator", d.actuators[k].name, k));
  for (std::size_t k = 0; k < d.couplings.size(); ++k)
    check_coupling(d, d.couplings[k], label("coupling", d.couplings[k].name, k));
  check_pairs(d);
  check_fluid(d);
  check_bonds(d);
}

}  // namespace amontons
