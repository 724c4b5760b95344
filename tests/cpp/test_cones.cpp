#include <cmath>
#include <limits>
#include <vector>

#include "amontons/sets/product.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;
using small::Vector;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr double coefficients[] = {0, 1e-12, 0.3, 1, 7, 1e8, 1e150};

struct V3 {
  double n, t1, t2;
};

V3 project_friction(double mu, V3 x) {
  const double in[3] = {x.n, x.t1, x.t2};
  double out[3];
  Friction{mu}.project(in, out);
  return {out[0], out[1], out[2]};
}

double norm(V3 x) { return std::sqrt(x.n * x.n + x.t1 * x.t1 + x.t2 * x.t2); }
double dot(V3 a, V3 b) { return a.n * b.n + a.t1 * b.t1 + a.t2 * b.t2; }
double tangential(V3 x) { return std::sqrt(x.t1 * x.t1 + x.t2 * x.t2); }
V3 minus(V3 a, V3 b) { return {a.n - b.n, a.t1 - b.t1, a.t2 - b.t2}; }
bool same(V3 a, V3 b) { return a.n == b.n && a.t1 == b.t1 && a.t2 == b.t2; }

// The distance of x to the half-planes that bound the cone, as far as it lies outside: |t| <= mu n in a form
// that neither mu = 0 nor a huge mu spoils, c |t| <= s n with c = cos and s = sin of the half-angle.
double outside(double mu, V3 x) {
  const double c = 1 / std::hypot(1.0, mu), s = mu > 1 ? 1 / std::hypot(1.0, 1 / mu) : mu * c;
  return std::max({0.0, c * tangential(x) - s * x.n, -x.n});
}

// The same for the polar cone { mu |t| <= -n }.
double outside_polar(double mu, V3 x) {
  const double c = 1 / std::hypot(1.0, mu), s = mu > 1 ? 1 / std::hypot(1.0, 1 / mu) : mu * c;
  return std::max({0.0, s * tangential(x) + c * x.n, x.n});
}

// Points in every region of the cone and on every border between two of them, at every size.
template <class F>
void for_each_point(double mu, F&& f) {
  const double c = 1 / std::hypot(1.0, mu), s = mu > 1 ? 1 / std::hypot(1.0, 1 / mu) : mu * c;
  const V3 directions[] = {{1, 0, 0},       {-1, 0, 0},       {0, 1, 0},        {0, -0.6, 0.8},
                           {c, s, 0},       {c, 0, -s},       {-s, c, 0},       {-s, 0.6 * c, -0.8 * c},
                           {c, 0.5 * s, 0}, {-s, 0.5 * c, 0}, {0.3, 0.4, -0.9}, {-0.3, 0.4, 0.9},
                           {0.7, 1e-9, 0},  {-0.7, 0, 1e-9},  {1e-9, 1, 0},     {-1e-9, 0, -1}};
  for (double size : {1e-140, 1e-30, 1.0, 1e30, 1e140})
    for (V3 d : directions) f(V3{size * d.n, size * d.t1, size * d.t2});
}

}  // namespace

// Breaks when the projection does not leave points of the cone alone, or a NaN comes out at an extreme.
TEST(friction_apex_axis_and_polar_are_exact) {
  for (double mu : coefficients) {
    CHECK(same(project_friction(mu, {0, 0, 0}), {0, 0, 0}));
    for (double n : {1e-140, 1e-3, 1.0, 1e140}) {
      CHECK(same(project_friction(mu, {n, 0, 0}), {n, 0, 0}));
      CHECK(same(project_friction(mu, {-n, 0, 0}), {0, 0, 0}));
      // The polar cone, strictly inside: mu |t| < -n.
      const double t = mu > 0 ? 0.5 * n / mu : 3 * n;
      CHECK(same(project_friction(mu, {-n, 0.6 * t, 0.8 * t}), {0, 0, 0}));
      // Strictly inside the cone. mu n overflows for the largest of both, as it does in the comparison
      // itself.
      const double inner = 0.5 * std::min(mu, 1e10) * n;
      CHECK(same(project_friction(mu, {n, -0.6 * inner, 0.8 * inner}), {n, -0.6 * inner, 0.8 * inner}));
    }
  }
}

// The foot of (0, 1, 0) by hand: the projection on the ray (1, mu) / sqrt(1 + mu^2). Breaks when the foot
// lies elsewhere on the boundary, or when the limits mu = 0 (half-line) and mu huge (half-space) lose digits.
TEST(friction_foot_by_hand) {
  const V3 a = project_friction(1, {0, 1, 0}), b = project_friction(0.5, {0, 0, -2});
  CHECK_NEAR(a.n, 0.5, eps);
  CHECK_NEAR(a.t1, 0.5, eps);
  CHECK(a.t2 == 0);
  CHECK_NEAR(b.n, 0.8, 4 * eps);
  CHECK(b.t1 == 0);
  CHECK_NEAR(b.t2, -0.4, 4 * eps);
  // mu = 0: the half-line, any tangential part vanishes without rounding of n.
  CHECK(same(project_friction(0, {3, 4, 5}), {3, 0, 0}));
  CHECK(same(project_friction(0, {-3, 4, 5}), {0, 0, 0}));
  // mu huge: all but the half-space n >= 0.
  const V3 c = project_friction(1e150, {-3, 4, 5});
  CHECK_NEAR(c.n, 0, 1e-140);
  CHECK_NEAR(c.t1, 4, 8 * eps);
  CHECK_NEAR(c.t2, 5, 8 * eps);
}

// Moreau: p = Pi_K(x) is the projection if and only if p in K, x - p in the polar cone, <p, x - p> = 0.
// Breaks for a wrong region, a wrong foot, or cancellation at a boundary.
TEST(friction_moreau) {
  for (double mu : coefficients)
    for_each_point(mu, [&](V3 x) {
      const V3 p = project_friction(mu, x), q = minus(x, p);
      const double size = norm(x);
      CHECK(std::isfinite(p.n) && std::isfinite(p.t1) && std::isfinite(p.t2));
      CHECK_NEAR(outside(mu, p) / size, 0, 4 * eps);
      CHECK_NEAR(outside_polar(mu, q) / size, 0, 4 * eps);
      CHECK_NEAR(dot(V3{p.n / size, p.t1 / size, p.t2 / size}, V3{q.n / size, q.t1 / size, q.t2 / size}), 0,
                 8 * eps);
      CHECK_NEAR((norm(p) / size) * (norm(p) / size) + (norm(q) / size) * (norm(q) / size), 1, 8 * eps);
    });
}

// Breaks when projecting again moves a point by more than the last bits.
TEST(friction_idempotent) {
  for (double mu : coefficients)
    for_each_point(mu, [&](V3 x) {
      const V3 p = project_friction(mu, x), again = project_friction(mu, p);
      CHECK_NEAR(norm(minus(p, again)) / norm(x), 0, 4 * eps);
    });
}

// |Pi(x) - Pi(y)| <= |x - y|, also across borders. Breaks for a jump between two regions.
TEST(friction_nonexpansive) {
  small::Random random(5);
  for (double mu : coefficients)
    for (int i = 0; i < 2000; ++i) {
      const double scale = std::pow(10.0, random.uniform(-30, 30));
      const V3 x{scale * random.normal(), scale * random.normal(), scale * random.normal()};
      const double step = scale * std::pow(10.0, random.uniform(-12, 1));
      const V3 y{x.n + step * random.normal(), x.t1 + step * random.normal(), x.t2 + step * random.normal()};
      const double before = norm(minus(x, y));
      const double after = norm(minus(project_friction(mu, x), project_friction(mu, y)));
      CHECK(after <= before + 8 * eps * (norm(x) + norm(y)));
    }
}

// Breaks when the rows are not treated alike: the cone is symmetric about its axis.
TEST(friction_rotates_with_its_argument) {
  small::Random random(6);
  for (double mu : coefficients)
    for (int i = 0; i < 200; ++i) {
      const V3 x{random.normal(), random.normal(), random.normal()};
      const double angle = random.uniform(0, 6.3), c = std::cos(angle), s = std::sin(angle);
      const V3 p = project_friction(mu, x);
      const V3 r = project_friction(mu, {x.n, c * x.t1 - s * x.t2, s * x.t1 + c * x.t2});
      CHECK_NEAR(norm(minus(r, {p.n, c * p.t1 - s * p.t2, s * p.t1 + c * p.t2})), 0, 16 * eps * norm(x));
    }
}

// Breaks at the ends of the real line, for -0, or when lo = hi.
TEST(rows_are_exact) {
  const auto of = [](const auto& set, double x) {
    double out;
    set.project(&x, &out);
    return out;
  };
  for (double x : {-1e300, -1.0, -1e-300, 0.0, 1e-300, 1.0, 1e300}) {
    CHECK(of(Bilateral{}, x) == x);
    CHECK(of(NonNegative{}, x) == std::max(x, 0.0));
    CHECK(of(Interval{-2, 3}, x) == std::clamp(x, -2.0, 3.0));
    CHECK(of(Interval{0.5, 0.5}, x) == 0.5);
    CHECK(of(Interval{-infinity, infinity}, x) == x);
    CHECK(of(Interval{0, infinity}, x) == std::max(x, 0.0));
    CHECK(of(Interval{-infinity, -7}, x) == std::min(x, -7.0));
  }
  CHECK(of(NonNegative{}, -0.0) == 0.0);
}

// Breaks when runs, rows or parameters of a product are counted wrongly: it must be the blocks side by side.
TEST(product_is_its_blocks) {
  SetProduct K = small::mixed_cones();
  K.add_count<NonNegative>(0);
  K.add_each<Friction>(Vector{});
  K.add_count<Bilateral>(2);  // merges with the run before: empty runs leave no trace
  CHECK(K.rows() == 27);
  CHECK(K.blocks() == 17);
  CHECK(K.contacts() == 5);
  CHECK(!K.all_bilateral());
  CHECK(K.runs().size() == 6);
  const Vector x = small::Random(11).vector(K.rows());
  Vector out(K.rows()), expected, in_place = x;
  project(K, x, out);
  const auto add_rows = [&](const auto& set, int count) {
    for (int i = 0; i < count; ++i) {
      double foot;
      set.project(&x[expected.size()], &foot);
      expected.push_back(foot);
    }
  };
  const auto add_contact = [&](double mu) {
    double foot[3];
    Friction{mu}.project(&x[expected.size()], foot);
    expected.insert(expected.end(), foot, foot + 3);
  };
  add_rows(Bilateral{}, 2);
  for (double mu : {0.0, 0.3, 1.0}) add_contact(mu);
  add_rows(NonNegative{}, 3);
  add_rows(Interval{-0.1, 0.1}, 1), add_rows(Interval{0.05, infinity}, 1);
  add_rows(Interval{-infinity, 0.3}, 1), add_rows(Interval{0.2, 0.2}, 1);
  for (double mu : {5.0, 1e-12}) add_contact(mu);
  add_rows(Bilateral{}, 3);
  CHECK(out == expected);
  double squared = 0;
  for (std::size_t i = 0; i < x.size(); ++i) squared += (x[i] - out[i]) * (x[i] - out[i]);
  CHECK_NEAR(distance(K, x), std::sqrt(squared), 1e-15 * std::sqrt(squared));
  project(K, in_place, in_place);
  CHECK(in_place == expected);
  project(K, expected, out);
  for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(out[i], expected[i], 4 * eps);
}

// Breaks when a product of no sets has rows, or its projection reads one.
TEST(empty_product) {
  const SetProduct K;
  CHECK(K.rows() == 0 && K.blocks() == 0 && K.contacts() == 0 && K.all_bilateral());
  project(K, {}, {});
  CHECK(distance(K, {}) == 0);
}

// Breaks when a bad parameter gets in, or its message does not say which one.
TEST(bad_parameters_are_named) {
  SetProduct K;
  CHECK_THROWS(K.add_each<Friction>(Vector{0.1, -0.2}), "mu[1]");
  CHECK_THROWS(K.add_each<Friction>(Vector{0.1, 0.2, NAN}), "mu[2]");
  CHECK_THROWS(K.add_each<Friction>(Vector{infinity}), "mu[0]");
  CHECK_THROWS(K.add_each<Interval>(Vector{0, 2}, Vector{1, 1}), "interval 1");
  CHECK_THROWS(K.add_each<Interval>(Vector{NAN}, Vector{1}), "NaN");
  CHECK_THROWS(K.add_each<Interval>(Vector{infinity}, Vector{infinity}), "empty");
  CHECK_THROWS(K.add_each<Interval>(Vector{0, 0}, Vector{1}), "one of each per block");
  CHECK(K.rows() == 0);  // thrown before anything has been changed
}
