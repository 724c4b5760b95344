#include <algorithm>
#include <cmath>
#include <vector>

#include "amontons/problem/linkage.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;
using small::Vector;

namespace {

// What R is made of in each block.
enum class Kind { regular, singular, zero, scaled };

Vector random_factor(const Problem& p, const ShiftedSystem& system, Kind kind, unsigned seed) {
  small::Random random(seed);
  Vector R(system.factor_size());
  for_each_block(p.K, [&]<class S>(const S&, std::size_t block, std::size_t) {
    double* r = &R[system.factor_offset(block)];
    constexpr int n = S::dim;
    if (kind == Kind::zero) return;
    for (int i = 0; i < n * n; ++i) r[i] = random.normal();
    if (kind == Kind::scaled)
      for (int i = 0; i < n * n; ++i) r[i] *= std::pow(10.0, static_cast<double>(block % 7) - 3);
    if (kind == Kind::singular && block % 3 == 0)
      std::fill(r, r + n * n, 0.0);
    else if (kind == Kind::singular && n == 3)
      for (int i = 0; i < n; ++i) r[n * i + 2] = r[n * i] - r[n * i + 1];  // rank 2
  });
  return R;
}

// The block diagonal matrix R, row-major m x m.
Vector full_factor(const Problem& p, const ShiftedSystem& system, const Vector& R) {
  const std::size_t m = p.rows();
  Vector full(m * m);
  for_each_block(p.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int i = 0; i < S::dim; ++i)
      for (int j = 0; j < S::dim; ++j)
        full[(row + i) * m + row + j] = R[system.factor_offset(block) + S::dim * i + j];
  });
  return full;
}

Vector times(const Vector& A, const Vector& x, bool transposed = false) {
  const std::size_t m = x.size();
  Vector y(m);
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < m; ++j) y[i] += (transposed ? A[j * m + i] : A[i * m + j]) * x[j];
  return y;
}

double norm(const Vector& x) {
  double sum = 0;
  for (double v : x) sum += v * v;
  return std::sqrt(sum);
}

// (I + R'AR) z = q with the dense matrix A, and y = R z: the residual against the size of its terms.
void check_solve(const Problem& p, ShiftedSystem& system, Kind kind, unsigned seed, int refinements) {
  const Vector A = small::dense_matrix(p.A), R = random_factor(p, system, kind, seed);
  const Vector full = full_factor(p, system, R), q = small::Random(seed + 9).vector(p.rows());
  system.factor(R);
  Vector z(p.rows()), y(p.rows()), expected_y(p.rows());
  system.solve_reduced(q, z, refinements);
  const Vector RARz = times(full, times(A, times(full, z)), true);
  Vector error(p.rows());
  for (std::size_t i = 0; i < error.size(); ++i) error[i] = z[i] + RARz[i] - q[i];
  // Woodbury loses digits in proportion to |R'AR|, some 1e8 times for the scaled factors; refinements get
  // them back.
  const double lost = kind == Kind::scaled ? 1e-5 : 1e-11, refined = kind == Kind::scaled ? 1e-9 : 1e-12;
  CHECK_NEAR(norm(error) / (norm(q) + norm(RARz)), 0, refinements ? refined : lost);

  // times_factor and times_transposed_factor are R and R', also in place.
  Vector out = q;
  system.times_factor(out, out);
  expected_y = times(full, q);
  for (std::size_t i = 0; i < out.size(); ++i)
    CHECK_NEAR(out[i], expected_y[i], 1e-13 * (1 + norm(expected_y)));
  out = q;
  system.times_transposed_factor(out, out);
  const Vector expected_q = times(full, q, true);
  for (std::size_t i = 0; i < out.size(); ++i)
    CHECK_NEAR(out[i], expected_q[i], 1e-13 * (1 + norm(expected_q)));

  // solve() for r: y = R z with z for R' r; in range(R), and R'(A y - r) + z = 0.
  const Vector& r = q;
  system.solve(r, y, refinements);
  Vector zr(p.rows());
  system.solve_reduced(expected_q, zr, refinements);
  expected_y = times(full, zr);
  for (std::size_t i = 0; i < y.size(); ++i) CHECK_NEAR(y[i], expected_y[i], 1e-9 * (1 + norm(expected_y)));
}

// (J + A R) z = q with J far from symmetric.
void check_solve_with_J(const Problem& p, ShiftedSystem& system, Kind kind, unsigned seed, int refinements) {
  const Vector A = small::dense_matrix(p.A), R = random_factor(p, system, kind, seed);
  const Vector full = full_factor(p, system, R), q = small::Random(seed + 9).vector(p.rows());
  Vector J = random_factor(p, system, Kind::regular, seed + 1);
  for_each_block(p.K, [&]<class S>(const S&, std::size_t block, std::size_t) {
    double* of_block = &J[system.factor_offset(block)];
    for (int i = 0; i < S::dim * S::dim; ++i) of_block[i] = 0.25 * of_block[i] + (i % (S::dim + 1) == 0);
  });
  system.factor(R, J);
  Vector z(p.rows());
  system.solve_reduced(q, z, refinements);
  const Vector ARz = times(A, times(full, z)), Jz = times(full_factor(p, system, J), z);
  Vector error(p.rows());
  for (std::size_t i = 0; i < error.size(); ++i) error[i] = Jz[i] + ARz[i] - q[i];
  CHECK_NEAR(norm(error) / (norm(q) + norm(ARz)), 0, refinements ? 1e-11 : 1e-9);
}

int sign_of_determinant(Vector M, std::size_t m) {
  int sign = 1;
  for (std::size_t k = 0; k < m; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < m; ++i)
      if (std::abs(M[m * i + k]) > std::abs(M[m * best + k])) best = i;
    for (std::size_t j = 0; j < m; ++j) std::swap(M[m * k + j], M[m * best + j]);
    if ((best != k) != (M[(m + 1) * k] < 0)) sign = -sign;
    for (std::size_t i = k + 1; i < m; ++i)
      for (std::size_t j = m; j-- > k;) M[m * i + j] -= M[m * i + k] / M[(m + 1) * k] * M[m * k + j];
  }
  return sign;
}

// Both signs: of each block in turn J is turned round, which is more than A R of a small R.
void check_sign(const Problem& p, ShiftedSystem& system) {
  const std::size_t m = p.rows();
  const Vector A = small::dense_matrix(p.A), some = random_factor(p, system, Kind::regular, 3);
  for (std::size_t turned = 0; turned <= p.K.blocks(); ++turned) {
    Vector R = some, J(R.size(), 0.0);
    for (double& r : R) r *= 0.3;
    for_each_block(p.K, [&]<class S>(const S&, std::size_t block, std::size_t) {
      for (int i = 0; i < S::dim; ++i)
        J[system.factor_offset(block) + (S::dim + 1) * i] = block == turned ? -2 : 1;
    });
    system.factor(R, J);
    Vector M(m * m);
    for (std::size_t k = 0; k < m; ++k) {
      Vector unit(m, 0.0);
      unit[k] = 1;
      const Vector column = times(A, times(full_factor(p, system, R), unit));
      const Vector of_J = times(full_factor(p, system, J), unit);
      for (std::size_t i = 0; i < m; ++i) M[m * i + k] = column[i] + of_J[i];
    }
    CHECK(system.sign() == sign_of_determinant(std::move(M), m));
  }
}

// A floating base (coordinates 0 to 5) with an arm of eight, which is more than a node has, and a leg of two.
// The links touch the ground, each other and a free ball; a compliant row acts on one of them. L and D of M =
// L'DL are random: the factors need no more of a tree than where it branches.
Problem touching_tree() {
  small::Random random(12);
  auto trees = std::make_shared<Linkage>();
  for (Index k = 0; k < 16; ++k) {
    trees->parent.push_back(k == 14 ? 5 : k - 1);
    trees->run.push_back(k == 14 ? 1 : k == 15 ? 2 : k + 1);
    for (double& entry : trees->column.emplace_back()) entry = random.normal();
    trees->inverse_root.push_back(0.5 + random.uniform());
    trees->first.push_back(trees->rows.size());
    trees->rows.push_back(std::pow(trees->inverse_root.back(), -2));
    for (Index above = trees->parent.back(); above >= 0; above = trees->parent[above])
      trees->rows.push_back(0.3 * random.normal());
  }
  trees->first.push_back(trees->rows.size());
  // The base, the third and the last link of the arm, the end of the leg; body 4 is the ball.
  trees->body = {0, 1, 2, 3};
  trees->last = {5, 8, 13, 15};
  trees->number = {0, 1, 2, 3, -1};
  ContactSystem A;
  for (int i = 0; i < 5; ++i) small::add_body(A, 1 + i, {0.1, 0.2 + i, 0.3});
  for (int i = 0; i < 4; ++i) trees->arm.push_back({0.2, 0.1 * i, -0.3});
  const std::shared_ptr<const Linkage> kept = trees;
  A.constrained = std::make_shared<ConstrainedBodies>(
      ConstrainedBodies{trees->body, [kept](double* w) { kept->move(w); }, kept});
  for (const auto& [a, b] : {std::pair<Index, Index>{2, -1}, {3, -1}, {2, 4}, {4, 0}, {1, 3}, {0, -1}}) {
    A.contacts.push_back(contact_between(a, b, {0.1, 0.2, 0}, {0, 0.1, 0.3}, {0.6, 0, 0.8}));
    A.contact_compliance.push_back(0);
  }
  JacobianRow row{1, 2, {}, {}};
  for (double& entry : row.b) entry = random.normal();
  A.jacobian.push_back(row);
  A.compliance.push_back(0.2);
  SetProduct K;
  K.add_each<Friction>(Vector(A.contacts.size(), 0.5));
  K.append(Bilateral{});
  return make_problem(A, random.vector(19), K);
}

std::vector<small::Case> cases() {
  std::vector<small::Case> list = small::contact_cases();
  for (small::Case& c : small::bilateral_cases()) list.push_back(std::move(c));
  list.push_back({"a tree that touches the ground, itself and a ball", touching_tree()});
  return list;
}

}  // namespace

// Breaks when the body-space or impulse-space factorisation is not that of I + R'AR: every kind of operator,
// compliant and rigid, fixed bodies, rows without bodies, R regular, singular, zero, and over six decades.
TEST(solves_the_reduced_system) {
  for (const small::Case& c : cases()) {
    ShiftedSystem system(c.problem);
    for (Kind kind : {Kind::regular, Kind::singular, Kind::zero, Kind::scaled})
      for (int refinements : {0, 1, 2}) check_solve(c.problem, system, kind, 3, refinements);
    check_solve(c.problem, system, Kind::regular, 4, 0);  // another R in the same system
  }
}

// Breaks when a block of the upper triangle goes to the lower one or to another place, when J is transposed,
// or when a symmetric factorisation after one that is not finds its remains.
TEST(solves_the_system_without_symmetry) {
  for (const small::Case& c : cases()) {
    ShiftedSystem system(c.problem);
    for (Kind kind : {Kind::regular, Kind::singular, Kind::zero})
      for (int refinements : {0, 1}) check_solve_with_J(c.problem, system, kind, 3, refinements);
    check_solve(c.problem, system, Kind::regular, 4, 0);
  }
}

// Breaks when a negative pivot, or a block whose determinant is negative, is not counted once.
TEST(tells_the_sign_of_the_determinant) {
  for (const small::Case& c : cases()) {
    ShiftedSystem system(c.problem);
    check_sign(c.problem, system);
  }
}

// With a regular R: (A + Theta^-1) y = r itself, Theta = R R'. Here R is a multiple of the unit per block.
// Breaks when R and its inverse, or Theta and its root, are mixed up.
TEST(solves_the_shifted_system) {
  for (const small::Case& c : cases()) {
    const Problem& p = c.problem;
    ShiftedSystem system(p);
    Vector R(system.factor_size()), weights(p.rows());
    for_each_block(p.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      const double rho = 0.1 * (1 + block % 3);
      for (int k = 0; k < S::dim; ++k) {
        weights[row + k] = rho;
        R[system.factor_offset(block) + (S::dim + 1) * k] = 1 / std::sqrt(rho);
      }
    });
    system.factor(R);
    const Vector r = small::Random(5).vector(p.rows());
    Vector y(p.rows()), Ay(p.rows());
    system.solve(r, y, 1);
    product(p.A, y, Ay);
    for (std::size_t i = 0; i < y.size(); ++i) CHECK_NEAR(Ay[i] + weights[i] * y[i], r[i], 1e-11 * norm(Ay));
  }
}

// Breaks when the two spaces give different solutions: the same A as bodies and as a matrix.
TEST(body_space_equals_impulse_space) {
  for (const small::Case& c : cases()) {
    const Problem& p = c.problem;
    if (!std::holds_alternative<ContactSystem>(p.A) && !std::holds_alternative<ContactSystem>(p.A)) continue;
    const Vector A = small::dense_matrix(p.A);
    const Problem dense = make_problem(small::dense_operator(A, p.rows()), p.b, p.K);
    const Problem sparse = make_problem(small::sparse_operator(A, p.rows()), p.b, p.K);
    ShiftedSystem bodies(p), full(dense), pairs(sparse);
    CHECK(bodies.in_body_space() && !full.in_body_space() && !pairs.in_body_space());
    const Vector R = random_factor(p, bodies, Kind::regular, 6), q = small::Random(7).vector(p.rows());
    Vector z[3];
    ShiftedSystem* systems[] = {&bodies, &full, &pairs};
    for (int i = 0; i < 3; ++i) {
      z[i].resize(p.rows());
      systems[i]->factor(R);
      systems[i]->solve_reduced(q, z[i], 1);
    }
    for (std::size_t i = 0; i < q.size(); ++i) {
      CHECK_NEAR(z[0][i], z[1][i], 1e-10 * norm(z[0]));
      CHECK_NEAR(z[2][i], z[1][i], 1e-10 * norm(z[0]));
    }
  }
}

// Breaks when q and z may not be the same memory, as the header says they may.
TEST(solves_in_place) {
  const Problem p = small::mechanism();
  ShiftedSystem system(p);
  system.factor(random_factor(p, system, Kind::regular, 1));
  const Vector q = small::Random(2).vector(p.rows());
  Vector apart(p.rows()), in_place = q;
  for (int refinements : {0, 2}) {
    system.solve_reduced(q, apart, refinements);
    in_place = q;
    system.solve_reduced(in_place, in_place, refinements);
    CHECK(in_place == apart);
    system.solve(q, apart, refinements);
    in_place = q;
    system.solve(in_place, in_place, refinements);
    CHECK(in_place == apart);
  }
}

// Breaks when a problem in which nothing moves, or with no rows at all, is not handled: then z = q.
TEST(nothing_moves) {
  ContactSystem A;
  small::add_fixed_body(A);
  A.contacts.push_back(contact_between(0, -1, {0, 0, 0}, {0, 0, 0}, {0, 0, 1}));
  A.contact_compliance = {0};
  SetProduct K;
  K.add_each<Friction>(Vector{0.5});
  const Problem p = make_problem(A, {0.1, 0, 0}, K);
  ShiftedSystem system(p);
  CHECK(system.in_body_space());
  const Vector q{1, 2, 3};
  Vector z(3);
  system.factor(random_factor(p, system, Kind::regular, 1));
  system.solve_reduced(q, z, 1);
  CHECK(z == q);

  const Problem empty = make_problem(ContactSystem{}, {}, {});
  ShiftedSystem none(empty);
  none.factor({});
  none.solve_reduced({}, {}, 1);
}

// Breaks when a function is factored as if it were a matrix of zeros instead of being refused by name.
TEST(callback_cannot_be_factored) {
  const Problem p = small::as_callback(small::stack(2));
  CHECK_THROWS(ShiftedSystem(p), "factors A");
}
