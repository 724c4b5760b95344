#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "kkt.hpp"
#include "problems.hpp"

using namespace amontons;
using small::Vector;

namespace {

constexpr Law laws[] = {Law::associated, Law::coulomb};
constexpr Norm norms[] = {Norm::natural, Norm::plain, Norm::plain_inf, Norm::siconos};

// A problem with a known solution of the law: any y gives x = Pi_K(y) and g = P (x - y), for which -g is in
// the normal cone of K at x; the De Saxce term is taken out of g, and b = u - A x.
Problem with_known_solution(const Problem& given, Law law, unsigned seed, Vector& x) {
  Problem p = given;
  const Vector y = small::Random(seed).vector(p.rows());
  x.resize(p.rows());
  project(p.K, y, x);
  Vector Ax(p.rows());
  product(p.A, x, Ax);
  for_each_block(p.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double u[S::dim];
    for (int k = 0; k < S::dim; ++k) u[k] = p.P[block] * (x[row + k] - y[row + k]);
    if constexpr (S::frictional) {
      if (law == Law::coulomb) u[0] -= set.de_saxce(u);
    }
    for (int k = 0; k < S::dim; ++k) p.b[row + k] = u[k] - Ax[row + k];
  });
  return p;
}

}  // namespace

// Breaks when a solution is not recognised: one contact with A = I, solutions by hand.
TEST(zero_at_solutions_by_hand) {
  struct {
    double b_n, b_t;
    Law law;
    Vector x;
  } cases[] = {
      {1, 0.5, Law::associated, {0, 0, 0}},        // opens: u_n >= mu |u_t|
      {0.25, 8, Law::coulomb, {0, 0, 0}},          // opens with any slip
      {-1, 0.25, Law::associated, {1, -0.25, 0}},  // sticks, the same under both laws
      {-1, 0.25, Law::coulomb, {1, -0.25, 0}},
      {-1, 2, Law::coulomb, {1, -0.5, 0}},       // slides: u = (0, 1.5, 0)
      {-1, 2, Law::associated, {1.6, -0.8, 0}},  // slides and lifts: u = (0.6, 1.2, 0)
  };
  for (const auto& c : cases) {
    const Problem p = small::one_contact(0.5, c.b_n, c.b_t);
    for (Norm norm : norms) CHECK_NEAR(residual(p, c.law, c.x, norm), 0, 4e-16);
    CHECK(kkt::violation(p, c.law, 1e-15, c.x).empty());
  }
  // No rounding at all where the projection copies: exactly zero.
  for (Law law : laws) CHECK(residual(small::one_contact(0.5, -1, 0.25), law, Vector{1, -0.25, 0}) == 0);
  // A sliding solution of one law is none of the other.
  const Problem p = small::one_contact(0.5, -1, 2);
  CHECK(residual(p, Law::associated, Vector{1, -0.5, 0}) > 0.1);
  CHECK(residual(p, Law::coulomb, Vector{1.6, -0.8, 0}) > 0.1);
  CHECK(!kkt::violation(p, Law::associated, 1e-3, {1, -0.5, 0}).empty());
  CHECK(!kkt::violation(p, Law::coulomb, 1e-3, {1.6, -0.8, 0}).empty());
}

// Breaks when any kind of row, P or the De Saxce term is treated differently from the definition of the law.
TEST(zero_at_constructed_solutions) {
  for (Law law : laws)
    for (const small::Case& c : small::contact_cases())
      for (unsigned seed = 1; seed < 6; ++seed) {
        // Blocks without any moving body have P near zero, so that no u of order one belongs to a normal
        // cone.
        if (c.name == "world contacts") continue;
        Vector x;
        const Problem p = with_known_solution(c.problem, law, seed, x);
        for (Norm norm : norms) CHECK_NEAR(residual(p, law, x, norm), 0, 1e-13);
        CHECK(kkt::violation(p, law, 1e-13, x).empty());
        // And not zero next to it, by about the size of the step.
        Vector off = x;
        const Vector step = small::Random(seed + 50).vector(x.size());
        for (std::size_t i = 0; i < x.size(); ++i) off[i] += 1e-3 * step[i];
        for (Norm norm : norms) CHECK(residual(p, law, off, norm) > 1e-6);
      }
}

// Breaks when the natural residual depends on units: velocities times s, impulses times t.
TEST(natural_residual_has_no_unit) {
  const Problem p = small::random_mixed(4, false);
  const Vector A = small::dense_matrix(p.A), x = small::Random(8).vector(p.rows());
  const double s = 1e3, t = 1e-5;
  Vector scaled_A = A, scaled_b = p.b, scaled_x = x, lo, hi;
  for (const Interval& set : p.K.all<Interval>()) {
    lo.push_back(set.lo);
    hi.push_back(set.hi);
  }
  for (double& v : scaled_A) v *= s / t;
  for (double& v : scaled_b) v *= s;
  for (double& v : scaled_x) v *= t;
  for (double& v : lo) v *= t;
  for (double& v : hi) v *= t;
  SetProduct K;
  K.add_count<Bilateral>(2);
  K.add_each<Friction>(Vector{0.0, 0.3, 1.0});
  K.add_count<NonNegative>(3);
  K.add_each<Interval>(lo, hi);
  K.add_each<Friction>(Vector{5.0, 1e-12});
  K.add_count<Bilateral>(1);
  const Problem scaled = make_problem(small::dense_operator(scaled_A, p.rows()), scaled_b, K);
  for (Law law : laws) {
    const double r = residual(p, law, x);
    CHECK_NEAR(residual(scaled, law, scaled_x), r, 1e-12 * r);
  }
}

// Breaks when a norm is not the one documented: all by hand for A = I, b = (-1, 2, 0), x = 0, mu = 0.5.
TEST(norms_by_hand) {
  const Problem p = small::one_contact(0.5, -1, 2);
  const Vector zero(3, 0.0);
  // Pi_K(1, -2, 0) = (1 + 0.5 * 2) / 1.25 (1, -0.5) = (1.6, -0.8).
  const double plain = std::hypot(1.6, 0.8);
  CHECK(residual(p, Law::associated, zero) == 1);
  CHECK_NEAR(residual(p, Law::associated, zero, Norm::plain), plain, 1e-15);
  CHECK_NEAR(residual(p, Law::associated, zero, Norm::plain_inf), 1.6, 1e-15);
  CHECK_NEAR(residual(p, Law::associated, zero, Norm::siconos), plain / std::hypot(1, 2), 1e-15);
  CHECK_NEAR(natural_map_at_zero(p, Law::associated), plain, 1e-15);
  // Coulomb adds mu |u_t| = 1 to the normal velocity: Pi_K(0, -2, 0) = (0.8, -0.4).
  CHECK_NEAR(residual(p, Law::coulomb, zero, Norm::plain), std::hypot(0.8, 0.4), 1e-15);
  CHECK_NEAR(natural_map_at_zero(p, Law::coulomb), std::hypot(0.8, 0.4), 1e-15);
  // P = 4 for A = 4 I: P^1/2 |Pi_K(-b / 4)| = plain / 2.
  const Problem heavy = make_problem(small::dense_operator({4, 0, 0, 0, 4, 0, 0, 0, 4}, 3), p.b, p.K);
  CHECK_NEAR(natural_map(heavy, Law::associated, zero, p.b), plain / 2, 1e-15);
}

// Breaks when the residual is relative to rounding. Contacts that slide and do not approach have g on the
// boundary of the dual cone, where the projection of -g is zero but for its last bits.
TEST(sliding_contacts_have_a_residual_of_rounding_at_zero) {
  SetProduct K;
  K.add_each<Friction>(Vector(64, 0.3));
  Vector b(192, 0.0), A(192 * 192, 0.0);
  for (std::size_t i = 0; i < 192; ++i) A[193 * i] = 1;
  for (std::size_t i = 0; i < 64; ++i) {
    b[3 * i + 1] = std::cos(static_cast<double>(i));
    b[3 * i + 2] = 0.1 * std::sin(static_cast<double>(i));
  }
  const double root = std::sqrt(std::numeric_limits<double>::epsilon());
  for (const double speed : {1.0, 1e-17}) {
    Vector slow = b;
    for (double& v : slow) v *= speed;
    const Problem p = make_problem(small::dense_operator(A, 192), slow, K);
    CHECK(residual(p, Law::coulomb, Vector(192, 0.0)) < root);
  }
  // An approach of a millionth of the slip still counts in full.
  b[0] = -1e-6;
  CHECK(residual(make_problem(small::dense_operator(A, 192), b, K), Law::coulomb, Vector(192, 0.0)) == 1);
}

// Breaks when x = 0 being the solution divides zero by zero.
TEST(zero_solution_has_zero_residual) {
  for (Law law : laws) {
    CHECK(residual(small::one_contact(0.5, 1, 0.25), law, Vector(3, 0.0)) == 0);
    CHECK(residual(small::one_contact(0.5, 0, 0), law, Vector(3, 0.0)) == 0);
  }
  const Problem empty = make_problem(small::dense_operator({}, 0), {}, {});
  for (Norm norm : norms) CHECK(residual(empty, Law::coulomb, Vector{}, norm) == 0);
}

// Breaks when a physical measure has the wrong sign or looks at the wrong rows. A = I, b = (-1, 2, 0 | 3 | -4
// | 5).
TEST(violations_by_hand) {
  SetProduct K;
  K.add_each<Friction>(Vector{0.5});
  K.add_count<NonNegative>(1);
  K.add_count<Bilateral>(1);
  K.add_each<Interval>(Vector{-1.0}, Vector{1.0});
  Vector I(36);
  for (int i = 0; i < 6; ++i) I[7 * i] = 1;
  const Problem p = make_problem(small::dense_operator(I, 6), {-1, 2, 0, 3, -4, 5}, K);
  const Violations at_zero = violations(p, Law::associated, Vector(6, 0.0));
  CHECK(at_zero.penetration_velocity == 4);  // the bilateral row, in absolute value
  CHECK(at_zero.cone == 0 && at_zero.complementarity == 0);
  // x = (0, 0, 1 | 2 | 4 | 0): the distance of (0, 0, 1) to the cone is c; u = (-1, 2, 1 | 5 | 0 | 5).
  const Violations v = violations(p, Law::associated, Vector{0, 0, 1, 2, 4, 0});
  CHECK(v.penetration_velocity == 1);
  CHECK_NEAR(v.cone, 1 / std::hypot(1, 0.5), 1e-15);
  CHECK(v.complementarity == 10);
  CHECK(v.energy > 0);
}

// Breaks when a solve or a measure without a law of its own takes another than that of the problem, or when
// parts of a problem lose it. The block slides, where the laws differ.
TEST(a_problem_carries_its_law) {
  for (Law law : laws) {
    const Problem given = small::one_contact(0.5, -1, 2);
    const Problem p = make_problem(given.A, given.b, given.K, law);
    CHECK(p.law == law && given.law == Law::coulomb);
    for (std::string_view method : {"auto", "apgd", "p-spg-fb", "interior-point", "newton"}) {
      const Solution s = solve(p, method, {});
      CHECK(s.status == Status::converged);
      CHECK(residual(p, s.x) <= 1e-6 && residual(p, law, s.x) <= 1e-6);
      CHECK_NEAR(s.x[0], law == Law::coulomb ? 1 : 1.6, 1e-4);
    }
    Options other;
    other.law = law == Law::coulomb ? Law::associated : Law::coulomb;
    CHECK(residual(p, solve(p, "auto", other).x) > 0.1);
    Vector r(3);
    natural_map_step(p, law, Vector{1, 0, 0}, r);
    double norm = 0;
    for (double v : r) norm += v * v;
    const Vector u{0, 2, 0};
    CHECK_NEAR(std::sqrt(norm), natural_map(p, law, Vector{1, 0, 0}, u), 1e-15);  // P = 1
    CHECK_NEAR(violations(p, Vector{1, 0, 0}).complementarity, law == Law::coulomb ? 1 : 0, 1e-15);
  }
}
