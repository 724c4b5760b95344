// Projected block Gauss-Seidel / SOR: per cone x_i := Pi_K(x_i - omega u_i / q_i) with the newest impulses,
// q_i a bound of the largest eigenvalue of the diagonal block. Bodies: velocities are carried along (Jean
// 1999; Tasora, Anitescu 2011); matrices: rows of A. An iteration is one sweep and counts as one product;
// its residual is another.
#include <algorithm>
#include <array>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/driver/phases.hpp"

namespace amontons {

namespace {

// Rows of a matrix: u_i is formed from the newest x.
template <class Matrix>
struct MatrixSweep {
  const Matrix& A;
  const Problem& problem;
  void start(const std::vector<double>&) {}
  double entry(std::size_t i, std::size_t j) const {
    if constexpr (std::is_same_v<Matrix, DenseOperator>) {
      return A.data[i * A.m + j];
    } else {
      double sum = 0;
      for (Index k = A.indptr[i]; k < A.indptr[i + 1]; ++k)
        if (static_cast<std::size_t>(A.indices[k]) == j) sum += A.data[k];
      return sum;
    }
  }
  double velocity(std::size_t i, const std::vector<double>& x) const {
    double sum = problem.b[i];
    if constexpr (std::is_same_v<Matrix, DenseOperator>)
      for (std::size_t j = 0; j < A.m; ++j) sum += A.data[i * A.m + j] * x[j];
    else
      for (Index k = A.indptr[i]; k < A.indptr[i + 1]; ++k) sum += A.data[k] * x[A.indices[k]];
    return sum;
  }
  void change(std::size_t, double) {}
};

// Bodies: v = M^-1 D'x is updated with every impulse.
struct BodySweep {
  BodyOperator A;
  const Problem& problem;
  std::vector<double> v;
  std::vector<std::array<double, 12>> MD;  // M^-1 times the rows of D'

  BodySweep(BodyOperator op, const Problem& p)
      : A(std::move(op)), problem(p), v(6 * A.inverse_mass.bodies()), MD(A.rows()) {
    for (std::size_t i = 0; i < A.rows(); ++i) {
      if (A.jacobian[i].body_a >= 0)
        A.inverse_mass.apply(A.jacobian[i].body_a, A.jacobian[i].a.data(), MD[i].data());
      if (A.jacobian[i].body_b >= 0)
        A.inverse_mass.apply(A.jacobian[i].body_b, A.jacobian[i].b.data(), MD[i].data() + 6);
    }
  }
  void start(const std::vector<double>& x) {
    std::fill(v.begin(), v.end(), 0.0);
    for (std::size_t i = 0; i < A.rows(); ++i) change(i, x[i]);
  }
  double entry(std::size_t i, std::size_t j) const {
    double sum = i == j ? A.compliance[i] : 0.0;
    if (A.jacobian[i].body_a >= 0 && A.jacobian[i].body_a == A.jacobian[j].body_a)
      for (int k = 0; k < 6; ++k) sum += A.jacobian[i].a[k] * MD[j][k];
    if (A.jacobian[i].body_b >= 0 && A.jacobian[i].body_b == A.jacobian[j].body_b)
      for (int k = 0; k < 6; ++k) sum += A.jacobian[i].b[k] * MD[j][k + 6];
    return sum;
  }
  double velocity(std::size_t i, const std::vector<double>& x) const {
    const JacobianRow& row = A.jacobian[i];
    double sum = problem.b[i] + A.compliance[i] * x[i];
    for (int k = 0; k < 6; ++k) {
      if (row.body_a >= 0) sum += row.a[k] * v[6 * row.body_a + k];
      if (row.body_b >= 0) sum += row.b[k] * v[6 * row.body_b + k];
    }
    return sum;
  }
  void change(std::size_t i, double dx) {
    const JacobianRow& row = A.jacobian[i];
    for (int k = 0; k < 6; ++k) {
      if (row.body_a >= 0) v[6 * row.body_a + k] += MD[i][k] * dx;
      if (row.body_b >= 0) v[6 * row.body_b + k] += MD[i][k + 6] * dx;
    }
  }
};

template <class Sweep>
Solution run(const Problem& problem, const Options& options, Sweep sweep) {
  constexpr std::size_t refresh = 20;  // sweeps between two sums of the velocities from scratch
  const std::size_t m = problem.rows();
  Monitor monitor(options, 100000, 10000);
  const double scale = natural_map_at_zero(problem, options.law);
  std::vector<double> x(m), u(m), best(m), q(problem.K.blocks());
  for_each_block(problem.K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
    for (int i = 0; i < Set::dim; ++i) {  // the largest Gershgorin bound
      double sum = 0;
      for (int j = 0; j < Set::dim; ++j) sum += std::abs(sweep.entry(row + i, row + j));
      q[block] = std::max(q[block], sum);
    }
    q[block] = std::max(q[block], problem.P[block]);
  });
  double r = starting_point(problem, options, x, u, monitor);
  best = x;
  Status status;
  for (;;) {
    const auto stop = monitor.observe(r, objective(problem, x, u), options.sor.omega);
    if (monitor.improved()) best = x;
    if (stop) {
      status = *stop;
      break;
    }
    if (monitor.iterations() % refresh == 0) sweep.start(x);  // removes the drift of the running velocities
    for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
      double v[Set::dim], g[Set::dim], next[Set::dim];
      for (int i = 0; i < Set::dim; ++i) v[i] = sweep.velocity(row + i, x);
      add_saxce_term(set, options.law, v, g);
      for (int i = 0; i < Set::dim; ++i) g[i] = x[row + i] - options.sor.omega * g[i] / q[block];
      set.project(g, next);
      for (int i = 0; i < Set::dim; ++i) {
        sweep.change(row + i, next[i] - x[row + i]);
        x[row + i] = next[i];
      }
    });
    ++monitor.products;
    r = evaluate(problem, options.law, x, u, monitor) / scale;
  }
  return finish(problem, options, "gauss-seidel", std::move(best), status, monitor);
}

}  // namespace

Solution gauss_seidel(const Problem& problem, const Options& options) {
  return std::visit(
      [&]<class Op>(const Op& A) -> Solution {
        if constexpr (std::is_same_v<Op, CallbackOperator>)
          throw InputError(
              "gauss-seidel needs the rows of A, which a function operator does not have; use p-spg-fb");
        else if constexpr (std::is_same_v<Op, BodyOperator>)
          return run(problem, options, BodySweep(A, problem));
        else if constexpr (std::is_same_v<Op, ContactOperator>)
          return run(problem, options, BodySweep(A.stored(), problem));
        else
          return run(problem, options, MatrixSweep<Op>{A, problem});
      },
      problem.A);
}

}  // namespace amontons
