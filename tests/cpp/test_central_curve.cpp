#include <cmath>
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/second_order/interior_point.hpp"
#include "check.hpp"
#include "problems.hpp"
#include "solvers/central_path/central_curve.hpp"
#include "solvers/direct/island_solver.hpp"
#include "solvers/direct/island_system.hpp"

using namespace amontons;

namespace {

// Contacts, a limit and a friction of a joint on bodies of very different masses: u = D (v + M^-1 D'x), with
// fewer freedoms than rows, so that W is singular. v can be stopped: a solution exists (Klarbring, Pang
// 1998).
Reduction::Island island_of(unsigned seed, int contacts, int freedoms, double mu, double room = 0.05) {
  small::Random random(seed);
  Reduction::Island island;
  const std::size_t m = 3 * contacts + 2;
  std::vector<double> D(m * freedoms), mobility(freedoms), v(freedoms);
  for (double& d : D) d = random.uniform(-1, 1);
  for (double& w : mobility) w = std::pow(10.0, random.uniform(-2, 2));
  for (double& x : v) x = random.uniform(-1, 1);
  island.row.resize(m);
  island.W.assign(m * m, 0.0);
  island.q.assign(m, 0.0);
  for (std::size_t i = 0; i < m; ++i)
    for (int k = 0; k < freedoms; ++k) {
      island.q[i] += D[i * freedoms + k] * v[k];
      for (std::size_t j = 0; j < m; ++j)
        island.W[m * i + j] += D[i * freedoms + k] * mobility[k] * D[j * freedoms + k];
    }
  for (int i = 0; i < contacts; ++i) island.K.add(Friction{mu * random.uniform(0.5, 2)});
  island.K.add(NonNegative{});
  island.K.add(Interval{-room, room});
  for_each_block(island.K, [&]<class S>(const S&, std::size_t, std::size_t row) {
    double mean = 0;
    for (int k = 0; k < S::dim; ++k) mean += island.W[(m + 1) * (row + k)] / S::dim;
    island.P.push_back(mean);
  });
  return island;
}

double natural_map(const Reduction::Island& island, Law law, const std::vector<double>& x) {
  const std::size_t m = x.size();
  std::vector<double> u = island.q;
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < m; ++j) u[i] += island.W[m * i + j] * x[j];
  double sum = 0;
  for_each_block(island.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double g[S::dim];
    add_de_saxce_term(set, law, &u[row], g);
    sum += natural_map_squared(set, island.P[block], &x[row], g);
  });
  return std::sqrt(sum);
}

// Whether the curve leads to a natural map of 1e-5 of that at zero within 100 steps.
bool ends(const Reduction::Island& island, Law law) {
  std::vector<double> x(island.q.size(), 0.0);
  const double target = 1e-5 * natural_map(island, law, x);
  IslandSystem system;
  system.start(island, island.P);
  CentralCurve<IslandSystem> curve;
  curve.start(system, island.K, law);
  for (int step = 0; step < 100; ++step) {
    if (!curve.step()) return false;
    curve.x(x);
    system.units().to_impulses(x);
    if (natural_map(island, law, x) <= target) return true;
  }
  return false;
}

// The same of the interior point for many rows.
bool large_path_ends(const Reduction::Island& island) {
  const Problem problem =
      trusted_problem(DenseOperator{island.W, island.rows(), nullptr}, island.q, island.K);
  Options options;
  options.law = Law::coulomb;
  options.tolerance = 1e-5;
  const std::unique_ptr<Run> run = start_central_path(problem, options, small::no_limit);
  run->advance(100);
  return run->best_residual() <= options.tolerance;
}

}  // namespace

// The convex law has one path, which ends at its solution. Fails if a barrier, the scaling of a block or the
// solution of Newton's equation is wrong.
TEST(the_path_of_the_associated_law_ends_at_its_solution) {
  for (unsigned seed = 1; seed <= 40; ++seed) CHECK(ends(island_of(seed, 8, 12, 0.7), Law::associated));
}

// Under coulomb nothing is proven; nearly all curves end at a solution of these problems. Fails if a fold is
// not seen, or seen where there is none.
TEST(the_path_of_coulombs_law_ends_at_a_solution) {
  int ended = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) ended += ends(island_of(seed, 10, 12, 1.5), Law::coulomb);
  CHECK(ended >= 95);
}

// Dry friction of a joint with hardly any room: where it slides the curve bends at its very start. Fails if
// the correction of a step is taken that is longer than the step (163 and 152 ended).
TEST(the_path_gets_away_from_narrow_intervals) {
  for (double mu : {0.7, 2.0}) {
    int ended = 0;
    for (unsigned seed = 1; seed <= 200; ++seed)
      ended += ends(island_of(seed, 6, 12, mu, 1e-7), Law::coulomb);
    CHECK(ended >= 185);
  }
}

// Steps of the curve to a natural map of 1e-5 of that at zero; from a start near `x`, if it is given.
static int steps_to_the_end(const Reduction::Island& island, std::vector<double> x, double t) {
  const bool near = !x.empty();
  std::vector<double> u = island.q;
  const std::size_t m = u.size();
  const double target = 1e-5 * natural_map(island, Law::associated, std::vector<double>(m, 0.0));
  IslandSystem system;
  system.start(island, island.P);
  CentralCurve<IslandSystem> curve;
  if (near) {
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t j = 0; j < m; ++j) u[i] += island.W[m * i + j] * x[j];
    system.units().from_impulses(x);
    system.units().from_velocities(u);
    CHECK(curve.start_near(system, island.K, Law::associated, x, u, t));
  } else {
    curve.start(system, island.K, Law::associated);
    x.resize(m);
  }
  for (int step = 1; step < 100; ++step) {
    if (!curve.step()) return 100;
    curve.x(x);
    system.units().to_impulses(x);
    if (natural_map(island, Law::associated, x) <= target) return step;
  }
  return 100;
}

// From the solution of a problem that is nearly the same, the curve has less than half of its length. Fails
// if the point of a barrier is not on the curve, or if t does not start where the point is.
TEST(the_path_is_shorter_from_a_point_near_the_solution) {
  int shorter = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Reduction::Island island = island_of(seed, 8, 12, 0.7);
    std::vector<double> x;
    IslandSolver().solve(island, Law::associated, {1e-9, 1e-9, 0}, small::no_limit, x);
    small::Random random(seed);
    for (double& q : island.q) q *= 1 + 1e-3 * random.uniform(-1, 1);
    shorter += 2 * steps_to_the_end(island, x, 1e-3) < steps_to_the_end(island, {}, 1);
  }
  CHECK(shorter >= 24);
}

// From the solution of a problem that is nearly the same. Fails if a curve is followed to its end where
// Newton's method has the faces (494 factorisations).
TEST(a_newton_step_ends_the_path) {
  std::size_t factorizations = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Reduction::Island island = island_of(seed, 6, 12, 0.5);
    std::vector<double> x;
    IslandSolver().solve(island, Law::coulomb, {1e-9, 1e-9, 0}, small::no_limit, x);
    small::Random random(seed);
    for (double& q : island.q) q *= 1 + 0.03 * random.uniform(-1, 1);
    factorizations +=
        IslandSolver().solve(island, Law::coulomb, {1e-9, 1e-9, 0}, small::no_limit, x).factorizations;
  }
  CHECK(factorizations <= 460);
}

// The same for many rows.
TEST(the_large_path_of_coulombs_law_ends_at_a_solution) {
  int ended = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) ended += large_path_ends(island_of(seed, 10, 12, 1.5));
  CHECK(ended >= 80);
}
