// Islands with more rows than coordinates: products and Newton's method in factors against the dense matrix.
#include <cmath>
#include <vector>

#include "check.hpp"
#include "problems.hpp"
#include "solvers/central_path/central_curve.hpp"
#include "solvers/direct/block_sweeps.hpp"
#include "solvers/direct/island_solver.hpp"
#include "solvers/direct/island_system.hpp"
#include "solvers/direct/reduction.hpp"

using namespace amontons;

namespace {

// Contacts, bounded efforts and limits on few coordinates, which can be stopped; `held`: two directions that
// bilateral rows take.
Reduction::Island island_on(std::size_t n, std::size_t contacts, bool held) {
  small::Random random(7);
  std::vector<double> v(n);
  for (double& rate : v) rate = random.uniform(-1, 1);
  Reduction::Island island;
  for (std::size_t i = 0; i < contacts; ++i) island.K.append(Friction{i % 3 == 0 ? 0.2 : 0.8});
  for (std::size_t i = 0; i < n; ++i) island.K.append(Interval{-0.3, 0.2});
  island.K.append(NonNegative{});
  const std::size_t m = island.K.rows();
  island.thin.resize(n, m);
  ThinMatrix& W = island.thin;
  for (std::size_t i = 0; i < m; ++i) {
    island.row.push_back(i);
    for (std::size_t k = 0; k < n; ++k)
      if (i < 3 * contacts || k == i % n) W.Y[W.stride * i + k] = random.uniform(-1, 1);
    double q = 0;
    for (std::size_t k = 0; k < n; ++k) q += W.row(i)[k] * v[k];
    island.q.push_back(q);
    if (i >= 3 * contacts && i % 2 == 0) W.E[i] = 0.5;
  }
  if (held) {
    W.Q.assign(n * W.stride, 0.0);
    for (std::size_t k = 0; k < n; ++k) W.Q[(W.stride + 1) * k] = 1;
    // 1 - v v' with v'v = 0.8: a compliant row along v.
    const double part = 0.8 / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < n; ++k) W.Q[W.stride * i + k] -= part * ((i + k) % 2 == 0 ? 1 : -1);
  }
  for (std::size_t b = 0; b < island.K.blocks(); ++b) island.P.push_back(1.0);
  return island;
}

Reduction::Island dense(const Reduction::Island& island) {
  Reduction::Island other = island;
  small::fill(island.thin, other.W);
  other.thin.n = 0;
  return other;
}

std::vector<double> velocities(const Reduction::Island& dense, const std::vector<double>& x) {
  const std::size_t m = dense.rows();
  std::vector<double> u = dense.q;
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < m; ++j) u[i] += dense.W[m * i + j] * x[j];
  return u;
}

}  // namespace

// An error in Q, E or the padding of rows would show in some entry.
TEST(products_in_factors_are_those_of_the_dense_matrix) {
  for (const bool held : {false, true}) {
    const Reduction::Island thin = island_on(7, 5, held), full = dense(thin);
    small::Random random(3);
    std::vector<double> x(thin.rows()), u(thin.rows());
    for (double& v : x) v = random.uniform(-1, 1);
    thin.thin.add_product(x, u);
    const std::vector<double> reference = velocities(full, x);
    for (std::size_t i = 0; i < u.size(); ++i) CHECK(std::abs(u[i] + thin.q[i] - reference[i]) < 1e-12);
  }
}

// A wrong S, r or sign would stop Newton's method far from the solution, which the dense form finds.
// Velocities are unique, impulses of more rows than coordinates are not.
TEST(newton_by_rates_solves_the_same_inequality) {
  for (const Law law : {Law::associated, Law::coulomb})
    for (const bool held : {false, true})
      for (const std::size_t contacts : {2, 5, 9}) {
        const Reduction::Island thin = island_on(7, contacts, held), full = dense(thin);
        std::vector<double> a, b;
        IslandSolver solver;
        const auto by_rates = solver.solve(thin, law, {1e-9, 1e-12, 0}, small::no_limit, a);
        const auto by_rows = solver.solve(full, law, {1e-9, 1e-12, 0}, small::no_limit, b);
        CHECK(by_rates.solved && by_rows.solved);
        if (law == Law::coulomb) continue;  // its solution need not be unique
        const std::vector<double> u = velocities(full, a), reference = velocities(full, b);
        for (std::size_t i = 0; i < u.size(); ++i) CHECK(std::abs(u[i] - reference[i]) < 1e-7);
      }
}

// A wrong C, D or sign, or a unit that Y lacks, would show in the first step.
TEST(the_curve_by_rates_is_that_by_rows) {
  for (const Law law : {Law::associated, Law::coulomb})
    for (const bool held : {false, true}) {
      const Reduction::Island thin = island_on(7, 5, held), full = dense(thin);
      IslandSystem by_rates, by_rows;
      CentralCurve<IslandSystem> a, b;
      const std::vector<double> mobility(thin.K.blocks(), 2.0);
      by_rates.start(thin, mobility);
      by_rows.start(full, mobility);
      a.start(by_rates, thin.K, law);
      b.start(by_rows, full.K, law);
      std::vector<double> x(thin.rows()), y(thin.rows());
      for (int step = 0; step < 6; ++step) {
        CHECK(a.step() && b.step());
        a.x(x);
        b.x(y);
        for (std::size_t i = 0; i < x.size(); ++i) CHECK(std::abs(x[i] - y[i]) < 1e-7 * (1 + std::abs(y[i])));
        CHECK(std::abs(a.t() - b.t()) < 1e-7 * b.t());
      }
    }
}

// Under the associated law a sweep lowers 1/2 x'W x + q'x, by rates as by rows. A wrong diagonal block would
// raise it, velocities that a sweep does not keep would part the two.
TEST(sweeps_descend_and_are_the_same_in_factors) {
  for (const bool held : {false, true}) {
    const Reduction::Island thin = island_on(7, 5, held), full = dense(thin);
    const std::vector<double> p(thin.K.blocks(), 1e-3);
    BlockSweeps a, b;
    a.start(thin, Law::associated, p);
    b.start(full, Law::associated, p);
    std::vector<double> x(thin.rows()), y(thin.rows());
    a.begin_at(x);
    b.begin_at(y);
    double last = 0;
    for (int sweep = 0; sweep < 10; ++sweep) {
      a.sweep(x);
      b.sweep(y);
      for (std::size_t i = 0; i < x.size(); ++i) CHECK(std::abs(x[i] - y[i]) < 1e-10);
      const std::vector<double> u = velocities(full, y);
      double energy = 0;
      for (std::size_t i = 0; i < y.size(); ++i) energy += 0.5 * y[i] * (u[i] + full.q[i]);
      CHECK(energy < last);
      last = energy;
    }
  }
}
