#include "amontons.hpp"
#include "check.hpp"

// The builder against models put together by hand, and the questions that take names.
using namespace amontons;

namespace {

NewBody brick(const Vec3& position) {
  return {.position = position, .shape = Box{{0.1, 0.2, 0.3}}, .density = 500};
}

// Two bodies, turned and far from the origin.
ModelBuilder two_bodies() {
  ModelBuilder builder;
  builder.add_body(
      "a",
      {.position = {5, 1, 2}, .orientation = normalised({1, 2, 3, 4}), .shape = Sphere{0.5}, .density = 100});
  builder.add_body(
      "b",
      {.position = {4, 0, 2}, .orientation = normalised({4, -3, 2, 1}), .shape = Sphere{0.5}, .mass = 3});
  return builder;
}

// How far the two frames of a joint are apart at the initial poses: m, and the angle (rad).
Vec3 joint_gap(const ModelDescription& d, const Joint& joint) {
  const auto pose = [&](Index body) { return body == world ? Transform{} : d.bodies[body].pose; };
  const Transform a = pose(joint.body_a) * joint.frame_a, b = pose(joint.body_b) * joint.frame_b;
  return {norm(a.position - b.position), norm(logarithm(conjugate(b.rotation) * a.rotation)), 0};
}

}  // namespace

// Fails if density, mass and inertia are mixed up: the box of 48 litres at 500 kg/m^3 weighs 24 kg, by mass
// it has the same inertia, and what is given by itself stays.
TEST(bodies_take_mass_from_their_shape) {
  ModelBuilder builder;
  const Index by_density = builder.add_body("one", brick({}));
  const Index by_mass = builder.add_body("two", {.shape = Box{{0.1, 0.2, 0.3}}, .mass = 48});
  const Index by_hand = builder.add_body("three", {.mass = 2, .inertia = Mat3::diagonal(1, 2, 2.5)});
  const double m = 24, xx = m / 3 * (0.04 + 0.09);
  CHECK_NEAR(builder.body(by_density).mass, m, 1e-14);
  CHECK_NEAR(builder.body("one").inertia(0, 0), xx, 1e-14);
  CHECK(builder.body(by_mass).mass == 48);
  CHECK_NEAR(builder.body(by_mass).inertia(0, 0), 2 * xx, 1e-14);
  CHECK(builder.body(by_hand).inertia(1, 1) == 2);
  const Model model = builder.build();
  CHECK(model.body_index("three") == by_hand && model.geom(0).body == by_density);
  CHECK_NEAR(model.total_mass(), 74, 1e-13);
}

// Fails if a geom with a density is added at the wrong place of the body: a dumb-bell of two balls of mass m
// at 1 m has m 1^2 each beside its own inertia, and its centre in the middle.
TEST(geoms_with_density_add_mass) {
  ModelBuilder builder;
  const Index body = builder.add_body("bell", {});
  for (double x : {0.5, 2.5}) builder.add_geom("bell", Sphere{0.1}, {.position = {x, 0, 0}, .density = 1000});
  const MassProperties ball = mass_properties(Sphere{0.1}, 1000);
  CHECK_NEAR(builder.body(body).mass, 2 * ball.mass, 1e-14);
  CHECK_NEAR(builder.body(body).centre_of_mass.x, 1.5, 1e-15);
  CHECK_NEAR(builder.body(body).inertia(1, 1), 2 * (ball.inertia(1, 1) + ball.mass), 1e-14);
}

// Fails if the frames of a joint do not meet at the point, its axis is not that of the world, or a joint gets
// degrees of freedom of another kind or order.
TEST(joints_from_points_and_axes) {
  using Kind = Dof::Kind;
  const Vec3 point{4.5, 0.3, 1.7}, axis{0.3, -2, 0.5}, axis_2{1, 0.1, 0};
  const NewJoint given{.point = point, .axis = axis, .axis_2 = axis_2};
  struct Case {
    Index (ModelBuilder::*add)(Reference, Reference, const NewJoint&);
    std::vector<Kind> kinds;
    bool spherical = false;
    std::size_t along = 0;  // the dof that goes along the axis
  };
  const Case cases[] = {{&ModelBuilder::add_ball_joint, {}, true},
                        {&ModelBuilder::add_revolute_joint, {Kind::hinge}},
                        {&ModelBuilder::add_prismatic_joint, {Kind::slide}},
                        {&ModelBuilder::add_cylindrical_joint, {Kind::slide, Kind::hinge}},
                        {&ModelBuilder::add_universal_joint, {Kind::hinge, Kind::hinge}},
                        {&ModelBuilder::add_planar_joint, {Kind::slide, Kind::slide, Kind::hinge}, false, 2},
                        {&ModelBuilder::add_fixed_joint, {}},
                        {&ModelBuilder::add_point_on_line_joint, {Kind::slide}, true}};
  for (const Case& c : cases)
    for (const char* other : {"b", "world"}) {
      ModelBuilder builder = two_bodies();
      const Joint& joint = builder.joint((builder.*c.add)("a", other, given));
      const ModelDescription& d = builder.description();
      CHECK_NEAR(norm(joint_gap(d, joint)), 0, 1e-14);
      const Transform pose_b = joint.body_b == world ? Transform{} : d.bodies[joint.body_b].pose;
      const Transform frame = pose_b * joint.frame_b;
      CHECK_NEAR(norm(frame.position - point), 0, 1e-14);
      CHECK(joint.spherical == c.spherical && joint.dofs.size() == c.kinds.size());
      for (std::size_t k = 0; k < joint.dofs.size(); ++k) CHECK(joint.dofs[k].kind == c.kinds[k]);
      if (!joint.dofs.empty())
        CHECK_NEAR(norm(rotate(frame.rotation, joint.dofs[c.along].axis) - normalised(axis)), 0, 1e-14);
      if (c.add == &ModelBuilder::add_universal_joint)
        CHECK_NEAR(norm(rotate(frame.rotation, joint.dofs[1].axis) - normalised(axis_2)), 0, 1e-14);
      builder.build();
    }
}

// Fails if options do not reach the degrees of freedom that they are for.
TEST(joints_take_options) {
  ModelBuilder builder = two_bodies();
  const Vec3 point{4.5, 0, 2}, axis{1, 0, 0};
  builder.add_cylindrical_joint(
      "a", "b", {.name = "both", .point = point, .axis = axis, .dof = {.lower = -1, .damping = 2}});
  builder.add_cylindrical_joint("a", "world",
                                {.name = "each",
                                 .point = point,
                                 .axis = axis,
                                 .dofs = {{.stiffness = 5}, {.friction = 7}},
                                 .compliance = 1e-6,
                                 .collide = true});
  builder.add_ball_joint("b", "world", {.name = "ball", .point = point, .dof = {.upper = 0.4, .damping = 3}});
  const auto& both = builder.joint("both").dofs;
  CHECK(both[0].lower == -1 && both[1].lower == -1 && both[1].damping == 2);
  const Joint& each = builder.joint("each");
  CHECK(each.dofs[0].stiffness == 5 && each.dofs[1].stiffness == 0 && each.dofs[1].friction == 7);
  CHECK(each.compliance == 1e-6 && each.collide);
  CHECK(builder.joint("ball").ball_limit == 0.4 && builder.joint("ball").ball_damping == 3);
  const Index rod = builder.add_distance_joint("a", "b", {.point_a = {5, 1, 2}, .point_b = {4, 0, 2}});
  CHECK_NEAR(builder.joint(rod).lower_distance, std::sqrt(2.0), 1e-15);
  const Index rope = builder.add_distance_joint("a", "b", {.point_a = {5, 1, 2}, .upper = 3});
  CHECK(builder.joint(rope).lower_distance == 0 && builder.joint(rope).upper_distance == 3);
  const Model model = builder.build();
  CHECK(model.dof_index("each", 1) == 3);
}

// Fails if a wrong call is taken, leaves something behind, or does not name what is wrong.
TEST(builder_refuses) {
  ModelBuilder builder = two_bodies();
  const Vec3 point{1, 2, 3}, axis{0, 0, 1};
  CHECK_THROWS(builder.add_body("world"), "name of the world");
  CHECK_THROWS(builder.add_body("c", {.shape = Sphere{1}, .density = 1, .mass = 1}), "both given");
  CHECK_THROWS(builder.add_body("c", {.density = 1}), "without a shape");
  CHECK_THROWS(builder.add_body("c", {.mass = 1}), "without a shape or inertia");
  CHECK_THROWS(builder.add_body("c", {.inertia = Mat3::identity()}), "without mass");
  CHECK_THROWS(builder.add_body("c", {.shape = Plane{}}), "do not move");
  CHECK_THROWS(builder.add_body("c", {.shape = Sphere{-1}, .density = 1}), "radius");
  CHECK_THROWS(builder.add_geom("c", Sphere{1}), "no body \"c\"; known are a, b");
  CHECK_THROWS(builder.add_revolute_joint("a", "b", {.name = "pin", .axis = axis}),
               "joint \"pin\": point is not given");
  CHECK_THROWS(builder.add_revolute_joint("a", "b", {.point = point}), "axis is zero");
  CHECK_THROWS(builder.add_revolute_joint("a", "a", {.point = point, .axis = axis}), "two bodies");
  CHECK_THROWS(builder.add_revolute_joint("world", "a", {.point = point, .axis = axis}), "swap");
  CHECK_THROWS(builder.add_fixed_joint(7, "a"), "no body 7; the model has 2");
  CHECK_THROWS(builder.add_universal_joint("a", "b", {.point = point, .axis = axis, .axis_2 = axis}),
               "parallel");
  CHECK_THROWS(builder.add_planar_joint("a", "b", {.axis = axis, .dofs = {{}, {}}}), "3 degrees");
  CHECK_THROWS(builder.add_distance_joint("a", "b", {.length = 1.0, .upper = 2.0}), "keep one");
  CHECK_THROWS(builder.exclude("a", "a"), "itself");
  CHECK(builder.description().joints.empty() && builder.description().bodies.size() == 2);
  CHECK(builder.description().geoms.size() == 2);
  builder.add_body("c");
  CHECK_THROWS(builder.build(), "body \"c\": the mass is 0");
}

// Fails if a name does not find its part, or a message does not list what there is.
TEST(names_find_parts) {
  ModelBuilder builder = two_bodies();
  builder.add_floor();
  builder.add_revolute_joint("a", "b", {.name = "pin", .point = Vec3{4.5, 0, 2}, .axis = {0, 0, 1}});
  const Model model = builder.build();
  CHECK(model.body_index("b") == 1 && model.geom_index("floor") == 2 && model.joint_index("pin") == 0);
  CHECK(model.dof_index("pin") == 0 && model.body_index(1) == 1);
  CHECK_THROWS(model.body_index("c"), "there is no body \"c\"; known are a, b");
  CHECK_THROWS(model.joint_index(3), "there is no joint 3; the model has 1, from 0");
  CHECK_THROWS(model.actuator_index("x"), "the model has none");
  CHECK_THROWS(model.dof_index("pin", 1), "joint \"pin\" has 1 degrees of freedom; dof = 1");
}

// Fails if a ray forgets to scale its direction, hits what it should pass, or names another geom.
TEST(simulation_casts_rays) {
  ModelBuilder builder;
  builder.add_floor();
  builder.add_body("box", brick({0, 0, 2}));
  const Simulation simulation(builder.build());
  const GeomHit down = simulation.ray({0, 0, 5}, {0, 0, -10});
  CHECK(down.geom == simulation.model().geom_index(1) && down.hit.normal == Vec3(0, 0, 1));
  CHECK_NEAR(down.hit.distance, 2.7, 1e-15);
  const GeomHit through = simulation.ray({0, 0, 5}, {0, 0, -1}, {"box"});
  CHECK(through.geom == simulation.model().geom_index("floor"));
  CHECK_NEAR(through.hit.distance, 5, 1e-15);
  CHECK(simulation.ray({0, 0, 5}, {0, 0, -1}, {"box", "world"}).geom == -1);
  CHECK_THROWS(simulation.ray({}, {}), "direction");
  CHECK_THROWS(simulation.ray({}, {0, 0, 1}, {"nobody"}), "known are box");
}

// Fails if contacts are not those of the body, or a force has the sign of the other side: of two bricks on
// the floor the lower one carries both, and the forces on each balance its weight.
TEST(contacts_by_body) {
  ModelBuilder builder;
  builder.add_floor();
  builder.add_body("low", brick({0, 0, 0.3}));
  builder.add_body("high", brick({0, 0, 0.9}));
  Simulation simulation(builder.build(), {.dt = 2e-3});
  for (int k = 0; k < 20; ++k) simulation.step();
  const double weight = 24 * 9.81;
  for (const char* name : {"low", "high"})
    CHECK_NEAR(simulation.contact_force(name).z, weight, 1e-4 * weight);
  CHECK_NEAR(simulation.contact_force("world").z, -2 * weight, 1e-4 * weight);
  const Index low = simulation.model().body_index("low"), high = simulation.model().body_index("high");
  CHECK(simulation.contacts_of("low").size() == 8 && simulation.contacts_of("high").size() == 4);
  double held = 0;
  for (const Contact& c : simulation.contacts_between("high", "low")) {
    CHECK(c.body_a == high && c.body_b == low && c.normal.z > 0.99);
    held += c.impulse.z / 2e-3;
  }
  CHECK_NEAR(held, weight, 1e-4 * weight);
  for (const Contact& c : simulation.contacts_between("low", "high")) CHECK(c.normal.z < -0.99);
  CHECK_THROWS(simulation.contact_force("nobody"), "known are low, high");
}

// Fails if an event is missed, told twice or told late: a ball that falls onto the floor and bounces touches
// it in one step at a time, of which the impact is all; at rest nothing begins or ends.
TEST(contact_events_of_a_bounce) {
  ModelBuilder builder;
  const Material rubber{.restitution = 0.5};
  builder.add_floor(0, rubber);
  builder.add_body("ball",
                   {.position = {0, 0, 0.6}, .shape = Sphere{0.1}, .density = 1000, .material = rubber});
  Simulation simulation(builder.build(), {.dt = 2e-3});
  int began = 0, ended = 0;
  bool touching = false;
  for (int k = 0; k < 1000; ++k) {
    simulation.step();
    const ContactEvents events = simulation.contact_events();
    CHECK(events.began.size() + events.ended.size() <= 1);
    if (!events.began.empty()) {
      CHECK(!touching && simulation.contact_force("ball").z > 0);
      CHECK(events.began[0] == GeomPair(0, world, 1, 0) || events.began[0] == GeomPair(world, 0, 0, 1));
      touching = true, ++began;
    }
    if (!events.ended.empty()) {
      CHECK(touching && simulation.contact_force("ball").z == 0);
      touching = false, ++ended;
    }
    if (k > 900) CHECK(events.began.empty() && events.ended.empty());
  }
  // Falls of 0.5 m, 0.125 m, ... last until the speed is below the threshold of bounces, 4 g dt = 0.08 m/s:
  // 3.13 m/s / 2^n is below it at n = 6.
  CHECK(touching && began >= 5 && began == ended + 1);
  Simulation copy(simulation);
  copy.step();
  CHECK(copy.contact_events().began.empty());
  copy.reset();
  copy.step();
  CHECK(copy.contact_events().began.empty() && copy.contact_events().ended.empty());
}

// Fails if a control is another drive's, its name is given twice, or an instant is not the start of the step:
// a slider of 2 kg that a motor pushes by 3 N and a held force by 1 N, beside an actuator of the same name.
TEST(controls_and_instant) {
  ModelBuilder builder;
  builder.description().gravity = {};
  builder.add_body("slider", {.shape = Sphere{0.1}, .mass = 2});
  builder.add_prismatic_joint(
      "slider", "world", {.name = "rail", .axis = {1, 0, 0}, .dof = {.motor = {.kind = MotorKind::effort}}});
  Actuator idle;
  idle.name = "rail";
  idle.transmission.joint = 0;
  builder.description().actuators.push_back(idle);
  Simulation simulation(builder.build(), {.dt = 1e-2});
  const Model& model = simulation.model();
  CHECK(model.controls().size() == 2 && model.control_index("rail") == 0);
  CHECK(model.control_index("rail motor") == 1 && model.control_of_dof(0) == 1);
  CHECK_THROWS(model.control_index("hinge"), "there is no control \"hinge\"; known are rail, rail motor");
  CHECK_THROWS(simulation.instant(), "there was no step yet");
  simulation.state().controls[1] = 3;
  simulation.state().joint_forces[0] = 1;
  simulation.step();
  simulation.step();
  CHECK_NEAR(simulation.state().linear_velocities[0].x, 2 * 1e-2 * 4 / 2, 1e-12);
  CHECK_NEAR(simulation.instant().time, 1e-2, 1e-15);
  CHECK_NEAR(simulation.instant().q[0], 1e-2 * 1e-2 * 2 / 2, 1e-12);
  const Simulation copy(simulation);
  CHECK(copy.instant().q == simulation.instant().q);
  builder.joint("rail").dofs[0].motor = {MotorKind::velocity, 0, infinity, 5, 0};
  CHECK_THROWS(builder.build(), "a velocity motor takes kd");
}

// Fails if the freedoms of a joint with clearance are in another order, another one takes the motor, or the
// frame of a slider is not along its axis: a journal about z, and a slider along x that tilts about y.
TEST(joints_with_clearance) {
  ModelBuilder builder;
  for (const char* name : {"a", "b"}) builder.add_body(name, {.mass = 1, .inertia = Mat3::identity()});
  const Dof motor{.motor = {.kind = MotorKind::velocity}};
  builder.add_revolute_joint(
      "a", "world", {.name = "pin", .point = Vec3{}, .axis = {0, 0, 2}, .dof = motor, .clearance = 1e-3});
  builder.add_prismatic_joint("b", "world",
                              {.name = "rail",
                               .axis = {3, 0, 0},
                               .dof = motor,
                               .clearance = 1e-3,
                               .guide_length = 0.1,
                               .guide_normal = {0, 1, 0}});
  const auto kind = [&](const char* joint, int k) { return builder.joint(joint).dofs[k].motor.kind; };
  for (const char* joint : {"pin", "rail"}) {
    const std::vector<Dof>& dofs = builder.joint(joint).dofs;
    CHECK(dofs.size() == 3 && dofs[0].kind == Dof::Kind::slide && dofs[2].kind == Dof::Kind::hinge);
  }
  CHECK(kind("pin", 2) == MotorKind::velocity && kind("pin", 0) == MotorKind::none);
  CHECK(kind("rail", 0) == MotorKind::velocity && kind("rail", 2) == MotorKind::none);
  const Quat rail = builder.joint("rail").frame_b.rotation;
  CHECK_NEAR(norm(rotate(rail, {1, 0, 0}) - Vec3{1, 0, 0}), 0, 1e-15);
  CHECK_NEAR(norm(rotate(rail, {0, 0, 1}) - Vec3{0, 1, 0}), 0, 1e-15);
  CHECK(builder.build().joint(1).guide_length == 0.1);
  CHECK_THROWS(
      builder.add_revolute_joint("a", "b", {.point = Vec3{}, .axis = {0, 0, 1}, .clearance_friction = 0.1}),
      "clearance_friction without clearance");
  CHECK_THROWS(builder.add_planar_joint("a", "b", {.axis = {0, 0, 1}, .clearance = 0.1}),
               "clearance is for revolute");
}
