#include "amontons/multibody/kinematics/closure.hpp"
#include "amontons/multibody/kinematics/dynamics.hpp"
#include "check.hpp"
#include "joint_scene.hpp"

// Generalised coordinates against differences and sums over bodies; MuJoCo's are in tests/python.
using namespace joint_scene;

namespace {

std::shared_ptr<const Model> odd_tree(Random& random) {
  return std::make_shared<const Model>(odd_trees(random));
}

std::vector<double> random_q(const Tree& tree, Random& random) {
  std::vector<double> q, rates(tree.nv());
  for (std::size_t i = 0; i < tree.nq(); ++i) q.push_back(random());
  check_coordinates(tree, q, rates);
  return q;
}

// q moved along qd for a time h, to first order.
std::vector<double> advanced(const Tree& tree, std::vector<double> q, const std::vector<double>& qd,
                             double h) {
  for (const Link& link : tree.links()) {
    const std::size_t plain = link.q - (link.q > link.v ? 4 : 0);
    for (std::size_t i = 0; i < plain; ++i) q[link.first_q + i] += h * qd[link.first_v + i];
    if (link.q == link.v) continue;
    double* b = &q[link.first_q + plain];
    const double* w = &qd[link.first_v + plain];
    const Quat r = Quat{b[0], b[1], b[2], b[3]} * exponential(h * Vec3{w[0], w[1], w[2]});
    b[0] = r.w, b[1] = r.x, b[2] = r.y, b[3] = r.z;
  }
  return q;
}

std::vector<double> random_rates(const Tree& tree, Random& random) {
  std::vector<double> rates;
  for (std::size_t i = 0; i < tree.nv(); ++i) rates.push_back(random());
  return rates;
}

}  // namespace

// Fails if poses, velocities and accelerations of bodies are not derivatives of each other, or what is
// written is not what is read.
TEST(motion_is_the_derivative_of_poses) {
  Random random;
  const auto model = odd_tree(random);
  const Tree tree(model);
  CHECK(tree.nq() == 7 + 3 + 5 + 4 + 1 && tree.nv() == 6 + 3 + 4 + 3 + 1);
  State state = initial_state(*model);
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<double> q = random_q(tree, random), qd = random_rates(tree, random), zero(tree.nv());
    write_poses(tree, q, state);
    write_velocities(tree, q, qd, state);
    const Coordinates read = read_coordinates(tree, state);
    for (std::size_t i = 0; i < qd.size(); ++i) CHECK_NEAR(read.qd[i], qd[i], 1e-9);
    constexpr double h = 1e-5;
    State later = state, earlier = state;
    for (const double sign : {1.0, -1.0}) {
      State& other = sign > 0 ? later : earlier;
      // The kinematic body moves on as well.
      other.positions[5] += sign * h * state.linear_velocities[5];
      other.orientations[5] =
          normalised(exponential(sign * h * state.angular_velocities[5]) * state.orientations[5]);
      const auto there = advanced(tree, q, qd, sign * h);
      write_poses(tree, there, other);
      write_velocities(tree, there, qd, other);
    }
    const TreePose pose = pose_of(tree, state, q);
    const TreeMotion motion = motion_of(tree, state, pose, qd, zero);
    for (std::size_t i = 0; i < model->bodies(); ++i) {
      const Vec3 &p = state.positions[i], &v = state.linear_velocities[i];
      const Vec3 slope = (later.positions[i] - earlier.positions[i]) / (2 * h);
      const Vec3 turn = logarithm(later.orientations[i] * conjugate(earlier.orientations[i])) / (2 * h);
      const Vec3 growth = (later.linear_velocities[i] - earlier.linear_velocities[i]) / (2 * h);
      const Twist& a = motion.accelerations[i];
      const Vec3 acceleration = velocity_at(a, p) + cross(state.angular_velocities[i], v);
      CHECK_NEAR(norm(slope - v), 0, 1e-7);
      CHECK_NEAR(norm(turn - state.angular_velocities[i]), 0, 1e-7);
      CHECK_NEAR(norm(growth - acceleration), 0, 1e-6 * (1 + norm(acceleration)));
    }
  }
}

// Fails if M is not the kinetic energy's, or c not what follows from M by Lagrange's equations along a path.
TEST(mass_matrix_and_inverse_dynamics_belong_together) {
  Random random;
  ModelDescription description = odd_tree(random)->description();
  description.bodies[5].linear_velocity = description.bodies[5].angular_velocity = {};
  const auto model = std::make_shared<const Model>(description);
  const Tree tree(model);
  State state = initial_state(*model);
  const auto energy = [&](const std::vector<double>& q, const std::vector<double>& qd) {
    const std::vector<double> M = mass_matrix(tree, state, pose_of(tree, state, q), q);
    double twice = 0;
    for (std::size_t i = 0; i < qd.size(); ++i)
      for (std::size_t j = 0; j < qd.size(); ++j) twice += qd[i] * M[i * qd.size() + j] * qd[j];
    return twice / 2;
  };
  for (int trial = 0; trial < 10; ++trial) {
    const std::vector<double> q = random_q(tree, random), qd = random_rates(tree, random),
                              qdd = random_rates(tree, random);
    write_poses(tree, q, state);
    write_velocities(tree, q, qd, state);
    const double armature = 0.5 * 0.3 * qd[tree.links()[1].first_v] * qd[tree.links()[1].first_v];
    CHECK_NEAR(energy(q, qd), kinetic_energy(*model, state) + armature, 1e-11);
    // Power: qd (M qdd + c) = dT/dt + dV/dt, V = -sum m <g, x>.
    const TreePose pose = pose_of(tree, state, q);
    const std::vector<double> tau = inverse_dynamics(tree, state, pose, q, qd, qdd);
    double power = 0, weight = 0;
    for (std::size_t i = 0; i < qd.size(); ++i) power += tau[i] * qd[i];
    for (std::size_t i = 0; i < model->bodies(); ++i) {
      const Body& body = model->body(static_cast<Index>(i));
      if (body.motion != Motion::dynamic) continue;
      const Vec3 arm = rotate(state.orientations[i], body.centre_of_mass);
      weight -= body.mass * dot(model->description().gravity,
                                state.linear_velocities[i] + cross(state.angular_velocities[i], arm));
    }
    constexpr double h = 1e-5;
    const auto moved = [&](double s) {
      std::vector<double> rates = qd;
      for (std::size_t i = 0; i < rates.size(); ++i) rates[i] += s * qdd[i];
      return energy(advanced(tree, q, qd, s), rates);
    };
    CHECK_NEAR(power, (moved(h) - moved(-h)) / (2 * h) + weight, 1e-6 * (1 + std::abs(power)));
  }
}

// Fails if a loop stays open, held coordinates move, or a loop that cannot close is not named.
TEST(loops_close_or_are_named) {
  ModelDescription d;
  for (int i = 0; i < 3; ++i) d.bodies.push_back(unit_body({{1.0 * i, 0, 0}, {}}));
  for (Index i = 0; i < 3; ++i) {
    Joint joint = joint_of(i, i - 1, {hinge({0, 0, 1})});
    joint.name = "pivot " + std::to_string(i);
    if (i > 0) joint.frame_b.position = {1, 0, 0};
    d.joints.push_back(joint);
  }
  Joint rod;  // from the end of the last body to a point of the world
  rod.name = "rod";
  rod.kind = JointKind::distance;
  rod.body_a = 2;
  rod.frame_a.position = {1, 0, 0};
  rod.frame_b.position = {2, 1, 0};
  rod.lower_distance = rod.upper_distance = 0.5;
  d.joints.push_back(rod);
  const Tree tree(std::make_shared<const Model>(d));
  CHECK(tree.loops().size() == 1);
  State state = initial_state(tree.model());
  std::vector<double> q{0.3, 0.2, 0.1};
  std::vector<unsigned char> held{1, 0, 0};
  close_loops(tree, state, held, q);
  CHECK(q[0] == 0.3);
  const Transform last = pose_of(tree, state, q).bodies[2];
  CHECK_NEAR(norm(last({1, 0, 0}) - Vec3{2, 1, 0}), 0.5, 1e-12);
  std::vector<double> qd{1, 0, 0};
  close_velocities(tree, state, q, held, qd);
  // The distance stays as it is along qd, to second order.
  const Transform moved = pose_of(tree, state, advanced(tree, q, qd, 1e-5)).bodies[2];
  CHECK_NEAR(norm(moved({1, 0, 0}) - Vec3{2, 1, 0}), 0.5, 1e-8);
  // Stretched to the other side nothing reaches.
  std::vector<double> away{3.14, 0, 0};
  held = {1, 1, 1};
  CHECK_THROWS(close_loops(tree, state, held, away), "q does not close joint \"rod\"");
  CHECK(away[0] == 3.14);
}
