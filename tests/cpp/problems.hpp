#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "amontons/base/budget.hpp"
#include "amontons/problem/problem.hpp"
#include "random.hpp"
#include "vectors.hpp"

// Small problems for the tests, each with what makes it hard.
namespace small {

using namespace amontons;

// For methods that are called directly.
inline Budget no_limit;

struct Case {
  std::string name;
  Problem problem;
};

class Random : public Draws {
 public:
  using Draws::Draws;
  Vector vector(std::size_t n) {
    Vector v(n);
    for (double& value : v) value = normal();
    return v;
  }
};

// Row-major A by products with unit vectors.
inline Vector dense_matrix(const Operator& A) {
  const std::size_t m = rows(A);
  Vector matrix(m * m), e(m), column(m);
  for (std::size_t j = 0; j < m; ++j) {
    e[j] = 1;
    product(A, e, column);
    e[j] = 0;
    for (std::size_t i = 0; i < m; ++i) matrix[i * m + j] = column[i];
  }
  return matrix;
}

inline DenseOperator dense_operator(Vector matrix, std::size_t m) {
  auto owner = std::make_shared<Vector>(std::move(matrix));
  return {*owner, m, owner};
}

// The entries of a dense matrix that are not zero.
inline SparseOperator sparse_operator(const Vector& matrix, std::size_t m) {
  struct Arrays {
    std::vector<Index> indptr{0}, indices;
    Vector data;
  };
  auto owner = std::make_shared<Arrays>();
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j < m; ++j)
      if (matrix[i * m + j] != 0) {
        owner->indices.push_back(static_cast<Index>(j));
        owner->data.push_back(matrix[i * m + j]);
      }
    owner->indptr.push_back(static_cast<Index>(owner->indices.size()));
  }
  return {owner->indptr, owner->indices, owner->data, owner};
}

// The operator of a problem as a function, which no method can look into.
inline Problem as_callback(const Problem& p) {
  CallbackOperator A;
  A.diag.resize(p.rows());
  diagonal(p.A, A.diag);
  auto inner = std::make_shared<Operator>(p.A);
  A.function = [inner](std::span<const double> x, std::span<double> y) { product(*inner, x, y); };
  return make_problem(std::move(A), p.b, p.K);
}

// B B' with B m x rank: symmetric positive semidefinite of that rank.
inline Vector gram_matrix(Random& random, std::size_t m, std::size_t rank) {
  const Vector B = random.vector(m * rank);
  Vector A(m * m);
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < m; ++j)
      for (std::size_t k = 0; k < rank; ++k)
        A[i * m + j] += B[i * rank + k] * B[j * rank + k] / static_cast<double>(rank);
  return A;
}

// D v for stored rows; v holds six velocities per body.
inline Vector row_velocities(const ContactSystem& A, const Vector& v) {
  Vector b;
  for (const JacobianRow& row : A.jacobian) {
    double sum = 0;
    for (int k = 0; k < 6; ++k) {
      if (row.body_a >= 0) sum += row.a[k] * v[6 * row.body_a + k];
      if (row.body_b >= 0) sum += row.b[k] * v[6 * row.body_b + k];
    }
    b.push_back(sum);
  }
  return b;
}

inline void add_body(ContactSystem& A, double mass, std::array<double, 3> inertia) {
  A.bodies.inverse_mass.push_back(1 / mass);
  A.bodies.inverse_inertia.push_back({1 / inertia[0], 1 / inertia[1], 1 / inertia[2], 0, 0, 0});
}

inline void add_fixed_body(ContactSystem& A) {
  A.bodies.inverse_mass.push_back(0);
  A.bodies.inverse_inertia.push_back({});
}

// The three rows that hold two points together.
inline void add_ball_joint(ContactSystem& A, Index a, Index b, std::array<double, 3> r_a,
                           std::array<double, 3> r_b, double compliance = 0) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    JacobianRow row{a, b, {}, {}};
    row.a[k] = 1, row.b[k] = -1;
    row.a[3 + i] = r_a[j], row.a[3 + j] = -r_a[i];
    row.b[3 + i] = -r_b[j], row.b[3 + j] = r_b[i];
    A.jacobian.push_back(row);
    A.compliance.push_back(compliance);
  }
}

// Boxes of 1 x 1 x 0.5 m on the ground, four contacts per interface: hyperstatic. Every other box has `ratio`
// times the mass; box i moves sideways at i * push (m/s).
inline Problem stack(int boxes, double ratio = 1, double push = 0.05, double mu = 0.5,
                     double compliance = 0) {
  ContactSystem A;
  Vector v;
  for (int i = 0; i < boxes; ++i) {
    const double mass = i % 2 ? ratio : 1.0;
    add_body(A, mass, {mass * 0.104, mass * 0.104, mass * 0.167});
    v.insert(v.end(), {i * push, 0.3 * i * push, -0.0981, 0, 0, 0});
    for (double x : {-0.5, 0.5})
      for (double y : {-0.5, 0.5}) {
        A.contacts.push_back(contact_between(i, i - 1, {x, y, -0.25}, {x, y, i > 0 ? 0.25 : 0.0}, {0, 0, 1}));
        A.contact_compliance.push_back(compliance);
      }
  }
  Vector b = row_velocities(A.stored(), v);
  SetProduct K;
  K.add_each<Friction>(Vector(A.contacts.size(), mu));
  return make_problem(std::move(A), std::move(b), std::move(K));
}

// Rods of 1 m joined end to end and to the world, all rows bilateral. `closed` joins the last end to the
// world too; `repeated` writes the first joint twice, which makes A singular and the system consistent.
inline Problem chain(int rods, bool closed = false, bool repeated = false) {
  ContactSystem A;
  Random random(7);
  for (int i = 0; i < rods; ++i) {
    const double mass = 1 + i % 3;
    add_body(A, mass, {mass * 0.01, mass * 0.084, mass * 0.084});
    add_ball_joint(A, i, i - 1, {-0.5, 0, 0.02}, {0.5, i > 0 ? 0.0 : 0.1, 0});
  }
  if (closed) add_ball_joint(A, rods - 1, -1, {0.5, 0, 0}, {0, 0, 0});
  if (repeated) add_ball_joint(A, 0, -1, {-0.5, 0, 0.02}, {0.5, 0.1, 0});
  Vector b = row_velocities(A, random.vector(6 * rods));
  SetProduct K;
  K.add_count<Bilateral>(A.rows());
  return make_problem(std::move(A), std::move(b), std::move(K));
}

// Bodies that touch only the world or a fixed body, so that body space has no coupling; one contact joins
// nothing that moves (zero rows of A) and separates.
inline Problem world_contacts(int bodies) {
  ContactSystem A;
  Random random(3);
  Vector v, mu;
  for (int i = 0; i < bodies; ++i) {
    add_body(A, random.uniform(0.5, 2), {0.1, 0.2, 0.15});
    v.insert(v.end(), {random.normal(), random.normal(), -1 + 0.3 * random.normal(), 0.1, 0, -0.2});
  }
  const Index fixed = bodies;
  add_fixed_body(A);
  v.insert(v.end(), 6, 0.0);
  for (int i = 0; i < bodies; ++i)
    for (int k = 0; k < 3; ++k) {
      const double angle = 2.1 * k + 0.3 * i;
      const double tilt = 0.3 * std::sin(1.0 + i + k), z = std::sqrt(1 - tilt * tilt);
      A.contacts.push_back(contact_between(i, i % 2 ? -1 : fixed,
                                           {0.4 * std::cos(angle), 0.4 * std::sin(angle), -0.3},
                                           {0.1, 0.2, 0.3}, {tilt, 0, z}));
      const double values[] = {0.0, 0.2, 0.6, 1.5};
      mu.push_back(values[random.below(4)]);
    }
  A.contacts.push_back(contact_between(fixed, -1, {0.1, 0, 0}, {0, 0, 0}, {0, 0, 1}));
  mu.push_back(0.4);
  A.contact_compliance.assign(A.contacts.size(), 0);
  Vector b = row_velocities(A.stored(), v);
  b[b.size() - 3] = 0.1, b[b.size() - 2] = 0.01;
  SetProduct K;
  K.add_each<Friction>(mu);
  return make_problem(std::move(A), std::move(b), std::move(K));
}

// A stack whose boxes are also joined by a ball joint, a motor of limited effort, a cable (unilateral row)
// and a bounded row with one open side: every kind of row next to contacts, some compliant.
inline Problem mechanism() {
  const Problem boxes = stack(4, 2, 0.05, 0.4, 0.01);
  ContactSystem A = std::get<ContactSystem>(boxes.A);
  ContactSystem& joints = A;
  add_ball_joint(joints, 1, 3, {0.5, 0, 0.1}, {0.5, 0, -0.9}, 1e-4);
  const auto row = [&](Index a, Index b, std::array<double, 6> ja, std::array<double, 6> jb) {
    joints.jacobian.push_back({a, b, ja, jb});
    joints.compliance.push_back(0);
  };
  row(2, 0, {0, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, -1});
  row(3, -1, {0.6, 0, -0.8, 0, 0.2, 0}, {});
  row(0, -1, {0, 1, 0, 0, 0, 0.3}, {});
  row(2, 1, {1, 0, 0, 0, 0.25, 0}, {-1, 0, 0, 0, 0.25, 0});
  SetProduct K;
  K.append(std::span(boxes.K.all<Friction>()));
  K.add_count<Bilateral>(3);
  K.add_each<Interval>(Vector{-0.02, -INFINITY, 0.01}, Vector{0.02, 0.0, 0.01});
  K.add_count<NonNegative>(1);
  Vector b = boxes.b;
  b.insert(b.end(), {0.1, -0.05, 0.02, 0.5, 0.1, -0.3, -0.2});
  return make_problem(std::move(A), std::move(b), std::move(K));
}

// A random positive definite matrix and all kinds of cones in mixed order.
inline SetProduct mixed_cones() {
  SetProduct K;
  K.add_count<Bilateral>(2);
  K.add_each<Friction>(Vector{0.0, 0.3, 1.0});
  K.add_count<NonNegative>(3);
  K.add_each<Interval>(Vector{-0.1, 0.05, -INFINITY, 0.2}, Vector{0.1, INFINITY, 0.3, 0.2});
  K.add_each<Friction>(Vector{5.0, 1e-12});
  K.add_count<Bilateral>(1);
  return K;
}

inline Problem random_mixed(unsigned seed, bool sparse) {
  Random random(seed);
  SetProduct K = mixed_cones();
  const std::size_t m = K.rows();
  Vector A = gram_matrix(random, m, 2 * m);
  for (std::size_t i = 0; i < m; ++i) A[(m + 1) * i] += 0.1;
  if (sparse)  // a far corner without coupling; damping the diagonal keeps the rest definite
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t j = 0; j < m; ++j)
        if (i != j && (i + j) % 3 == 0) A[m * i + j] = 0;
  if (sparse)
    for (std::size_t i = 0; i < m; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < m; ++j) sum += i == j ? 0.0 : std::abs(A[m * i + j]);
      A[(m + 1) * i] = std::max(A[(m + 1) * i], 0.9 * sum);
    }
  Vector b = random.vector(m);
  if (sparse) return make_problem(sparse_operator(A, m), std::move(b), std::move(K));
  return make_problem(dense_operator(std::move(A), m), std::move(b), std::move(K));
}

// One point mass on a plane, A = I: b_n < 0 approaches, b_t slides.
inline Problem one_contact(double mu, double b_n, double b_t) {
  SetProduct K;
  K.add_each<Friction>(Vector{mu});
  return make_problem(dense_operator({1, 0, 0, 0, 1, 0, 0, 0, 1}, 3), {b_n, b_t, 0}, std::move(K));
}

inline Problem one_row(SetProduct K, double a, double b) {
  return make_problem(dense_operator({a}, 1), {b}, std::move(K));
}

// Problems that every method for inequalities solves, also projected Jacobi.
inline std::vector<Case> contact_cases() {
  std::vector<Case> cases;
  cases.push_back({"stack at rest", stack(5, 1, 0)});
  cases.push_back({"sliding stack", stack(3, 2, 0.05)});
  cases.push_back({"compliant stack", stack(4, 2, 0.05, 0.5, 0.01)});
  cases.push_back({"world contacts", world_contacts(4)});
  cases.push_back({"mechanism", mechanism()});
  cases.push_back({"dense mixed", random_mixed(1, false)});
  cases.push_back({"sparse mixed", random_mixed(2, true)});
  cases.push_back({"one sticking contact", one_contact(0.5, -1, 0.3)});
  cases.push_back({"one sliding contact", one_contact(0.5, -1, 2)});
  cases.push_back({"one open contact", one_contact(0.5, 1, 0.1)});
  return cases;
}

// Problems for the second-order methods: mass ratios, much sliding, no friction and much of it, redundancy.
inline std::vector<Case> hard_cases() {
  std::vector<Case> cases;
  cases.push_back({"sliding stack 1:10", stack(5, 10, 0.3)});
  cases.push_back({"stack 1:100", stack(8, 100, 0.001)});
  cases.push_back({"slippery stack", stack(4, 3, 0.2, 0.0)});
  cases.push_back({"rough stack", stack(4, 3, 0.2, 2.0)});
  return cases;
}

// Problems that are linear systems.
inline std::vector<Case> bilateral_cases() {
  std::vector<Case> cases;
  cases.push_back({"chain", chain(8)});
  cases.push_back({"closed chain", chain(6, true)});
  cases.push_back({"singular chain", chain(6, false, true)});
  return cases;
}

// W of an island in factors (ThinMatrix), row by row.
template <class Thin>
void fill(const Thin& thin, std::vector<double>& W) {
  W.clear();
  for (std::size_t i = 0; i < thin.rows(); ++i) {
    std::vector<double> unit(thin.rows(), 0.0), row(thin.rows(), 0.0);
    unit[i] = 1;
    thin.add_product(unit, row);
    W.insert(W.end(), row.begin(), row.end());
  }
}

}  // namespace small
