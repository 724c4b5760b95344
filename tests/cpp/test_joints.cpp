// Geometry of joints: coordinates, rows, what they do to momentum, units and redundant mechanisms.
#include <numbers>

#include "check.hpp"
#include "joint_scene.hpp"

using namespace joint_scene;

namespace {

constexpr double pi = std::numbers::pi;

struct Kind {
  std::string name;
  Joint joint;
  std::size_t locked;
};

// Every kind of joint of the Python interface, the chains of MJCF bodies, and chains whose locked directions
// mix forces and torques.
std::vector<Kind> all_kinds() {
  const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, p{0.2, -0.3, 0.4}, q{-0.5, 0.1, 0.2};
  std::vector<Kind> kinds;
  const auto add = [&](const char* name, std::size_t locked, std::vector<Dof> dofs, bool spherical = false) {
    kinds.push_back({name, joint_of(0, 1, std::move(dofs), spherical), locked});
  };
  add("fixed", 6, {});
  add("revolute", 5, {hinge({1, 2, -1})});
  add("revolute about a distant axis", 5, {hinge({1, 2, -1}, p)});
  add("prismatic", 5, {slide({-1, 1, 3})});
  add("cylindrical", 4, {slide(z), hinge(z, p)});
  add("cylindrical, hinge first", 4, {hinge(z, p), slide(z)});
  add("universal", 4, {hinge(x), hinge(y)});
  add("skew universal", 4, {hinge(x, p), hinge({1, 1, 0}, p)});
  add("planar", 3, {slide(x), slide(y), hinge(z)});
  add("gimbal", 3, {hinge(x), hinge(y), hinge(z)});
  add("gimbal about a distant point", 3, {hinge(z, p), hinge(y, p), hinge(x, p)});
  add("slide, slide, distant hinge", 3, {slide(x), slide(z), hinge({0, 1, 0.2}, p)});
  add("polar arm", 4, {hinge(z, p), slide(x)});
  add("two parallel hinges", 4, {hinge(z, p), hinge(z, q)});
  add("two skew hinges", 4, {hinge(x, p), hinge({0, 1, 1}, q)});
  add("six", 0, {slide(x), slide(y), slide(z), hinge(x), hinge(y), hinge(z)});
  add("ball", 3, {}, true);
  add("point on line", 2, {slide({1, 1, 0})}, true);
  add("point in plane", 1, {slide(x), slide(y)}, true);
  add("point on circle", 2, {hinge(z, p)}, true);
  return kinds;
}

std::vector<double> some_coordinates(Random& random, const Joint& joint) {
  std::vector<double> q;
  for (std::size_t i = 0; i < joint.dofs.size(); ++i) q.push_back(random(0.3, 0.9));
  return q;
}

// Two odd bodies joined without error at coordinates q, a damper on every dof, so that each has a drive row.
Scene scene_of(Random& random, Joint joint, const std::vector<double>& q, double damping = 1) {
  Scene scene;
  for (Dof& dof : joint.dofs) dof.damping = damping;
  joint.frame_a = random.transform(0.5), joint.frame_b = random.transform(0.5);
  const Transform pose_b = random.transform();
  Transform relative = product_of_exponentials(joint, q);
  if (joint.spherical) relative.rotation = relative.rotation * exponential(random.vector());
  const Transform pose_a = pose_b * joint.frame_b * relative * inverse(joint.frame_a);
  scene.description.bodies = {odd_body(random, pose_a), odd_body(random, pose_b)};
  scene.description.joints = {joint};
  scene.build();
  return scene;
}

struct Motion6 {
  Vec3 linear, angular;  // of the centre of mass
};

void move(Scene& scene, std::size_t body, const Motion6& m) {
  const BodyFrame frame = scene.bodies[body];
  const Quat turn = exponential(m.angular);
  State& s = scene.state;
  s.positions[body] = frame.centre + m.linear + rotate(turn, frame.pose.position - frame.centre);
  s.orientations[body] = normalised(turn * frame.pose.rotation);
}

}  // namespace

// Fails if T(q), its derivative, or the fit is wrong for any kind: coordinates set by the oracle's product of
// exponentials must come back from the poses, from zero and from a start 0.2 away. Six digits beyond the step
// of Gauss-Newton (1e-14) are left for the rounding of the poses.
TEST(coordinates_come_back) {
  Random random;
  for (const Kind& kind : all_kinds())
    for (int trial = 0; trial < 5; ++trial) {
      const std::vector<double> q = some_coordinates(random, kind.joint);
      Scene scene = scene_of(random, kind.joint, q);
      for (std::size_t i = 0; i < q.size(); ++i) CHECK_NEAR(scene.state.coordinates[i], q[i], 1e-11);
      for (double& c : scene.state.coordinates) c += 0.2;
      scene.refresh();
      for (std::size_t i = 0; i < q.size(); ++i) CHECK_NEAR(scene.state.coordinates[i], q[i], 1e-11);
      const JointError error = joint_error(*scene.model, scene.bodies, scene.state);
      CHECK_NEAR(error.distance, 0, 1e-13);
      CHECK_NEAR(error.angle, 0, 1e-13);
    }
}

// Fails if a kind locks too many or too few directions.
TEST(locked_rows_are_six_less_the_dofs) {
  Random random;
  for (const Kind& kind : all_kinds()) {
    Scene scene = scene_of(random, kind.joint, some_coordinates(random, kind.joint));
    CHECK(scene.count(RowKind::locked) == kind.locked);
    CHECK(scene.rows.cones.rows() == scene.rows.jacobian.size());
    for (std::size_t i = 0; i < kind.locked; ++i) CHECK(scene.rows.tags[i].kind == RowKind::locked);
  }
}

// Fails if rows of a common joint mix forces and torques: revolute is three forces and two torques at the
// anchor.
TEST(common_joints_have_textbook_rows) {
  Random random;
  for (const Kind& kind : all_kinds()) {
    const std::size_t forces = kind.name == "fixed" || kind.name.starts_with("revolute") ? 3
                               : kind.name == "prismatic"                                ? 2
                                                                                         : 0;
    if (forces == 0) continue;
    Scene scene = scene_of(random, kind.joint, some_coordinates(random, kind.joint));
    for (std::size_t i = 0; i < kind.locked; ++i) {
      const double size = norm(scene.rows.tags[i].force);
      CHECK_NEAR(size, i < forces ? 1 : 0, 1e-14);
      if (i >= forces) CHECK_NEAR(norm(scene.rows.tags[i].torque), scene.options.length, 1e-14);
    }
  }
}

// Fails if a locked row is not the derivative of the violation h c it takes back, or a dof row not that of
// the coordinate. Central differences of step e have an error of order e^2 plus 1e-16 / e.
TEST(rows_are_derivatives) {
  Random random;
  constexpr double e = 1e-5;
  for (const Kind& kind : all_kinds()) {
    Scene scene = scene_of(random, kind.joint, some_coordinates(random, kind.joint));
    const JointRows rows = scene.rows;
    const Motion6 a{random.vector(), random.vector()}, b{random.vector(), random.vector()};
    const State rest = scene.state;
    const auto bodies = scene.bodies;
    std::vector<double> violation[2], q[2];
    for (int side = 0; side < 2; ++side) {
      const double s = side == 0 ? -e : e;
      scene.state = rest, scene.bodies = bodies;
      move(scene, 0, {s * a.linear, s * a.angular});
      move(scene, 1, {s * b.linear, s * b.angular});
      scene.refresh();
      for (std::size_t i = 0; i < kind.locked; ++i)
        violation[side].push_back(scene.options.h * scene.rows.c[i]);
      q[side] = scene.state.coordinates;
    }
    scene.rows = rows;
    const std::vector<BodyVelocity> v{{a.linear, a.angular}, {b.linear, b.angular}};
    for (std::size_t i = 0; i < rows.jacobian.size(); ++i) {
      const double rate = scene.row_velocity(i, v);
      if (i < kind.locked)
        CHECK_NEAR(rate, (violation[1][i] - violation[0][i]) / (2 * e), 1e-8);
      else
        CHECK_NEAR(rate, rows.tags[i].scale * (q[1][rows.tags[i].dof] - q[0][rows.tags[i].dof]) / (2 * e),
                   1e-8);
    }
  }
}

// Fails if the two sides of a row act at different points of the world, also where the joint is violated.
TEST(rows_conserve_momentum) {
  Random random;
  for (const Kind& kind : all_kinds()) {
    Scene scene = scene_of(random, kind.joint, some_coordinates(random, kind.joint));
    move(scene, 0, {random.vector(0.1), random.vector(0.1)});
    scene.refresh();
    for (const JacobianRow& row : scene.rows.jacobian) {
      const Vec3 fa{row.a[0], row.a[1], row.a[2]}, fb{row.b[0], row.b[1], row.b[2]};
      const Vec3 ta{row.a[3], row.a[4], row.a[5]}, tb{row.b[3], row.b[4], row.b[5]};
      CHECK_NEAR(norm(fa + fb), 0, 1e-15);
      const Vec3 moment = ta + cross(scene.bodies[0].centre, fa) + tb + cross(scene.bodies[1].centre, fb);
      CHECK_NEAR(norm(moment), 0, 1e-14);
    }
  }
}

// Fails if the stored impulses lose a kind of row, or come back with another sign or scale: rows built again
// in the same pose must start from the impulses that were stored.
TEST(impulses_come_back_as_warm_start) {
  Random random;
  for (Kind kind : all_kinds()) {
    for (Dof& dof : kind.joint.dofs) {
      dof.friction = 1e3;
      dof.motor.kind = MotorKind::velocity;
      dof.upper = 0.95;
      dof.lower = 0.25;
    }
    if (kind.joint.spherical) kind.joint.ball_stiffness = 2, kind.joint.ball_limit = 1.8;
    Scene scene = scene_of(random, kind.joint, some_coordinates(random, kind.joint));
    std::vector<double> x;
    std::vector<bool> limited(scene.model->dofs());
    for (const RowTag& tag : scene.rows.tags) {
      double value = random();
      if (tag.kind == RowKind::limit) {
        value = std::abs(value);
        // The two limits of a dof do not push at once.
        if (tag.dof >= 0) {
          if (limited[tag.dof]) value = 0;
          limited[tag.dof] = true;
        }
      }
      x.push_back(value);
    }
    store_joint_impulses(scene.rows, x, scene.state);
    scene.refresh();
    CHECK(scene.rows.x0.size() == x.size());
    for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(scene.rows.x0[i], x[i], 1e-13);
    // The wrench of the locked rows is about the origin of frame_a: its work on A is that of the rows.
    const Joint& joint = scene.model->joint(0);
    const Transform a = scene.bodies[0].pose * joint.frame_a, b = scene.bodies[1].pose * joint.frame_b;
    Vec3 force, torque;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const auto& j = scene.rows.jacobian[i].a;
      if (scene.rows.tags[i].kind != RowKind::locked && scene.rows.tags[i].dof >= 0) continue;
      force += x[i] * Vec3{j[0], j[1], j[2]}, torque += x[i] * Vec3{j[3], j[4], j[5]};
    }
    const JointWrench& w = scene.state.joint_wrenches[0];
    CHECK_NEAR(norm(force - rotate(b.rotation, w.force)), 0, 1e-13);
    const Vec3 moment = rotate(b.rotation, w.torque) + cross(a.position - scene.bodies[0].centre, force);
    CHECK_NEAR(norm(torque - moment), 0, 1e-13);
  }
}

// Fails if turns are not counted, or counted twice: steps of 2.5 rad, up and down again.
TEST(hinge_counts_turns) {
  Scene scene;
  scene.description.bodies = {unit_body()};
  Joint joint = joint_of(0, world, {slide({0, 0, 1}), hinge({0, 0, 1}, {0.3, 0, 0})});
  scene.description.joints = {joint};
  scene.build();
  double angle = 0;
  for (int step = 0; step < 40; ++step) {
    angle += step < 20 ? 2.5 : -2.6;
    const Transform t = product_of_exponentials(joint, {0.1 * step, angle});
    scene.state.positions[0] = t.position, scene.state.orientations[0] = t.rotation;
    scene.refresh();
    CHECK_NEAR(scene.state.coordinates[0], 0.1 * step, 1e-12);
    CHECK_NEAR(scene.state.coordinates[1], angle, 1e-12);
  }
}

// Fails if a gimbal loses count when its first axis turns on.
TEST(gimbal_counts_turns) {
  Scene scene;
  scene.description.bodies = {unit_body()};
  Joint joint = joint_of(0, world, {hinge({0, 0, 1}), hinge({0, 1, 0}), hinge({1, 0, 0})});
  scene.description.joints = {joint};
  scene.build();
  for (int step = 1; step <= 60; ++step) {
    const std::vector<double> q{0.4 * step, 0.7 * std::sin(0.3 * step), -0.3 * step};
    scene.state.orientations[0] = product_of_exponentials(joint, q).rotation;
    scene.refresh();
    for (int i = 0; i < 3; ++i) CHECK_NEAR(scene.state.coordinates[i], q[i], 1e-11);
  }
}

// Fails if a hinge that starts near pi, or beyond a turn by its limits, is found on another branch.
TEST(first_coordinates_find_the_branch) {
  for (const double angle : {3.1, -3.1, 3.5, 6.0, -5.0, 9.0}) {
    Scene scene;
    Joint joint = joint_of(0, world, {hinge({1, 1, 0}, {0, 0, 1})});
    joint.dofs[0].lower = angle - 0.5, joint.dofs[0].upper = angle + 0.7;
    scene.description.bodies = {unit_body(product_of_exponentials(joint, {angle}))};
    scene.description.joints = {joint};
    scene.build();
    CHECK_NEAR(scene.state.coordinates[0], angle, 1e-12);
  }
  // Three hinges far from zero: some triple of angles fits, though not the one that made the pose.
  Random random;
  for (int trial = 0; trial < 50; ++trial) {
    Scene scene;
    const Joint joint =
        joint_of(0, world, {hinge({0, 0, 1}), hinge({0, 1, 0}, {0.5, 0, 0}), hinge({1, 0, 0}, {1, 0, 0})});
    const std::vector<double> q{random(-3, 3), random(-3, 3), random(-3, 3)};
    scene.description.bodies = {unit_body(product_of_exponentials(joint, q))};
    scene.description.joints = {joint};
    scene.build();
    CHECK_NEAR(joint_error(*scene.model, scene.bodies, scene.state).distance, 0, 1e-10);
    CHECK_NEAR(joint_error(*scene.model, scene.bodies, scene.state).angle, 0, 1e-10);
  }
}

// Fails if gimbal lock makes rows or coordinates run off: three locked rows remain, and no row is much longer
// than the damping of 1e-6 allows, 1 / (2 sqrt(1e-6)) = 500, while the middle angle passes through 90
// degrees.
TEST(gimbal_lock_stays_finite) {
  Scene scene;
  scene.description.bodies = {unit_body()};
  Joint joint = joint_of(0, world, {hinge({1, 0, 0}), hinge({0, 1, 0}), hinge({0, 0, 1})});
  for (Dof& dof : joint.dofs) dof.damping = 1;
  scene.description.joints = {joint};
  scene.build();
  for (const double beyond :
       {-0.5, -0.2, -0.05, -0.01, -1e-3, -1e-4, -1e-6, -1e-8, 0.0, 1e-7, 1e-5, 1e-3, 0.02, 0.1}) {
    const double middle = pi / 2 + beyond;
    scene.state.orientations[0] = product_of_exponentials(joint, {0.2, middle, 0.1}).rotation;
    scene.refresh();
    CHECK(scene.count(RowKind::locked) == 3);
    CHECK_NEAR(joint_error(*scene.model, scene.bodies, scene.state).angle, 0, 1e-8);
    double longest = 0;
    for (const JacobianRow& row : scene.rows.jacobian)
      for (const double value : row.a) longest = std::max(longest, std::abs(value));
    CHECK(longest < 2000);
    if (std::abs(beyond) >= 1e-2) CHECK_NEAR(scene.state.coordinates[1], middle, 1e-9);
  }
}

// Fails if anything in coordinates or rows has a dimension: the same mechanism in units of length smaller by
// 1024 gives the same bits, lengths multiplied by 1024 (a power of two: scaling is exact).
TEST(rows_do_not_depend_on_the_unit_of_length) {
  constexpr double u = 1024;
  Random random;
  for (Kind kind : all_kinds()) {
    kind.joint.compliance = kind.locked == 4 ? 1e-3 : 0;
    Scene small = scene_of(random, kind.joint, some_coordinates(random, kind.joint));
    Geom geom;
    geom.body = 0, geom.shape = Sphere{0.7};
    small.description.geoms = {geom};
    for (Dof& dof : small.description.joints[0].dofs) {
      const bool slides = dof.kind == Dof::Kind::slide;
      dof.stiffness = 3, dof.friction = 2, dof.armature = 0.1, dof.lower = -0.2, dof.upper = 0.5;
      dof.motor = {MotorKind::position, 0.1, 5, slides ? 0.0 : 7.0, slides ? 0.0 : 0.5};
    }
    Scene large;
    large.description = small.description;
    for (Body& body : large.description.bodies) {
      body.centre_of_mass *= u, body.pose.position *= u, body.linear_velocity *= u;
      body.inertia = (u * u) * body.inertia;
    }
    large.description.geoms[0].shape = Sphere{0.7 * u};
    Joint& joint = large.description.joints[0];
    joint.frame_a.position *= u, joint.frame_b.position *= u;
    for (Dof& dof : joint.dofs) {
      dof.anchor *= u;
      const bool slides = dof.kind == Dof::Kind::slide;
      if (slides) {  // N/m and N s/m keep their numbers where mass and time do
        dof.lower *= u, dof.upper *= u, dof.motor.control *= u, dof.friction *= u, dof.motor.max_effort *= u;
        continue;
      }
      dof.stiffness *= u * u, dof.damping *= u * u, dof.friction *= u * u, dof.armature *= u * u;
      dof.motor.max_effort *= u * u, dof.motor.kp *= u * u, dof.motor.kd *= u * u;
    }
    small.build(), large.build();
    small.options.recovery_speed = 0.7, large.options.recovery_speed = 0.7 * u;
    for (Scene* scene : {&small, &large}) {
      const double s = scene == &large ? u : 1;
      move(*scene, 0, {s * Vec3{0.01, -0.02, 0.01}, {0.01, 0.02, 0.03}});
      scene->refresh();
    }
    CHECK(small.rows.jacobian.size() == large.rows.jacobian.size());
    for (std::size_t i = 0; i < small.rows.jacobian.size(); ++i) {
      CHECK(small.rows.c[i] * u == large.rows.c[i]);
      CHECK(small.rows.compliance[i] == large.rows.compliance[i]);
      for (int k = 0; k < 6; ++k)
        CHECK(small.rows.jacobian[i].a[k] * (k < 3 ? 1 : u) == large.rows.jacobian[i].a[k]);
    }
    const auto &few = small.rows.cones.all<Interval>(), &many = large.rows.cones.all<Interval>();
    for (std::size_t i = 0; i < few.size(); ++i) CHECK(few[i].hi * u == many[i].hi);
  }
}
