// Trees of the step against the generalised coordinates of kinematics, which share no code with them.
#include <numeric>
#include <span>

#include "amontons/multibody/kinematics/closure.hpp"
#include "amontons/multibody/kinematics/dynamics.hpp"
#include "check.hpp"
#include "joint_scene.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/trees/masses.hpp"
#include "multibody/trees/momenta.hpp"
#include "multibody/trees/poses.hpp"
#include "multibody/trees/rates.hpp"
#include "problems.hpp"
#include "solvers/direct/reduction.hpp"

using namespace joint_scene;

namespace {

struct OddTrees {
  Random random;
  std::shared_ptr<const Model> model;
  std::unique_ptr<const Tree> tree;
  State state;
  BodyFrames frames;
  BodyMobilities mobility;
  BodyVelocities start;
  TreeStep step;
  mutable TreeMemory memory;

  OddTrees() {
    ModelDescription d = odd_trees(random);
    d.trees = Trees::automatic;
    // Bodies without a joint before them: their centre moves straight at constant rates, here also their
    // origin, whose velocity the other coordinates have.
    d.bodies[0].centre_of_mass = d.bodies[5].centre_of_mass = {};
    model = std::make_shared<const Model>(d);
    tree = std::make_unique<const Tree>(model);
    state = initial_state(*model);
    std::vector<double> q, qd;
    for (std::size_t i = 0; i < tree->nq(); ++i) q.push_back(random());
    for (std::size_t i = 0; i < tree->nv(); ++i) qd.push_back(random());
    check_coordinates(*tree, q, qd);
    write_poses(*tree, q, state);
    write_velocities(*tree, q, qd, state);
    place_trees(setting(0), state, step);
    place_bodies(*model, state, frames, mobility, start);
    make_tree_masses(setting(0), state, step);
  }

  // A step of length h after one as long.
  TreeSetting setting(double h) const { return {*model, *tree, frames, start, memory, h, h}; }

  // Rates in the order of the tree of velocities of the centres of mass.
  std::vector<double> rates(const BodyVelocities& v) const {
    State there = state;
    for (std::size_t i = 0; i < v.size(); ++i) {
      there.angular_velocities[i] = v[i].angular;
      there.linear_velocities[i] =
          v[i].linear + cross(v[i].angular, frames[i].pose.position - frames[i].centre);
    }
    return read_coordinates(*tree, there).qd;
  }
  TreePose pose() const { return pose_of(*tree, state, read_coordinates(*tree, state).q); }
};

}  // namespace

// A wrong inertia, column or way to the root leaves a residual of the size of the impulses.
TEST(velocities_of_impulses_on_trees_are_those_of_the_mass_matrix) {
  OddTrees t;
  const auto& bodies = *t.step.constrained;
  CHECK(bodies.body.size() == 5);
  std::vector<Vec3> forces(6), torques(6);
  std::vector<double> w;
  for (const Index i : bodies.body) {
    forces[i] = t.random.vector();
    torques[i] = t.random.vector();
    for (const Vec3& part : {forces[i], torques[i]})
      for (const double x : part.array()) w.push_back(x);
  }
  bodies.apply(w.data());
  BodyVelocities v(6);
  t.state.linear_velocities[5] = t.state.angular_velocities[5] = {};
  for (std::size_t k = 0; k < bodies.body.size(); ++k)
    v[bodies.body[k]] = {{w[6 * k], w[6 * k + 1], w[6 * k + 2]}, {w[6 * k + 3], w[6 * k + 4], w[6 * k + 5]}};
  const std::vector<double> qd = t.rates(v), q = read_coordinates(*t.tree, t.state).q;
  const std::vector<double> M = mass_matrix(*t.tree, t.state, t.pose(), q);
  const std::vector<double> tau = generalised_forces(*t.tree, t.pose(), forces, torques);
  for (std::size_t i = 0; i < qd.size(); ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < qd.size(); ++j) sum += M[i * qd.size() + j] * qd[j];
    CHECK_NEAR(sum, tau[i], 1e-12);
  }
  // No velocity that the joints lock.
  State there = t.state;
  write_velocities(*t.tree, q, qd, there);
  for (const Index i : bodies.body) CHECK_NEAR(norm(there.angular_velocities[i] - v[i].angular), 0, 1e-12);
}

// The half row of a row of D by coordinate.
static std::vector<double> half_of(const Linkage& linkage, const JacobianRow& row) {
  std::vector<Index> coordinate;
  const Linkage::Paths paths = linkage.append_paths(row, coordinate);
  std::vector<double> y(coordinate.size()), all(linkage.coordinates());
  linkage.half_solve(row, paths, coordinate.data(), y.data());
  for (std::size_t s = 0; s < y.size(); ++s) all[coordinate[s]] += y[s];
  return all;
}

// The entries of D M^-1 D' from halves; the second row joins two links of one tree, whose base moves too.
TEST(half_rows_multiply_to_the_mobility_of_rows) {
  OddTrees t;
  const auto& bodies = *t.step.constrained;
  const Linkage& linkage = *bodies.linkage;
  const auto wrench = [&] {
    std::array<double, 6> j;
    for (double& x : j) x = t.random();
    return j;
  };
  const std::vector<JacobianRow> rows{{1, world, wrench(), {}},
                                      {1, 3, wrench(), wrench()},
                                      {0, 4, wrench(), wrench()},
                                      {5, 2, wrench(), wrench()}};
  const auto place = [&](Index body) { return linkage.number_of(body); };
  for (const JacobianRow& a : rows)
    for (const JacobianRow& b : rows) {
      std::vector<double> w(6 * bodies.body.size());
      for (const auto& [body, j] : {std::pair(b.body_a, b.a), std::pair(b.body_b, b.b)})
        if (place(body) >= 0)
          for (std::size_t c = 0; c < 6; ++c) w[6 * place(body) + c] += j[c];
      bodies.apply(w.data());
      double direct = 0;
      for (const auto& [body, j] : {std::pair(a.body_a, a.a), std::pair(a.body_b, a.b)})
        if (place(body) >= 0)
          for (std::size_t c = 0; c < 6; ++c) direct += j[c] * w[6 * place(body) + c];
      const std::vector<double> ya = half_of(linkage, a), yb = half_of(linkage, b);
      const double halves = std::inner_product(ya.begin(), ya.end(), yb.begin(), 0.0);
      CHECK_NEAR(halves, direct, 1e-12);
    }
}

// A row along a coordinate starts there, without the columns between its bodies and the root. Breaks when a
// joint writes another coordinate or sign than that of its row.
TEST(half_rows_along_a_coordinate_are_those_of_their_bodies) {
  OddTrees t;
  const Linkage& linkage = *t.step.constrained->linkage;
  JointContexts joints;
  place_joints(*t.model, t.frames, t.state, joints, t.tree->without_rows());
  place_tree_joints(t.setting(0), t.state, t.step, joints);
  std::size_t count = 0;
  for (const JointContext& joint : joints)
    for (std::size_t i = 0; i < joint.joint->dofs.size(); ++i, ++count) {
      const JacobianRow along = -2.0 * dof_row(joint, i);
      CHECK(along.coordinate >= 0);
      JacobianRow row = along;
      row.coordinate = -1;
      const std::vector<double> y = half_of(linkage, row), same = half_of(linkage, along);
      // The bodies' way to the root may begin beyond the coordinate; what is there cancels.
      for (std::size_t k = 0; k < y.size(); ++k) CHECK_NEAR(same[k], y[k], 1e-12);
      CHECK_NEAR(linkage.inverse_mass(along), linkage.inverse_mass(row), 1e-12);
    }
  CHECK(count == 5);
}

// A x by the halves is that of all sweeps over bodies. Breaks when a compliance, a contact or the fixed part
// of a row gets lost. A row that moves a free body has no half there: the sweeps are needed.
TEST(products_by_halves_are_those_over_bodies) {
  OddTrees t;
  ContactSystem A;
  for (int i = 0; i < 7; ++i) {
    A.bodies.inverse_mass.push_back(i == 5 ? 0 : 1.0 + i);
    A.bodies.inverse_inertia.push_back(i == 5 ? std::array<double, 6>{} : std::array<double, 6>{1, 2, 3});
    A.bodies.centre.emplace_back();
  }
  A.constrained = t.step.constrained;
  const auto wrench = [&] {
    std::array<double, 6> j;
    for (double& x : j) x = t.random();
    return j;
  };
  for (const auto& [a, b] : {std::pair<Index, Index>{1, world}, {2, 5}, {4, 0}}) {
    Contact c;
    c.body_a = a;
    c.body_b = b;
    c.normal = t.random.unit();
    c.r_a = t.random.vector();
    c.r_b = t.random.vector();
    A.contacts.push_back(c);
    A.contact_compliance.push_back(0.1 * static_cast<double>(A.contacts.size()));
    A.jacobian.push_back({b, a, wrench(), wrench()});
    A.compliance.push_back(0.01 * static_cast<double>(A.contacts.size()));
  }
  A.renew();
  CHECK(A.half.whole);
  std::vector<double> x(A.rows()), y(x.size()), same(x.size());
  for (double& value : x) value = t.random();
  A.product(x, y);
  A.half.whole = false;
  A.product(x, same);
  for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(y[i], same[i], 1e-12);
  A.jacobian.push_back({6, 1, wrench(), wrench()});
  A.compliance.push_back(0);
  A.renew();
  CHECK(!A.half.whole);
}

// W of islands whose rows reach some of the coordinates of their bodies. Breaks when a coordinate that no row
// reaches is taken for one, or a row for one of another place.
TEST(reduction_of_rows_that_end_before_the_last_coordinate) {
  OddTrees t;
  JointContexts joints;
  place_joints(*t.model, t.frames, t.state, joints, t.tree->without_rows());
  place_tree_joints(t.setting(0), t.state, t.step, joints);
  std::vector<JacobianRow> rows;
  for (const JointContext& joint : joints)
    for (std::size_t i = 0; i < joint.joint->dofs.size(); ++i) rows.push_back(dof_row(joint, i));
  for (unsigned some = 1; some < 1u << rows.size(); ++some) {
    ContactSystem A;
    A.bodies.inverse_mass = {1, 1, 1, 1, 1, 0};
    A.bodies.inverse_inertia.assign(6, {1, 1, 1});
    A.bodies.inverse_inertia[5] = {};
    A.bodies.centre.resize(6);
    A.constrained = t.step.constrained;
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (some >> i & 1) A.jacobian.push_back(rows[i]);
    const std::size_t m = A.jacobian.size();
    A.compliance.assign(m, 0.1);
    A.renew();
    SetProduct K;
    K.add_count<NonNegative>(m);
    const Problem problem = make_problem(std::move(A), std::vector<double>(m, -1.0), std::move(K));
    const std::vector<double> dense = small::dense_matrix(problem.A);
    Reduction reduction;
    CHECK(reduction.analyse(problem, 100) && reduction.factor(problem));
    for (std::size_t k = 0; k < reduction.islands(); ++k) {
      Reduction::Island& island = reduction.island(k);
      if (!island.thin.empty()) small::fill(island.thin, island.W);
      for (std::size_t i = 0; i < island.rows(); ++i)
        for (std::size_t j = 0; j < island.rows(); ++j)
          CHECK_NEAR(island.W[island.rows() * i + j], dense[m * island.row[i] + island.row[j]], 1e-12);
    }
  }
}

// Displacements are products of turns and slides about the axes at the start, and the poses after them follow
// from coordinates. Breaks when the order of dofs, of a ball or of a reversed joint differs, or a point.
TEST(displacements_of_trees_lead_to_the_poses_of_their_coordinates) {
  OddTrees t;
  const double h = 0.4;
  std::vector<double> rates(t.tree->parent().size());
  for (double& rate : rates) rate = 2 * t.random();
  std::vector<Flow> momenta;
  make_momenta(t.setting(h), rates, h, t.step, momenta);
  std::vector<Transform> poses;
  for (std::size_t i = 0; i < t.tree->moving().size(); ++i) {
    const TreePlace& place = t.step.places[i];
    const Transform& moved = t.memory.moved[i];
    poses.push_back({place.reference + moved(place.pose.position - place.reference),
                     moved.rotation * place.pose.rotation});
  }
  const Transform driven = moved(t.frames[5], t.start[5], h);
  t.state.positions[5] = driven.position;
  t.state.orientations[5] = driven.rotation;
  move_trees(t.setting(h), t.start, rates, rates, t.step, t.state);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Transform& there = t.step.places[i].pose;
    CHECK_NEAR(norm(there.position - poses[i].position), 0, 1e-13);
    CHECK_NEAR(norm((conjugate(there.rotation) * poses[i].rotation).vector()), 0, 1e-13);
  }
}

// M q'' + c = 0 at the mean of the rates before and after, up to h^2: the momentum balance over displacements
// has the velocity terms of the equations of motion. A term missing leaves an error that does not fall.
TEST(free_trees_obey_the_equations_of_motion_at_second_order) {
  OddTrees t;
  const std::vector<BodyImpulse> loads(6);
  const std::vector<double> before = t.rates(t.start), q = read_coordinates(*t.tree, t.state).q;
  double last = 0;
  for (const double h : {1e-3, 5e-4}) {
    make_tree_masses(t.setting(h), t.state, t.step);
    BodyVelocities free = t.start;
    make_free_tree_velocities(t.setting(h), loads, t.step, free);
    foresee_tree_velocities(t.setting(h), {}, t.step, free);
    const std::vector<double> after = t.rates(free);
    std::vector<double> mean, rise;
    for (std::size_t i = 0; i < before.size(); ++i) {
      mean.push_back(0.5 * (before[i] + after[i]));
      rise.push_back((after[i] - before[i]) / h);
    }
    double error = 0;
    for (const double x : inverse_dynamics(*t.tree, t.state, t.pose(), q, mean, rise))
      error = std::max(error, std::abs(x));
    CHECK(error < 1e-3);
    if (last > 0) CHECK(last / error > 3.5);
    last = error;
  }
}
