#pragma once
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/joints/joint_context.hpp"
#include "vectors.hpp"

// Small mechanisms for the tests of joints, stepped with dense matrices that are put together here from the
// rows.
namespace joint_scene {

using namespace amontons;

struct Random {
  std::mt19937 engine{20240517};
  double operator()(double lo = -1, double hi = 1) {
    return lo + (hi - lo) * (static_cast<double>(engine()) / 4294967296.0);
  }
  Vec3 vector(double size = 1) {
    const double x = (*this)(), y = (*this)(), z = (*this)();
    return size * Vec3{x, y, z};
  }
  Vec3 unit() { return normalised(vector() + Vec3{0, 0, 1e-3}); }
  Transform transform(double size = 1) {
    const Vec3 position = vector(size);
    return {position, exponential(vector(2))};
  }
};

// A dynamic body whose centre of mass and inertia have no symmetry.
inline Body odd_body(Random& random, const Transform& pose) {
  Body body;
  body.mass = random(0.5, 2);
  body.centre_of_mass = random.vector(0.3);
  const Mat3 turn = to_matrix(exponential(random.vector(2)));
  body.inertia = turn * Mat3::diagonal(0.2, 0.25, 0.3) * transposed(turn);
  body.pose = pose;
  body.linear_velocity = random.vector();
  body.angular_velocity = random.vector();
  return body;
}

// Mass and inertia of 1, centre of mass at the origin: closed forms stay short.
inline Body unit_body(const Transform& pose = {}, Motion motion = Motion::dynamic) {
  Body body;
  body.motion = motion;
  body.mass = 1;
  body.inertia = Mat3::identity();
  body.pose = pose;
  return body;
}

inline Dof hinge(const Vec3& axis, const Vec3& anchor = {}) {
  Dof dof;
  dof.axis = normalised(axis), dof.anchor = anchor;
  return dof;
}
inline Dof slide(const Vec3& axis) {
  Dof dof = hinge(axis);
  dof.kind = Dof::Kind::slide;
  return dof;
}
inline Joint joint_of(Index a, Index b, std::vector<Dof> dofs, bool spherical = false) {
  Joint joint;
  joint.body_a = a, joint.body_b = b;
  joint.dofs = std::move(dofs), joint.spherical = spherical;
  return joint;
}

// A floating base, chains of mixed dofs, a ball, a joint whose B hangs on its A, and a driven body.
inline ModelDescription odd_trees(Random& random) {
  ModelDescription d;
  for (int i = 0; i < 6; ++i) d.bodies.push_back(odd_body(random, random.transform()));
  d.bodies[5].motion = Motion::kinematic;
  const auto add = [&](Index a, Index b, std::vector<Dof> dofs, bool ball = false) {
    Joint joint = joint_of(a, b, std::move(dofs), ball);
    joint.frame_a = random.transform(0.5);
    joint.frame_b = random.transform(0.5);
    d.joints.push_back(joint);
  };
  add(1, 0, {hinge(random.unit(), random.vector()), slide(random.unit()), hinge(random.unit())});
  add(0, 2, {slide(random.unit())}, true);  // body 2 moves
  add(3, 2, {}, true);
  add(4, 5, {hinge(random.unit())});  // on a body that keeps its velocity
  d.joints[0].dofs[0].armature = 0.3;
  return d;
}

// T(q) written down once more, from the definition, as the oracle of the library's.
inline Transform product_of_exponentials(const Joint& joint, const std::vector<double>& q) {
  Transform t;
  for (std::size_t i = 0; i < joint.dofs.size(); ++i) {
    const Dof& dof = joint.dofs[i];
    if (dof.kind == Dof::Kind::slide) {
      t = t * Transform{q[i] * dof.axis, {}};
    } else {
      const Quat turn = exponential(q[i] * dof.axis);
      t = t * Transform{dof.anchor, {}} * Transform{{}, turn} * Transform{-dof.anchor, {}};
    }
  }
  return t;
}

struct Scene {
  ModelDescription description;
  std::unique_ptr<Model> model;
  State state;
  std::vector<BodyFrame> bodies;
  std::vector<BodyMobility> mobility;
  std::vector<BodyVelocity> start, free;
  std::vector<GyroscopicSpin> spins;
  JointContexts joints;
  JointRows rows;
  JointOptions options{0.01, 1e300, 1};

  void build() {
    description.gravity = {};
    model = std::make_unique<Model>(description);
    options.length = model->length();
    state = initial_state(*model);
    refresh();
  }
  // Frames, coordinates and rows of the present state.
  void refresh() {
    place_bodies(*model, state, bodies, mobility, start);
    update_coordinates(*model, bodies, state);
    std::vector<BodyImpulse> loads(model->bodies());
    place_joints(*model, bodies, state, joints);
    add_motor_loads(*model, joints, state.controls, options.h, loads);
    make_free_velocities({*model, options.h, options.h, bodies, mobility, start, loads, true}, free, spins);
    rows.clear();
    append_joint_rows(*model, {bodies, mobility, start, free}, joints, state, options, rows);
  }
  std::size_t count(RowKind kind) const {
    return static_cast<std::size_t>(
        std::count_if(rows.tags.begin(), rows.tags.end(), [&](const RowTag& t) { return t.kind == kind; }));
  }
  std::size_t find(RowKind kind) const {
    std::size_t i = 0;
    while (i < rows.tags.size() && rows.tags[i].kind != kind) ++i;
    return i;
  }
  double inverse_mass(Index body, const std::array<double, 6>& i, const std::array<double, 6>& j) const {
    double sum = 0;
    if (body >= static_cast<Index>(bodies.size())) {
      for (std::size_t k = 0; k < 6; ++k) sum += i[k] * j[k];
      return sum * rows.auxiliary_inverse_mass[body - bodies.size()];
    }
    const auto& [inverse_mass, inverse_inertia, stiffened] = mobility[body];
    const Vec3 spun = inverse_inertia * Vec3{j[3], j[4], j[5]};
    return inverse_mass * (i[0] * j[0] + i[1] * j[1] + i[2] * j[2]) + i[3] * spun.x + i[4] * spun.y +
           i[5] * spun.z;
  }
  double row_velocity(std::size_t i, const std::vector<BodyVelocity>& v) const {
    const JacobianRow& r = rows.jacobian[i];
    double u = 0;
    const auto add = [&](Index body, const std::array<double, 6>& j) {
      if (body < 0 || body >= static_cast<Index>(v.size())) return;
      for (int k = 0; k < 3; ++k) u += j[k] * v[body].linear[k] + j[3 + k] * v[body].angular[k];
    };
    add(r.body_a, r.a), add(r.body_b, r.b);
    return u;
  }
  std::vector<double> dense() const {
    const std::size_t m = rows.jacobian.size();
    std::vector<double> A(m * m);
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t j = 0; j < m; ++j) {
        const JacobianRow &p = rows.jacobian[i], &q = rows.jacobian[j];
        double sum = i == j ? rows.compliance[i] : 0;
        for (const auto& [body, jp] : {std::pair{p.body_a, p.a}, std::pair{p.body_b, p.b}})
          for (const auto& [other, jq] : {std::pair{q.body_a, q.a}, std::pair{q.body_b, q.b}})
            if (body >= 0 && body == other) sum += inverse_mass(body, jp, jq);
        A[i * m + j] = sum;
      }
    return A;
  }
  // The impulses of the VI: by elimination where all rows are free, else projected Gauss-Seidel.
  std::vector<double> solve() const {
    const std::size_t m = rows.jacobian.size();
    std::vector<double> A = dense(), x(m);
    std::vector<double> b(m);
    for (std::size_t i = 0; i < m; ++i) b[i] = row_velocity(i, free) + rows.c[i];
    if (rows.cones.all_bilateral()) {
      for (double& v : b) v = -v;
      return small::solve_dense(std::move(A), std::move(b));
    }
    for (int sweep = 0; sweep < 100000; ++sweep) {
      double change = 0, size = 0;
      for_each_block(rows.cones, [&](const auto& set, std::size_t, std::size_t i) {
        double u = b[i];
        for (std::size_t k = 0; k < m; ++k) u += A[i * m + k] * x[k];
        const double trial[largest_dim] = {x[i] - u / A[i * m + i]};
        double out[largest_dim] = {};
        set.project(trial, out);
        change = std::max(change, std::abs(out[0] - x[i]));
        size = std::max(size, std::abs(out[0]));
        x[i] = out[0];
      });
      if (change <= 1e-15 * size) break;
    }
    return x;
  }
  std::vector<BodyVelocity> velocities_after(const std::vector<double>& x) const {
    std::vector<BodyVelocity> v = free;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const JacobianRow& r = rows.jacobian[i];
      const auto add = [&](Index body, const std::array<double, 6>& j) {
        if (body < 0 || body >= static_cast<Index>(v.size())) return;
        v[body].linear += x[i] * mobility[body].inverse_mass * Vec3{j[0], j[1], j[2]};
        v[body].angular += x[i] * (mobility[body].inverse_inertia * Vec3{j[3], j[4], j[5]});
      };
      add(r.body_a, r.a), add(r.body_b, r.b);
    }
    return v;
  }
  void step() {
    refresh();
    const std::vector<double> x = solve();
    store_joint_impulses(rows, x, state);
    const std::vector<BodyVelocity> v = velocities_after(x);
    const std::vector<double> ahead(model->bodies(), 0.0);  // velocities stay those of the middle
    integrate(*model, bodies, spins, {start, v, options.h, ahead}, state);
    place_bodies(*model, state, bodies, mobility, start);
    update_coordinates(*model, bodies, state);
  }
};

}  // namespace joint_scene
