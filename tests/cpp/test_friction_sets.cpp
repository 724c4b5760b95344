// Elliptic, rolling and planar friction: projection, natural map, face, De Saxce term and barrier of the
// sets.
#include <algorithm>
#include <cmath>
#include <vector>

#include "amontons/sets/product.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr double values[] = {0, 1e-12, 1e-3, 0.3, 1, 7, 1e8};

// f(set) for random coefficients: all kinds of mixtures of extremes, and none at all.
template <class S, class F>
void for_each_set(unsigned seed, int count, F&& f) {
  small::Random random(seed);
  for (int i = 0; i < count; ++i) {
    std::array<double, parameter_count<S>> mu;
    const bool extreme = i % 2 == 0;
    for (double& m : mu) m = extreme ? values[random.below(std::size(values))] : random.uniform(0.05, 2);
    if (i == 0) mu.fill(0);
    f(from_parameters<S>(mu), random, extreme);
  }
}

// All five sets.
template <class F>
void for_all(F&& f) {
  f.template operator()<EllipticFriction<3>>();
  f.template operator()<EllipticFriction<4>>();
  f.template operator()<EllipticFriction<6>>();
  f.template operator()<RollingFriction>();
  f.template operator()<PlanarFriction>();
}

double norm(const double* x, int n) {
  double sum = 0;
  for (int k = 0; k < n; ++k) sum += x[k] * x[k];
  return std::sqrt(sum);
}
double dot(const double* x, const double* y, int n) {
  double sum = 0;
  for (int k = 0; k < n; ++k) sum += x[k] * y[k];
  return sum;
}

// { |rest / mu| <= n } from outside: at most the distance that lifting n, or shrinking the rest, takes.
double outside_cone(double n, double gauge, double rest) {
  if (gauge <= n) return 0;
  return std::min(gauge - std::max(n, 0.0), rest * (1 - std::max(n, 0.0) / gauge)) + std::max(0.0, -n);
}

// The distance of x to the set, or more, by its inequalities.
template <int n>
double outside(const EllipticFriction<n>& set, const double* x) {
  double gauge = 0, dead = 0;
  for (int k = 1; k < n; ++k) {
    if (set.mu[k - 1] > 0)
      gauge += (x[k] / set.mu[k - 1]) * (x[k] / set.mu[k - 1]);
    else
      dead += std::abs(x[k]);
  }
  return outside_cone(x[0], std::sqrt(gauge), norm(x + 1, n - 1)) + dead + std::max(0.0, -x[0]);
}
double outside(const PlanarFriction& set, const double* x) {
  const double size = std::abs(x[1]), below = std::max(0.0, -x[0]);
  return below + (set.mu > 0 ? outside_cone(x[0], size / set.mu, size) : size);
}
double outside(const RollingFriction& set, const double* x) {
  double sum = std::max(0.0, -x[0]);
  for (int part = 0; part < 2; ++part) {
    const double mu = part == 0 ? set.mu : set.mu_r, size = norm(x + 1 + 2 * part, 2);
    sum += mu > 0 ? outside_cone(x[0], size / mu, size) : size;
  }
  return sum;
}
// The distance to the polar cone { n + max over the cross-section of <s, t> <= 0 }, whose maximum is the De
// Saxce term, to first order.
template <class S>
double outside_polar(const S& set, const double* x) {
  double gradient[S::dim];
  set.de_saxce_gradient(x, gradient);
  gradient[0] = 1;
  return std::max(0.0, x[0] + set.de_saxce(x)) / norm(gradient, S::dim);
}

template <class S>
std::array<double, S::dim> random_point(small::Random& random, bool extreme) {
  std::array<double, S::dim> x;
  // Where coefficients are extreme the rest is of the size of one of them, so that all regions are met.
  const double rest = extreme && random.below(2) ? values[1 + random.below(std::size(values) - 1)] : 1;
  const double size = extreme ? std::pow(10, random.uniform(-30, 30)) : 1;
  const bool axis = random.below(10) == 0;
  for (double& v : x) v = axis ? 0 : size * rest * random.normal();
  x[0] = size * random.normal() * (random.below(2) ? 1 : rest);
  return x;
}

}  // namespace

// Moreau: p = Pi_K(x) if and only if p in K, x - p in the polar cone and <p, x - p> = 0. Breaks for a wrong
// region, a multiplier short of its root, or a coefficient of zero that lets something through.
TEST(friction_sets_moreau) {
  for_all([]<class S>() {
    for_each_set<S>(1, 4000, [](const S& set, small::Random& random, bool extreme) {
      const auto x = random_point<S>(random, extreme);
      double p[S::dim], q[S::dim];
      set.project(x.data(), p);
      for (int k = 0; k < S::dim; ++k) q[k] = x[k] - p[k];
      const double size = norm(x.data(), S::dim);
      CHECK_NEAR(outside(set, p) / size, 0, 16 * eps);
      CHECK_NEAR(outside_polar(set, q) / size, 0, 16 * eps);
      CHECK_NEAR(dot(p, q, S::dim) / (size * size), 0, 16 * eps);
      double again[S::dim];
      set.project(p, again);
      for (int k = 0; k < S::dim; ++k) CHECK_NEAR(again[k], p[k], 16 * eps * size);
    });
  });
}

// With equal coefficients and three rows the elliptic cone is the circular one, in closed form there. Breaks
// when the root is found less accurately than the closed form.
TEST(elliptic_friction_of_equal_coefficients_is_circular) {
  small::Random random(2);
  for (int i = 0; i < 4000; ++i) {
    const double mu = values[random.below(std::size(values))];
    double x[3], p[3], q[3];
    for (double& v : x) v = random.normal() * (random.below(2) ? 1 : std::max(mu, 1e-3));
    EllipticFriction<3>{mu, mu}.project(x, p);
    Friction{mu}.project(x, q);
    for (int k = 0; k < 3; ++k) CHECK_NEAR(p[k], q[k], 16 * eps * norm(x, 3));
  }
}

// Breaks when x - step rounds to x for a large x: inside, the map is the step itself.
TEST(friction_sets_natural_map_does_not_cancel) {
  for_all([]<class S>() {
    for_each_set<S>(3, 500, [](const S& set, small::Random& random, bool) {
      double x[S::dim] = {1e18}, step[S::dim], out[S::dim];
      for (int k = 0; k < S::dim; ++k) step[k] = random.normal();
      set.natural_map(x, step, out);
      bool room = true;
      for (double mu : parameters(set)) room = room && mu > 1e-9;
      if (room)
        for (int k = 0; k < S::dim; ++k) CHECK(out[k] == step[k]);
      // At any point it is x - Pi(x - step).
      double z[S::dim], foot[S::dim];
      for (int k = 0; k < S::dim; ++k) x[k] = random.normal(), z[k] = x[k] - step[k];
      set.natural_map(x, step, out);
      set.project(z, foot);
      for (int k = 0; k < S::dim; ++k) CHECK_NEAR(out[k], x[k] - foot[k], 1e-14);
    });
  });
}

// Breaks when a derivative of the projection, or of the De Saxce term, is wrong anywhere but on a border
// between regions, which random points miss.
TEST(friction_sets_derivatives) {
  constexpr double h = 1e-6;
  for_all([]<class S>() {
    for_each_set<S>(4, 1000, [](S set, small::Random& random, bool) {
      auto mu = parameters(set);
      for (double& m : mu) m = random.below(5) == 0 ? 0 : random.uniform(0.1, 2);
      set = from_parameters<S>(mu);
      double y[S::dim], gradient[S::dim];
      for (double& v : y) v = random.normal();
      const Face<S::dim> face = set.face(y);
      set.de_saxce_gradient(y, gradient);
      for (int j = 0; j < S::dim; ++j) {
        double more[S::dim], less[S::dim], p[S::dim], q[S::dim];
        std::copy(y, y + S::dim, more), std::copy(y, y + S::dim, less);
        more[j] += h, less[j] -= h;
        set.project(more, p), set.project(less, q);
        CHECK_NEAR(gradient[j], (set.de_saxce(more) - set.de_saxce(less)) / (2 * h), 1e-6);
        for (int i = 0; i < S::dim; ++i) {
          double entry = 0;
          for (int k = 0; k < S::dim; ++k) entry += face.value[k] * face.vector[k][i] * face.vector[k][j];
          CHECK_NEAR(entry, (p[i] - q[i]) / (2 * h), 2e-5);
        }
      }
    });
  });
}

// The step of a barrier solves  <dx, u> + <x, du> = degree mu - <x, u>  and  R' du = rho - z, dx = R z for
// any z, on and off the central path and next to the boundary. Breaks when a factor, a target or the sum over
// the cones of a block is wrong.
TEST(friction_sets_barrier_steps) {
  for_all([]<class S>() {
    for_each_set<S>(5, 500, [](const S& set, small::Random& random, bool extreme) {
      if (extreme) return;
      typename S::Barrier barrier(set, 1.0);
      constexpr int n = S::dim;
      double R[n * n], start[n], z[n], rho[n], x0[n], x1[n], u0[n], u1[n];
      barrier.start_factor(R);
      for (double& v : start) v = random.normal();
      barrier.start(start);
      double low_x = INFINITY, low_u = INFINITY;
      barrier.worst(low_x, low_u);
      const double room = random.below(2) ? 1 : 1e-5;
      barrier.push(std::max(0.0, room - low_x), std::max(0.0, room - low_u));
      barrier.factor(R);
      const double mu = random.uniform(0, 1);
      barrier.target(mu, false, rho);
      for (double& v : z) v = random.normal();
      barrier.recover(mu, z);
      barrier.primal(x0), barrier.dual(u0);
      CHECK_NEAR((barrier.gap(1) - barrier.gap(-1)) / 2, barrier.degree() * mu - barrier.gap(0),
                 1e-12 * (1 + barrier.gap(0) + norm(z, n) * norm(z, n) / room));
      CHECK_NEAR(barrier.gap(0), dot(x0, u0, n), 1e-9 * (1 + barrier.gap(0)));
      barrier.move(1), barrier.primal(x1), barrier.dual(u1);
      for (int i = 0; i < n; ++i) {
        double dx = 0, reduced = 0, size = 1;
        for (int k = 0; k < n; ++k) {
          dx += R[n * i + k] * z[k];
          reduced += R[n * k + i] * (u1[k] - u0[k]);
          size += std::abs(R[n * k + i]) * (std::abs(u1[k]) + std::abs(u0[k]));
        }
        CHECK_NEAR(x1[i] - x0[i], dx, 1e-9 * (1 + norm(x0, n) + norm(x1, n)));
        CHECK_NEAR(reduced, rho[i] - z[i], 1e-10 * size);
      }
    });
  });
}

// What the longest step leaves is inside, a little more is outside. Breaks when one of the cones of a block
// is forgotten.
TEST(friction_sets_longest_step) {
  for_all([]<class S>() {
    for_each_set<S>(6, 300, [](const S& set, small::Random& random, bool extreme) {
      if (extreme) return;
      typename S::Barrier barrier(set, 1.0);
      constexpr int n = S::dim;
      double R[n * n], start[n], z[n], rho[n], x[n], u[n];
      barrier.start_factor(R);
      for (double& v : start) v = random.normal();
      barrier.start(start);
      double low_x = INFINITY, low_u = INFINITY;
      barrier.worst(low_x, low_u);
      barrier.push(std::max(0.0, 1 - low_x), std::max(0.0, 1 - low_u));
      barrier.factor(R);
      barrier.target(0.5, false, rho);
      for (double& v : z) v = 3 * random.normal();
      barrier.recover(0.5, z);
      const double t = barrier.longest_step();
      if (!(t < 1e6)) return;
      barrier.move(t * (1 - 1e-9));
      barrier.primal(x), barrier.dual(u);
      const double size = norm(x, n) + norm(u, n);
      CHECK_NEAR(outside(set, x), 0, 1e-12 * size);
      CHECK(u[0] - set.de_saxce(u) > -1e-12 * size);  // the dual cone
    });
  });
}

// Breaks when a bad coefficient gets in, or its message does not say which one.
TEST(bad_friction_sets_are_named) {
  SetProduct K;
  CHECK_THROWS(K.add(EllipticFriction<4>{0.1, 0.2, -1}), "torsion of elliptic friction cone 0");
  CHECK_THROWS(K.add(EllipticFriction<6>{0.1, NAN, 0, 0, 0}), "mu along tangent 2");
  CHECK_THROWS(K.add(RollingFriction{0.1, INFINITY}), "rolling friction cone 0");
  CHECK_THROWS(K.add(PlanarFriction{-0.1}), "mu of planar friction cone 0");
  CHECK(K.rows() == 0);
}
