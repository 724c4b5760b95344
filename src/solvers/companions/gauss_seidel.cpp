// Projected block Gauss-Seidel / SOR, each cone in turn with the newest impulses:
//
//     x_i := Pi_K(x_i - omega g_i / q_i),   q_i at least the largest eigenvalue of the diagonal block A_ii.
//
// For the associated law every such step lowers the objective, since 1/2 q_i |d|^2 + <g_i, d> bounds its
// change from above; omega > 1 extrapolates. A sweep carries information through all rows, but only in their
// order. The weight of a stack needs about one sweep per level against that order, and a mass ratio
// multiplies the sweeps. With bodies, velocities are updated with each impulse, so that a row costs its two
// bodies (Jean 1999; Tasora, Anitescu 2011). With a matrix, a row costs a row of A. An iteration is one sweep
// and counts as one product; its residual is another.
#include "amontons/solvers/companions/gauss_seidel.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

namespace {

// Access of a sweep to A by rows:
//
//   start(x)        forms the state that belongs to x, without the drift of updates
//   entry(i, j)     A_ij, for the diagonal blocks
//   velocity(i, x)  u_i with the newest impulses
//   change(i, dx)   x_i was changed by dx

// Rows of a matrix: u_i is formed from the newest x, and there is no other state.
template <class Matrix>
struct MatrixSweep {
  using Operator = Matrix;
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

// Bodies: v = M^-1 D'x (m/s and rad/s, six per body) is updated with every impulse, and the velocity of a row
// is u_i = D_i v + E_i x_i + b_i.
struct BodySweep {
  using Operator = ContactSystem;
  ContactSystem A;
  const Problem& problem;
  std::vector<double> v;
  // M^-1 times the rows of D', body a at 0 and body b at 6.
  std::vector<std::array<double, 12>> MD;

  BodySweep(const ContactSystem& op, const Problem& p)
      : A(op.stored()), problem(p), v(6 * A.bodies.size()), MD(A.rows()) {
    for (std::size_t i = 0; i < A.rows(); ++i) {
      const JacobianRow& row = A.jacobian[i];
      if (row.body_a >= 0) A.bodies.apply(row.body_a, row.a.data(), MD[i].data());
      if (row.body_b >= 0) A.bodies.apply(row.body_b, row.b.data(), MD[i].data() + 6);
    }
  }
  void start(const std::vector<double>& x) {
    std::fill(v.begin(), v.end(), 0.0);
    for (std::size_t i = 0; i < A.rows(); ++i) change(i, x[i]);
  }
  // Only for rows of one block, which touch the same bodies in the same order.
  double entry(std::size_t i, std::size_t j) const {
    const JacobianRow &row = A.jacobian[i], &other = A.jacobian[j];
    double sum = i == j ? A.compliance[i] : 0.0;
    if (row.body_a >= 0 && row.body_a == other.body_a)
      for (int k = 0; k < 6; ++k) sum += row.a[k] * MD[j][k];
    if (row.body_b >= 0 && row.body_b == other.body_b)
      for (int k = 0; k < 6; ++k) sum += row.b[k] * MD[j][k + 6];
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
struct GaussSeidel : VectorIterate {
  static constexpr const char* name = "gauss-seidel";
  static constexpr Limits limits{100000, 10000, 0};
  // Sweeps between two sums of the velocities from scratch. A sum costs less than a sweep, and the rounding
  // of 20 sweeps is small beside any useful tolerance.
  static constexpr std::size_t renewal = 20;
  Sweep sweep;
  // Per block the largest Gershgorin bound of its diagonal block (1/kg), at least as large as any eigenvalue,
  // and at least P, the mean of the diagonal.
  std::vector<double> q;

  GaussSeidel(const Problem& p, const Options& o, Monitor& m)
      : VectorIterate(p, o, m), sweep{std::get<typename Sweep::Operator>(p.A), p}, q(p.K.blocks()) {}

  double start(const Start& s) {
    for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      for (int i = 0; i < S::dim; ++i) {
        double sum = 0;
        for (int j = 0; j < S::dim; ++j) sum += std::abs(sweep.entry(row + i, row + j));
        q[block] = std::max(q[block], sum);
      }
      q[block] = std::max(q[block], problem.P[block]);
    });
    return VectorIterate::start(s);
  }

  std::optional<double> step() {
    // The first sweep is iteration 1. A new sum removes the drift of the updated velocities.
    if ((monitor.iterations() - 1) % renewal == 0) sweep.start(x);
    for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double v[S::dim], g[S::dim], next[S::dim];
      for (int i = 0; i < S::dim; ++i) v[i] = sweep.velocity(row + i, x);
      add_de_saxce_term(set, law_of(problem, options), v, g);
      for (int i = 0; i < S::dim; ++i) g[i] = x[row + i] - options.sor.omega * g[i] / q[block];
      set.project(g, next);
      for (int i = 0; i < S::dim; ++i) {
        sweep.change(row + i, next[i] - x[row + i]);
        x[row + i] = next[i];
      }
    });
    ++monitor.products;
    return evaluate();
  }
  double step_size() const { return options.sor.omega; }
};

}  // namespace

// A sweep over bodies changes the velocities of two bodies per row; an impulse on a tree moves all of it.
Solution gauss_seidel(const Problem& problem, const Options& options, Budget& budget) {
  if (has_trees(problem)) return gauss_seidel(as_matrix(problem), options, budget);
  return std::visit(
      [&]<class Op>(const Op&) -> Solution {
        if constexpr (std::is_same_v<Op, CallbackOperator>)
          throw InputError(
              "gauss-seidel needs the rows of A, which a function operator does not have; use p-spg-fb");
        else if constexpr (std::is_same_v<Op, ContactSystem>)
          return complete(drive<GaussSeidel<BodySweep>>(problem, options, budget));
        else
          return complete(drive<GaussSeidel<MatrixSweep<Op>>>(problem, options, budget));
      },
      problem.A);
}

}  // namespace amontons
