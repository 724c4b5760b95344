// F(x) = x - Pi(t0) - Q (t - t0) has the derivative M = 1 - Q + Q P^-1 B A, with B = 1 + e_n de_saxce'(u0)'
// for every contact: that of Newton's method (newton.cpp). M^+ is formed once. A nearby problem needs its
// product alone: x - M^+ F(x) errs by the square of the change, and a few of them by rounding.
//
// M is singular where impulses are not determined. M^+ is then the least change of impulses that does it.
#include "multibody/derivatives/held_faces.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "amontons/base/error.hpp"

namespace amontons {

namespace {

using Place = Eigen::Index;

// Pivots below this share of the largest are zero: M has no units.
constexpr double rank_threshold = 1e-10;
// Corrections of a nearby solution: the error after k of them is the change to the power k + 1. One that
// moves no velocity by more than `settled` of the fastest is the last: the next would be rounding.
constexpr int corrections = 6;
constexpr double settled = 1e-12;
// A direction in which impulses are not determined moves no body if velocities along it are this small.
constexpr double no_motion = 1e-7, rounding = 1e-10;
// A nearby problem has alike rows: 1 / mass and velocities differ by less than this share.
constexpr double alike = 1e-2;

// out = Q d
template <int n>
void times_face(const Face<n>& face, const double* d, double* out) {
  std::fill(out, out + n, 0.0);
  for (int k = 0; k < n; ++k) {
    double along = 0;
    for (int i = 0; i < n; ++i) along += face.vector[k][i] * d[i];
    for (int i = 0; i < n; ++i) out[i] += face.value[k] * along * face.vector[k][i];
  }
}

// A trial point is in the set, at its apex, or projected on its border.
enum class Region : unsigned char { inside, apex, border };
template <class S>
Region region_of(const S& set, const double* t) {
  double foot[S::dim];
  set.project(t, foot);
  bool inside = true, apex = true;
  for (int k = 0; k < S::dim; ++k) {
    inside = inside && foot[k] == t[k];
    apex = apex && foot[k] == 0;
  }
  return inside ? Region::inside : apex ? Region::apex : Region::border;
}

// Distances to the nearest border between faces, in the units of t.
double distance_to_border(const Bilateral&, const double*) { return std::numeric_limits<double>::infinity(); }
double distance_to_border(const NonNegative&, const double* t) { return std::abs(t[0]); }
double distance_to_border(const Interval& set, const double* t) {
  return std::min(std::abs(t[0] - set.lo), std::abs(t[0] - set.hi));
}
// Any cone. Outside, the distance to the cone is |t - Pi(t)| and that to its polar |Pi(t)| (Moreau). Within
// one of them, the way along the normal to its border is a bound that needs no form of the cone.
template <class S>
double distance_to_border(const S& set, const double* t) {
  double foot[S::dim], inside = 0, outside = 0;
  set.project(t, foot);
  for (int k = 0; k < S::dim; ++k) {
    inside += foot[k] * foot[k];
    outside += (t[k] - foot[k]) * (t[k] - foot[k]);
  }
  if (!set.has_friction()) return std::abs(t[0]);  // the half-line: tangents have no border
  if (inside > 0 && outside > 0) return std::sqrt(std::min(inside, outside));
  const double sign = inside > 0 ? -1 : 1;
  double low = 0, high = std::abs(t[0]);
  for (int halving = 0; halving < 50 && high > low; ++halving) {
    const double way = 0.5 * (low + high);
    double there[S::dim], left = 0;
    std::copy(t, t + S::dim, there);
    there[0] += sign * way;
    set.project(there, foot);
    for (int k = 0; k < S::dim; ++k) left += std::abs(sign < 0 ? foot[k] - there[k] : foot[k]);
    (left > 0 ? high : low) = way;
  }
  return low;
}

}  // namespace

// M^+ is formed, since many nearby problems are solved with it: a product takes a part of the time of a solve
// with factors. Newton's method takes out its rounding. M tells what a last correction leaves of F without
// another product with A, which would take longer.
struct HeldFaces::Factor {
  Eigen::MatrixXd of, inverse;
};

// The scale of trial points stays that of this solution: P of a nearby problem differs and would move them,
// although its solution does not depend on P.
HeldFaces::HeldFaces(const Problem& problem, Law law, std::vector<double> x)
    : law_(law), K_(problem.K), x_(std::move(x)), P_(problem.P), b_(problem.b) {
  AMONTONS_REQUIRE(x_.size() == problem.rows(), "x must have one entry per row");
  AMONTONS_REQUIRE(x_.size() <= most_rows, "the step has " + std::to_string(x_.size()) +
                                               " rows; derivatives are dense and take at most " +
                                               std::to_string(most_rows));
  u_.resize(x_.size());
  trial_.resize(x_.size());
  product(problem.A, x_, u_);
  for (std::size_t i = 0; i < u_.size(); ++i) u_[i] += b_[i];
  for_each_block(K_, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double g[S::dim];
    add_de_saxce_term(set, law_, &u_[row], g);
    for (int k = 0; k < S::dim; ++k) trial_[row + k] = x_[row + k] - g[k] / P_[block];
  });
  for (const double velocity : b_) fastest_ = std::max(fastest_, std::abs(velocity));
  find_margin(problem);
  if (!x_.empty()) form(problem);
}
HeldFaces::~HeldFaces() = default;

// In m/s: a change of the velocity of a row by dv moves its trial point by dv / p.
void HeldFaces::find_margin(const Problem& problem) {
  margin_ = std::numeric_limits<double>::infinity();
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    margin_ = std::min(margin_, P_[block] * distance_to_border(set, &trial_[row]));
  });
}

// A as a matrix; B A is formed in its memory. The column j of a
// block of M is e_j - Q (e_j - P^-1 B A e_j). The dense matrix is the limit of the size of a step: its
// factors take the cube of its rows, once per derivative.
void HeldFaces::form(const Problem& problem) {
  const auto n = static_cast<Place>(x_.size());
  const Problem dense = as_matrix(problem);
  Eigen::MatrixXd A = Eigen::Map<const Eigen::MatrixXd>(std::get<DenseOperator>(dense.A).data.data(), n, n);
  Eigen::MatrixXd M(n, n);
  for_each_block(K_, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    const auto at = static_cast<Place>(row);
    if constexpr (S::frictional) {
      if (law_ == Law::coulomb) {
        double slope[S::dim];
        set.de_saxce_gradient(&u_[row], slope);
        Eigen::RowVectorXd more = Eigen::RowVectorXd::Zero(n);
        for (int k = 0; k < S::dim; ++k) more += slope[k] * A.row(at + k);
        A.row(at) += more;
      }
    }
    const Face<S::dim> face = set.face(&trial_[row]);
    for (Place j = 0; j < n; ++j) {
      double d[S::dim], out[S::dim];
      for (int k = 0; k < S::dim; ++k) d[k] = A(at + k, j) / P_[block] - (at + k == j ? 1 : 0);
      times_face(face, d, out);
      for (int k = 0; k < S::dim; ++k) M(at + k, j) = out[k] + (at + k == j ? 1 : 0);
    }
  });
  // Its solutions are the shortest ones, and exist for a singular M.
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors(n, n);
  factors.setThreshold(rank_threshold);
  factors.compute(M);
  factor_ = std::make_unique<Factor>(Factor{std::move(M), factors.pseudoInverse()});
  if (factors.rank() == n) return;
  // A direction less M^+ M of it lies in the kernel. One without symmetry has a part along all of the kernel.
  // One product then shows whether any impulse of the kernel moves a body.
  Eigen::VectorXd free(n);
  for (Place i = 0; i < n; ++i) free[i] = 1 + 0.5 * std::sin(static_cast<double>(7 * i + 1));
  free -= factor_->inverse * (factor_->of * free);
  const Eigen::VectorXd moved = A * free;
  double largest = 0, scale = 0, most = 0;
  for_each_block(K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int k = 0; k < S::dim; ++k) {
      const auto i = static_cast<Place>(row) + k;
      largest = std::max(largest, std::abs(moved[i]));
      scale = std::max(scale, P_[block] * std::abs(free[i]));
      most = std::max(most, P_[block]);
    }
  });
  // Rows of nothing (P tiny) have a scale below the rounding of the others.
  determined_ = largest <= no_motion * scale + rounding * most * free.cwiseAbs().maxCoeff();
}

// Kinds and numbers of blocks must be the same. Points of a manifold may be found in another order. This
// shows in the mass or in the velocity of a row. An order without such a difference needs no attention: rows
// of one mass and velocity are alike.
double HeldFaces::distance(const Problem& problem, double closed) const {
  constexpr double unlike = std::numeric_limits<double>::infinity();
  if (problem.rows() != x_.size() || problem.K.blocks() != K_.blocks()) return unlike;
  if (problem.K.runs().size() != K_.runs().size()) return unlike;
  for (std::size_t k = 0; k < K_.runs().size(); ++k)
    if (problem.K.runs()[k].kind != K_.runs()[k].kind || problem.K.runs()[k].count != K_.runs()[k].count)
      return unlike;
  for (std::size_t k = 0; k < P_.size(); ++k)
    if (std::abs(problem.P[k] - P_[k]) > alike * P_[k]) return unlike;
  double largest = 0;
  for (std::size_t i = 0; i < b_.size(); ++i) {
    const double apart = std::abs(problem.b[i] - b_[i]);
    if (!(apart <= alike * (fastest_ + 1e-3) + closed)) return unlike;
    largest = std::max(largest, apart);
  }
  return largest;
}

// On the curved part of a set, where a contact slides, Pi and de_saxce are those of the nearby problem at x.
// The first of several problems of a step may be some way off. Elsewhere, and past a border, they are the
// tangents at the trial point and the velocity of this solution. The sets are those of the nearby problem. So
// a change of a friction coefficient, or of a bound, is in Pi(t0) and de_saxce(u0).
void HeldFaces::held_map(const Problem& problem, std::span<const double> x, std::vector<double>& u,
                         std::vector<double>& F) const {
  product(problem.A, x, u);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += problem.b[i];
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double g[S::dim], d[S::dim], foot[S::dim], moved[S::dim];
    if (S::frictional && region_of(set, &trial_[row]) == Region::border) {
      add_de_saxce_term(set, law_, &u[row], g);
      for (int k = 0; k < S::dim; ++k) d[k] = x[row + k] - g[k] / P_[block];
      if (region_of(set, d) == Region::border) {
        set.project(d, foot);
        for (int k = 0; k < S::dim; ++k) F[row + k] = x[row + k] - foot[k];
        return;
      }
    }
    for (int k = 0; k < S::dim; ++k) g[k] = u[row + k];
    if constexpr (S::frictional) {
      if (law_ == Law::coulomb) {
        double slope[S::dim];
        set.de_saxce_gradient(&u_[row], slope);
        g[0] += set.de_saxce(&u_[row]);
        for (int k = 0; k < S::dim; ++k) g[0] += slope[k] * (u[row + k] - u_[row + k]);
      }
    }
    for (int k = 0; k < S::dim; ++k) d[k] = x[row + k] - g[k] / P_[block] - trial_[row + k];
    set.project(&trial_[row], foot);
    times_face(set.face(&trial_[row]), d, moved);
    for (int k = 0; k < S::dim; ++k) F[row + k] = x[row + k] - foot[k] - moved[k];
  });
}

// Newton's method with the derivative of this solution. Only products with A of the nearby problem are
// needed, so that a nearby step costs little more than to pose its problem. Where the equations have no
// solution, a part of F is left by every correction.
HeldFaces::Nearby HeldFaces::solve(const Problem& problem) const {
  Nearby found{x_, 0};
  if (x_.empty()) return found;
  const auto n = static_cast<Place>(x_.size());
  std::vector<double> u(x_.size()), F(x_.size());
  Eigen::VectorXd change(n);
  double last = 0;
  for (int k = 0; k < corrections; ++k) {
    held_map(problem, found.x, u, F);
    change.noalias() = factor_->inverse * Eigen::Map<const Eigen::VectorXd>(F.data(), n);
    for (std::size_t i = 0; i < F.size(); ++i) found.x[i] -= change[static_cast<Place>(i)];
    // Corrections fall by a factor each, so that the next one is known: moved^2 / last.
    const double moved = largest_velocity(change.data());
    if (moved * (moved < last ? moved / last : 1) <= settled * fastest_) break;
    last = moved;
  }
  const Eigen::VectorXd left = Eigen::Map<const Eigen::VectorXd>(F.data(), n) - factor_->of * change;
  found.residual = largest_velocity(left.data());
  return found;
}

double HeldFaces::largest_velocity(const double* impulses) const {
  double largest = 0;
  for_each_block(K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int k = 0; k < S::dim; ++k)
      largest = std::max(largest, P_[block] * std::abs(impulses[row + static_cast<std::size_t>(k)]));
  });
  return largest;
}

}  // namespace amontons
