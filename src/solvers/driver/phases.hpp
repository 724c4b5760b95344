#pragma once
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/solvers.hpp"

// Pieces that methods with several phases share.
namespace amontons {

// u = A x + b, counted; returns the natural map.
inline double evaluate(const Problem& problem, Law law, const std::vector<double>& x, std::vector<double>& u,
                       Monitor& monitor) {
  product(problem.A, x, u);
  ++monitor.products;
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += problem.b[i];
  return natural_map(problem, law, x, u);
}

// 1/2 x'Ax + b'x with u = A x + b
inline double objective(const Problem& problem, const std::vector<double>& x, const std::vector<double>& u) {
  double f = 0;
  for (std::size_t i = 0; i < x.size(); ++i) f += 0.5 * x[i] * (u[i] + problem.b[i]);
  return f;
}

// The interior point without the methods that finish what it leaves over.
Solution central_path(const Problem& problem, const Options& options);

// Under coulomb: the central path of the convex problem with the De Saxce term of the start, then a burst of
// apgd. The limit of iterations is that of the path.
Solution frozen_path(const Problem& problem, const Options& options);

// Conjugate gradients preconditioned by one factorisation; bilateral rows only, as cg.
Solution factored_cg(const Problem& problem, const Options& options);

// At most so many iterations of P-SPG-FB from x, which becomes the best iterate found; why they ended.
inline Status first_order_phase(const Problem& problem, const Options& options, std::size_t iterations,
                                std::vector<double>& x, Monitor& monitor) {
  Options o = options;
  o.x0 = x;
  o.max_iterations = iterations;
  o.deadline = options.deadline - monitor.elapsed();
  o.history = false;
  o.callback = nullptr;
  Solution s = spg(problem, o);
  monitor.products += s.products;
  x = std::move(s.x);
  return s.status;
}

}  // namespace amontons
