// Springs, motors, friction, limits, balls, rods and couplings: one step against its closed form.
#include <numbers>

#include "check.hpp"
#include "joint_scene.hpp"

using namespace joint_scene;

namespace {

constexpr double pi = std::numbers::pi;

// A unit body on a hinge or slide through its centre along z of the world, coordinate q, rate w.
Scene one_dof(const Dof& dof, double q, double w) {
  Scene scene;
  const Joint joint = joint_of(0, world, {dof});
  Body body = unit_body(product_of_exponentials(joint, {q}));
  (dof.kind == Dof::Kind::hinge ? body.angular_velocity : body.linear_velocity) = w * dof.axis;
  scene.description.bodies = {body};
  scene.description.joints = {joint};
  scene.build();
  return scene;
}

// The rate of the dof after one step.
double rate_after(Scene& scene) {
  const bool slides = scene.model->joint(0).dofs[0].kind == Dof::Kind::slide;
  const auto v = scene.velocities_after(scene.solve());
  return slides ? v[0].linear.z : v[0].angular.z;
}

const Dof kinds[] = {hinge({0, 0, 1}), slide({0, 0, 1})};

}  // namespace

// Fails if the merged row of spring, damper and armature is not the midpoint step
//   (1 + a) (w+ - w) = -h k (q + h (w+ - w) / 4 - rest) - h d (w+ + w) / 2,  mass and inertia 1,
// which the step resolves (h w < 1), or if hinges and slides differ in scale.
TEST(drive_is_an_implicit_step) {
  for (Dof dof : kinds) {
    dof.stiffness = 300, dof.rest = 0.2, dof.damping = 7, dof.armature = 0.5;
    const double q = 0.6, w = 3, h = 0.02;
    Scene scene = one_dof(dof, q, w);
    scene.options.h = scene.options.kick = h;
    scene.refresh();
    CHECK(scene.count(RowKind::passive) == 1);
    const double spring = h * h * 300 / 4, damper = h * 7 / 2;
    const double expected = ((1.5 + spring - damper) * w - h * 300 * (q - 0.2)) / (1.5 + spring + damper);
    CHECK_NEAR(rate_after(scene), expected, 1e-12);
    CHECK_NEAR(spring_energy(*scene.model, scene.bodies, scene.state), 0.5 * 300 * 0.4 * 0.4, 1e-11);
    store_joint_impulses(scene.rows, scene.solve(), scene.state);
    CHECK_NEAR(scene.state.dof_impulses[0].passive, expected - w, 1e-12);
  }
}

// Fails if the row of an unused dof appears: a bare hinge has its five locked rows only.
TEST(bare_dofs_have_no_rows) {
  Scene scene = one_dof(hinge({0, 0, 1}), 0.3, 1);
  CHECK(scene.rows.jacobian.size() == 5);
}

// Fails if a motor does not do what Motor says: effort, velocity with and without kd, position with and
// without, each with an effort that suffices and one that does not.
TEST(motors_keep_their_word) {
  const double q = 0.4, w = 1.5, h = 0.01;
  const auto after = [&](Dof dof, Motor motor) {
    dof.motor = motor;
    Scene scene = one_dof(dof, q, w);
    const double rate = rate_after(scene);
    store_joint_impulses(scene.rows, scene.solve(), scene.state);
    CHECK_NEAR(scene.state.dof_impulses[0].motor, rate - w, 1e-12);
    return rate;
  };
  for (const Dof& dof : kinds) {
    CHECK_NEAR(after(dof, {MotorKind::effort, 20, infinity, 0, 0}), w + h * 20, 1e-13);
    CHECK_NEAR(after(dof, {MotorKind::effort, -20, 5, 0, 0}), w - h * 5, 1e-13);
    CHECK_NEAR(after(dof, {MotorKind::velocity, 4, infinity, 0, 0}), 4, 1e-12);
    CHECK_NEAR(after(dof, {MotorKind::velocity, 4, 30, 0, 0}), w + h * 30, 1e-12);
    CHECK_NEAR(after(dof, {MotorKind::velocity, 4, infinity, 0, 50}),
               (w + h * 50 * (4 - w / 2)) / (1 + h * 50 / 2), 1e-12);
    CHECK_NEAR(after(dof, {MotorKind::position, 0.5, infinity, 0, 0}), (0.5 - q) / h, 1e-11);
    // No faster than half the effort can stop in the way of 0.1 that is left: v h + v^2 / 30 = 0.1.
    CHECK_NEAR(after(dof, {MotorKind::position, 0.5, 30, 0, 0}), 15 * (std::sqrt(h * h + 0.4 / 30) - h),
               1e-12);
    CHECK_NEAR(after(dof, {MotorKind::position, 5, 30, 0, 0}), w + h * 30, 1e-12);
    const double spring = h * h * 200 / 4, damper = h * 3 / 2;  // by the midpoint rule, as those of a joint
    CHECK_NEAR(after(dof, {MotorKind::position, 0.5, infinity, 200, 3}),
               ((1 + spring - damper) * w + h * 200 * (0.5 - q)) / (1 + spring + damper), 1e-12);
    // A target that jumps: a quarter turn or a length (1 m, there are no shapes) per step.
    const double largest = dof.kind == Dof::Kind::hinge ? pi / 2 : 1;
    CHECK_NEAR(after(dof, {MotorKind::position, 50, infinity, 0, 0}), largest / h, 1e-9);
  }
}

// Fails if the loads of effort motors act on one body only, at different points, or on bodies that are held.
TEST(effort_acts_and_reacts) {
  Random random;
  Scene scene;
  Joint joint = joint_of(0, 1, {slide({0, 1, 0}), hinge({1, 0, 1}, {0.3, 0.2, 0})});
  joint.dofs[0].motor = {MotorKind::effort, 3, infinity, 0, 0};
  joint.dofs[1].motor = {MotorKind::effort, -2, infinity, 0, 0};
  joint.frame_a = random.transform(), joint.frame_b = random.transform();
  const Transform pose = random.transform();
  scene.description.bodies = {odd_body(random, pose * joint.frame_b * inverse(joint.frame_a)),
                              odd_body(random, pose)};
  scene.description.joints = {joint};
  scene.build();
  std::vector<BodyImpulse> loads(2);
  add_motor_loads(*scene.model, scene.joints, scene.state.controls, 0.5, loads);
  CHECK_NEAR(norm(loads[0].force), 1.5, 1e-12);
  CHECK_NEAR(norm(loads[0].force + loads[1].force), 0, 1e-14);
  Vec3 moment;  // about the world's origin
  for (int i = 0; i < 2; ++i) moment += loads[i].torque + cross(scene.bodies[i].centre, loads[i].force);
  CHECK_NEAR(norm(moment), 0, 1e-14);
  scene.description.bodies[1].motion = Motion::kinematic;
  scene.build();
  loads.assign(2, {});
  add_motor_loads(*scene.model, scene.joints, scene.state.controls, 0.5, loads);
  CHECK(norm(loads[0].force) > 1 && loads[1].force == Vec3{} && loads[1].torque == Vec3{});
}

// Fails if dry friction does not stop what it can, or pushes: F h = 0.05.
TEST(dry_friction_stops_or_slows) {
  for (Dof dof : kinds) {
    dof.friction = 5;
    for (const double w : {0.03, -0.04, 2.0, -3.0}) {
      Scene scene = one_dof(dof, 0.1, w);
      const double expected = std::abs(w) < 0.05 ? 0 : w - std::copysign(0.05, w);
      CHECK_NEAR(rate_after(scene), expected, 1e-13);
    }
  }
}

// Fails if limits are missed, push the wrong way, pull, or throw what has passed them faster than
// recovery_speed.
TEST(limits_hold) {
  for (Dof dof : kinds) {
    dof.lower = -0.5, dof.upper = 1;
    const double h = 0.01;
    const auto after = [&](double q, double w) {
      Scene scene = one_dof(dof, q, w);
      scene.options.recovery_speed = 0.7;
      scene.refresh();
      return rate_after(scene);
    };
    CHECK_NEAR(after(0.99, 5), 0.01 / h, 1e-12);  // arrives exactly
    CHECK_NEAR(after(-0.48, -5), -0.02 / h, 1e-12);
    CHECK_NEAR(after(0.99, -5), -5, 1e-13);    // leaves unhindered
    CHECK_NEAR(after(0.99, 0.5), 0.5, 1e-13);  // does not arrive yet
    CHECK_NEAR(after(1.2, 0), -0.7, 1e-12);    // comes back no faster than recovery_speed
    CHECK_NEAR(after(1.001, 0), -0.1, 1e-11);
    CHECK_NEAR(after(-0.9, 0), 0.7, 1e-12);
    Scene far = one_dof(dof, 0.2, 1);
    CHECK(far.count(RowKind::limit) == 0);
    Scene fast = one_dof(dof, 0.2, 100);  // within reach by its speed
    CHECK(fast.count(RowKind::limit) == 2);
    dof.motor = {MotorKind::velocity, 100, infinity, 0, 0};
    Scene driven = one_dof(dof, 0.2, 0);
    CHECK(driven.count(RowKind::limit) == 2);
    dof.motor = {};
    Scene pushed = one_dof(dof, 0.99, 5);
    store_joint_impulses(pushed.rows, pushed.solve(), pushed.state);
    CHECK_NEAR(pushed.state.dof_impulses[0].limit, -4, 1e-12);
  }
}

// Fails if equal limits do not hold a dof like a locked direction.
TEST(equal_limits_lock) {
  for (Dof dof : kinds) {
    dof.lower = dof.upper = 0.2;
    Scene scene = one_dof(dof, 0.21, 5);
    CHECK(scene.rows.cones.all_bilateral() && scene.rows.jacobian.size() == 6);
    CHECK_NEAR(rate_after(scene), -1, 1e-6);  // the regularisation gives way by 1e-7
  }
}

// Fails if a compliant joint is not the spring it says: an implicit step of a unit mass on a slide whose two
// locked forces have compliance 1e-3 m/N, (1 + h^2 k) v+ = v - h k y; and its rotation 1e-3 / length^2.
TEST(compliance_is_a_spring) {
  Scene scene;
  Joint joint = joint_of(0, world, {slide({0, 0, 1})});
  joint.compliance = 1e-3;
  Geom geom;
  geom.body = 0, geom.shape = Sphere{0.5};
  scene.description.geoms = {geom};
  scene.description.bodies = {unit_body()};
  scene.description.joints = {joint};
  scene.build();
  CHECK_NEAR(scene.options.length, 0.5, 0);
  scene.options.recovery_speed = 1e-6;  // does not cut off a spring
  const double y = 0.3, v = -0.4, h = scene.options.h, k = 1e3;
  scene.state.positions[0] = {0, y, 0.7};
  scene.state.linear_velocities[0] = {0, v, 0};
  scene.refresh();
  const auto after = scene.velocities_after(scene.solve());
  CHECK_NEAR(after[0].linear.y, (v - h * k * y) / (1 + h * h * k), 1e-12);
  CHECK_NEAR(spring_energy(*scene.model, scene.bodies, scene.state), 0.5 * k * y * y, 1e-11);
  CHECK_NEAR(joint_error(*scene.model, scene.bodies, scene.state).distance, 0, 0);
  scene.state = initial_state(*scene.model);
  scene.state.orientations[0] = exponential({0.1, 0, 0});
  scene.refresh();
  const double kr = k * 0.25;
  CHECK_NEAR(scene.velocities_after(scene.solve())[0].angular.x, -h * kr * 0.1 / (1 + h * h * kr), 1e-12);
  CHECK_NEAR(spring_energy(*scene.model, scene.bodies, scene.state), 0.5 * kr * 0.01, 1e-11);
}

namespace {

Scene ball_scene(Joint joint, const Vec3& rotation, const Vec3& omega) {
  Scene scene;
  joint.body_a = 0, joint.body_b = world, joint.spherical = true;
  joint.frame_b.rotation = exponential({0.3, -0.2, 0.5});
  Body body = unit_body({{}, joint.frame_b.rotation * exponential(rotation)});
  body.angular_velocity = rotate(joint.frame_b.rotation, omega);
  scene.description.bodies = {body};
  scene.description.joints = {joint};
  scene.build();
  scene.options.recovery_speed = 0.7;
  scene.refresh();
  return scene;
}
Vec3 spin_after(Scene& scene) {
  return rotate(conjugate(scene.model->joint(0).frame_b.rotation),
                scene.velocities_after(scene.solve())[0].angular);
}

}  // namespace

// Fails if the spring, damper, friction or limit of a ball joint acts along other axes than its rotation.
TEST(ball_joints_turn_back) {
  const double h = 0.01;
  Joint joint;
  joint.ball_stiffness = 50, joint.ball_damping = 2;
  const Vec3 r{0.4, -0.3, 0.2}, w{1, 2, -1};
  Scene spring = ball_scene(joint, r, w);
  const double stiff = h * h * 50 / 4;  // by the midpoint rule
  const Vec3 expected = ((1 + stiff - h) * w - h * 50 * r) / (1 + stiff + h);
  CHECK_NEAR(norm(spin_after(spring) - expected), 0, 1e-12);
  CHECK_NEAR(spring_energy(*spring.model, spring.bodies, spring.state), 25 * norm_squared(r), 1e-12);
  store_joint_impulses(spring.rows, spring.solve(), spring.state);
  CHECK_NEAR(norm(spring.state.ball_impulses[0] - (expected - w)), 0, 1e-12);

  joint = {};
  joint.ball_friction = 5;
  Scene slow = ball_scene(joint, r, {0.03, -0.04, 0.01}), fast = ball_scene(joint, r, {0, 0, 2});
  CHECK_NEAR(norm(spin_after(slow)), 0, 1e-14);
  CHECK_NEAR(norm(spin_after(fast) - Vec3{0, 0, 1.95}), 0, 1e-14);

  joint = {};
  joint.ball_limit = 0.5;
  const Vec3 axis = normalised(Vec3{1, -2, 2}), side = normalised(Vec3{2, 2, 1});
  Scene beyond = ball_scene(joint, 0.9 * axis, {});
  CHECK_NEAR(norm(spin_after(beyond) + 0.7 * axis), 0, 1e-12);
  Scene arriving = ball_scene(joint, 0.48 * axis, 5 * axis + 3 * side);
  CHECK_NEAR(norm(spin_after(arriving) - (2 * axis + 3 * side)), 0, 1e-12);
  store_joint_impulses(arriving.rows, arriving.solve(), arriving.state);
  CHECK_NEAR(norm(arriving.state.joint_wrenches[0].torque + 3 * axis), 0, 1e-12);
  Scene within = ball_scene(joint, 0.1 * axis, {});
  CHECK(within.count(RowKind::limit) == 0);
}

// Breaks when a ball joint at rest does not start the next step with its impulses. The state has one sum for
// spring, damper and friction: friction from zero made a puzzle cube at rest solve every step anew.
TEST(a_ball_joint_at_rest_starts_with_its_friction) {
  Joint joint;
  joint.ball_stiffness = 50, joint.ball_damping = 2, joint.ball_friction = 40;
  Scene held = ball_scene(joint, {0.4, -0.3, 0.2}, {});
  const std::vector<double> x = held.solve();
  CHECK_NEAR(norm(spin_after(held)), 0, 1e-12);
  store_joint_impulses(held.rows, x, held.state);
  held.refresh();
  for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(held.rows.x0[i], x[i], 1e-12);
}

namespace {

Scene rod_scene(double lower, double upper, const Vec3& at, const Vec3& velocity) {
  Scene scene;
  Joint joint = joint_of(0, world, {});
  joint.kind = JointKind::distance;
  joint.lower_distance = lower, joint.upper_distance = upper;
  Body body = unit_body({at, {}});
  body.linear_velocity = velocity;
  scene.description.bodies = {body};
  scene.description.joints = {joint};
  scene.build();
  scene.options.recovery_speed = 0.7;
  scene.refresh();
  return scene;
}

}  // namespace

// Fails if a rod or rope pushes along anything but its line, or acts where it is slack.
TEST(distance_joints_hold_their_length) {
  const Vec3 n = normalised(Vec3{1, 2, -2}), t = normalised(Vec3{2, 1, 2});
  const auto after = [](const Scene& scene) { return scene.velocities_after(scene.solve())[0].linear; };
  Scene rod = rod_scene(2, 2, 2.0 * n, 3 * n + t);
  CHECK(rod.count(RowKind::locked) == 1);  // takes part in impacts like any locked row
  CHECK_NEAR(norm(after(rod) - t), 0, 1e-6);
  CHECK_NEAR(norm(after(rod_scene(2, 2, 2.001 * n, t)) - (t - 0.1 * n)), 0, 1e-7);
  CHECK_NEAR(norm(after(rod_scene(2, 2, 5.0 * n, t)) - (t - 0.7 * n)), 0, 1e-7);
  CHECK(rod_scene(0, 2, 1.0 * n, t).rows.jacobian.empty());
  CHECK_NEAR(norm(after(rod_scene(0, 2, 1.99 * n, 3 * n + t)) - (n + t)), 0, 1e-12);
  CHECK_NEAR(norm(after(rod_scene(0, 2, 1.99 * n, -3 * n)) + 3 * n), 0, 1e-12);
  CHECK_NEAR(norm(after(rod_scene(1, 2, 1.01 * n, -3 * n + t)) - (t - 1 * n)), 0, 1e-12);
  Scene rope = rod_scene(0, 2, 2.0 * n, 3 * n);
  store_joint_impulses(rope.rows, rope.solve(), rope.state);
  CHECK_NEAR(norm(rope.state.joint_wrenches[0].force + 3 * n), 0, 1e-12);
  rope.refresh();
  CHECK_NEAR(rope.rows.x0[0], 3, 1e-12);
  CHECK_NEAR(joint_error(*rope.model, rope.bodies, rope.state).distance, 0, 1e-15);
  // Coinciding points: any direction, but a finite one; a length of zero is a ball joint.
  Scene collapsed = rod_scene(1, 1, {}, {});
  CHECK_NEAR(norm(after(collapsed)), 0.7, 1e-6);
  Scene ball = rod_scene(0, 0, {}, t);
  CHECK(ball.rows.jacobian.size() == 3);
  CHECK_NEAR(norm(after(ball)), 0, 1e-6);
}

namespace {

// Wheels on hinges along z, wheel i on body mounts[i]; coupled q0 = poly(q1).
Scene gears(const std::vector<Body>& bodies, const std::vector<std::pair<Index, Index>>& hinges,
            const std::vector<double>& polynomial) {
  Scene scene;
  scene.description.bodies = bodies;
  for (const auto& [a, b] : hinges) {
    Joint joint = joint_of(a, b, {hinge({0, 0, 1})});
    const Vec3 at = bodies[a].pose.position;
    joint.frame_b.position = b < 0 ? at : at - bodies[b].pose.position;
    scene.description.joints.push_back(joint);
  }
  Coupling coupling;
  coupling.joint_a = 0, coupling.joint_b = hinges.size() > 1 ? 1 : -1;
  coupling.coefficients = polynomial;
  scene.description.couplings = {coupling};
  scene.build();
  return scene;
}

Body wheel(double x, double spin) {
  Body body = unit_body({{x, 0, 0}, {}});
  body.angular_velocity = {0, 0, spin};
  return body;
}

}  // namespace

// Fails if a coupling between two bodies on the world is not the one row w0 + 2 w1 = 0, whose impulse for
// unit inertias is -(w0 + 2 w1) / 5 = -1.
TEST(gear_on_the_world) {
  Scene scene = gears({wheel(0, 3), wheel(1, 1)}, {{0, world}, {1, world}}, {0, -2});
  CHECK(scene.count(RowKind::coupling) == 1 && scene.rows.auxiliary_inverse_mass.empty());
  const auto v = scene.velocities_after(scene.solve());
  CHECK_NEAR(v[1].angular.z, (1.0 - 6.0) / 5, 1e-6);  // 1e-7 of the correction is regularisation
  CHECK_NEAR(v[0].angular.z, 2, 1e-6);
  store_joint_impulses(scene.rows, scene.solve(), scene.state);
  CHECK_NEAR(scene.state.coupling_impulses[0], -1, 1e-6);
  scene.refresh();
  CHECK_NEAR(scene.rows.x0[scene.find(RowKind::coupling)], -1, 1e-6);
}

// Fails if the value or the slope of a polynomial is wrong: q0 = 0.1 + 2 q1 - 3 q1^2 at q1 = 0.5 has slope
// -1.
TEST(polynomial_coupling) {
  Scene scene = gears({wheel(0, 0), wheel(1, 0)}, {{0, world}, {1, world}}, {0.1, 2, -3});
  scene.state.orientations[0] = exponential({0, 0, 0.4});
  scene.state.orientations[1] = exponential({0, 0, 0.5});
  scene.state.angular_velocities[0] = {0, 0, 1}, scene.state.angular_velocities[1] = {0, 0, -1};
  scene.refresh();
  const std::size_t i = scene.find(RowKind::coupling);
  CHECK_NEAR(scene.rows.c[i], (0.4 - 0.35) / scene.options.h, 1e-12);
  CHECK_NEAR(scene.rows.jacobian[i].a[5], 1, 1e-14);
  CHECK_NEAR(scene.rows.jacobian[i].b[5], 1, 1e-14);
  Scene held = gears({wheel(0, 2)}, {{0, world}}, {0.3});
  CHECK_NEAR(held.rows.c[held.find(RowKind::coupling)], -0.3 / held.options.h, 1e-12);
}

// Gears on a carrier that floats: three bodies; and on two carriers: four. Fails if the auxiliary body brakes
// the mechanism, or transmits another ratio. The exact step is that of the wide row w: impulse -w.v / w.w for
// unit inertias, within the auxiliary inertia of 1e-4 per part. Thereafter the gears coast: their speeds
// stay, and the auxiliary inertia adds no drag.
TEST(gears_on_floating_carriers) {
  for (const bool two_carriers : {false, true}) {
    // The carriers' centres lie on the axes, so that locked rows do not add inertia to the wheels.
    std::vector<Body> bodies{wheel(0, 3), wheel(two_carriers ? 5 : 0, 1), wheel(0, 0.5)};
    if (two_carriers) bodies.push_back(wheel(5, -0.2));
    const Index second = two_carriers ? 3 : 2;
    Scene scene = gears(bodies, {{0, 2}, {1, second}}, {0, -2});
    CHECK(scene.rows.auxiliary_inverse_mass.size() == 1);
    CHECK(scene.count(RowKind::coupling) == bodies.size());
    const std::vector<double> w =
        two_carriers ? std::vector<double>{1, 2, -1, -2} : std::vector<double>{1, 2, -3};
    double wv = 0, ww = 0;
    for (std::size_t i = 0; i < w.size(); ++i) wv += w[i] * bodies[i].angular_velocity.z, ww += w[i] * w[i];
    const auto v = scene.velocities_after(scene.solve());
    double left = 0, total_before = 0, total = 0;
    for (std::size_t i = 0; i < w.size(); ++i) {
      CHECK_NEAR(v[i].angular.z, bodies[i].angular_velocity.z - w[i] * wv / ww, 1e-3);
      left += w[i] * v[i].angular.z;
      total_before += bodies[i].angular_velocity.z, total += v[i].angular.z;
    }
    CHECK_NEAR(left, 0, 1e-6);  // the ratio itself is exact up to the regularisation
    scene.step();
    const double before = scene.state.angular_velocities[0].z;
    const double impulse = scene.state.coupling_impulses[0];
    CHECK_NEAR(impulse, -wv / ww, 1e-3);
    for (int step = 0; step < 200; ++step) scene.step();
    CHECK_NEAR(scene.state.angular_velocities[0].z, before, 1e-6);
    const auto& q = scene.state.coordinates;
    CHECK_NEAR(q[0], -2 * q[1], 1e-6);
  }
}

// Fails if fixed or kinematic bodies take part as if they could be moved: a joint between two of them has no
// rows, one to a turning table carries its velocity.
TEST(held_bodies) {
  Scene scene;
  Body table = unit_body({}, Motion::kinematic), frame = unit_body({}, Motion::still), box = unit_body();
  table.angular_velocity = {0, 0, 2};
  scene.description.bodies = {box, table, frame};
  scene.description.joints = {joint_of(1, 2, {hinge({0, 0, 1})}), joint_of(0, 1, {}),
                              joint_of(0, 2, {}, true)};
  scene.build();
  CHECK(scene.rows.jacobian.size() == 9);
  for (std::size_t i = 0; i < 6; ++i) CHECK(scene.rows.jacobian[i].body_b == 1);
  for (std::size_t i = 6; i < 9; ++i) CHECK(scene.rows.jacobian[i].body_b == world);
  CHECK_NEAR(scene.velocities_after(scene.solve())[0].angular.z, 2, 1e-6);
}
