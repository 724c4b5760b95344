// ADMM with over-relaxation on x = z, z in K, in the P metric, docs/algorithm.md (26):
//
//     x := (A + rho P)^-1 (rho P (z - w) - b),   z := Pi_K(x^ + w),   w := w + x^ - z,
//     x^ = 1.6 x + (1 - 1.6) z_old,
//
// with one factorisation of A + rho P, in body space if there are bodies. It minimises the augmented
// Lagrangian 1/2 x'Ax + b'x + rho/2 |x - z + w|_P^2 in turn over x, without K, and over z in K, without A. w
// is the scaled multiplier of x = z. At a fixed point x = z. The first line then gives -rho P w = A x + b =
// u, the third z = Pi_K(z - P^-1 u / rho). So z is a solution for any rho > 0.
//
// Sources: Boyd et al. 2011; Stellato et al., "OSQP", 2020 (relaxation, balancing of rho). The De Saxce term
// is refreshed inside the loop as in Carpentier et al. 2024.
#include "amontons/solvers/companions/admm.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "solvers/companions/anderson.hpp"

namespace amontons {

namespace {

// In (0, 2); 1.6 as in OSQP.
constexpr double relaxation = 1.6;
// Number of differences of the Anderson acceleration.
constexpr int memory = 10;
// First rho, relative to P. It is small, because the important modes in stacks and chains have curvatures far
// below the diagonal. The balance corrects it.
constexpr double first_rho = 0.03;
// Iterations before the first balance of the residuals: earlier residuals still depend on the start.
constexpr std::size_t balance_period = 25;
// rho changes, and A + rho P is factored again, beyond this factor; a smaller change gains too little.
constexpr double balance_factor = 5;
// Bounds of rho. Beyond them A or rho P is lost in the rounding of the sum.
constexpr double smallest_rho = 1e-6, largest_rho = 1e6;

// One iteration is the fixed-point map t := F(t) of t = x^ + w, the point before projection, which holds the
// whole state: z = Pi_K(t), w = t - z. Anderson acceleration works on t in the P metric, in which F is
// non-expansive under associated: t_ and image_ hold P^1/2 t. The iterate x of the driver is z, a point of K.
class Admm : public VectorIterate {
 public:
  static constexpr const char* name = "admm";
  static constexpr Limits limits{20000, 2000, 0};

  Admm(const Problem& p, const Options& o, Monitor& m)
      : VectorIterate(p, o, m), anderson_(p.rows(), memory) {}

  // At a solution w = -g / (rho P), so a good x0 gives a good multiplier.
  double start(const Start& s) {
    VectorIterate::start(s);
    system_.emplace(problem);
    R_.resize(system_->factor_size());
    for (std::vector<double>* v : {&t_, &image_, &rhs_, &solution_}) v->resize(x.size());
    for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      const double root = std::sqrt(problem.P[block]);
      double g[S::dim];
      add_saxce_term(set, law_of(problem, options), &u[row], g);
      for (int k = 0; k < S::dim; ++k) t_[row + k] = root * (x[row + k] - g[k] / (rho_ * problem.P[block]));
    });
    factor();
    return project_t();
  }

  std::optional<double> step() {
    solve_for_x();
    const double ratio = relax();
    anderson_.advance(t_, image_);
    if (!(options.admm.rho > 0) && monitor.iterations() >= next_balance_) balance(ratio);
    return project_t();
  }
  double step_size() const { return rho_; }

 private:
  void factor() {
    for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t) {
      double* r = &R_[system_->factor_offset(block)];
      for (int k = 0; k < S::dim; ++k) r[(S::dim + 1) * k] = 1 / std::sqrt(rho_ * problem.P[block]);
    });
    system_->factor(R_);
    monitor.count_factorization(system_->factor_work());
  }

  // z = Pi_K(t), u = A z + b
  double project_t() {
    for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      const double root = std::sqrt(problem.P[block]);
      double trial[S::dim];
      for (int k = 0; k < S::dim; ++k) trial[k] = t_[row + k] / root;
      set.project(trial, &x[row]);
    });
    return evaluate();
  }

  // (A + rho P) x = rho P (z - w) - b - s e_n with w = t - z. Under coulomb u_t in the De Saxce term is taken
  // from the multiplier, -rho P w = u + s e_n. The multiplier lies in the dual cone at every iteration, while
  // A z + b is inaccurate until the end.
  void solve_for_x() {
    for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      const double p = problem.P[block], root = std::sqrt(p);
      double v[S::dim], g[S::dim];
      for (int k = 0; k < S::dim; ++k) v[k] = rho_ * p * (x[row + k] - t_[row + k] / root);
      add_saxce_term(set, law_of(problem, options), v, g);
      for (int k = 0; k < S::dim; ++k)
        rhs_[row + k] = rho_ * p * x[row + k] + v[k] - problem.b[row + k] - (g[k] - v[k]);
    });
    system_->solve(rhs_, solution_, 0);
    ++monitor.products;
  }

  // image = F(t). Returns |x - z| / (rho |z - z_old|), the ratio of primal and dual residual in the P metric.
  // It is the factor by which rho is wrong: a larger rho pulls x towards z and lets z move less.
  double relax() {
    double primal = 0, dual = 0;
    for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      const double p = problem.P[block], root = std::sqrt(p);
      double trial[S::dim], next[S::dim];
      for (int k = 0; k < S::dim; ++k) {
        trial[k] = t_[row + k] / root + relaxation * (solution_[row + k] - x[row + k]);
        image_[row + k] = root * trial[k];
      }
      set.project(trial, next);
      for (int k = 0; k < S::dim; ++k) {
        primal += p * (solution_[row + k] - next[k]) * (solution_[row + k] - next[k]);
        dual += p * (next[k] - x[row + k]) * (next[k] - x[row + k]);
      }
    });
    return std::sqrt(primal) / std::max(rho_ * std::sqrt(dual), 1e-300);
  }

  // The waits double, so that factorisations stay few and rho converges: convergence is not proven if rho
  // changes for ever. The multiplier -rho P w stays, so w is scaled by rho_old / rho_new.
  void balance(double ratio) {
    next_balance_ = 2 * monitor.iterations();
    if (ratio < balance_factor && ratio > 1 / balance_factor) return;
    const double next = std::clamp(rho_ * ratio, smallest_rho, largest_rho);
    for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      const double root = std::sqrt(problem.P[block]);
      double trial[S::dim], foot[S::dim];
      for (int k = 0; k < S::dim; ++k) trial[k] = t_[row + k] / root;
      set.project(trial, foot);
      for (int k = 0; k < S::dim; ++k) t_[row + k] = root * (foot[k] + (trial[k] - foot[k]) * rho_ / next);
    });
    rho_ = next;
    factor();
    anderson_.reset();
  }

  std::optional<ShiftedSystem> system_;
  Anderson anderson_;
  // solution_: x of the iteration, before projection.
  std::vector<double> t_, image_, rhs_, solution_, R_;
  double rho_ = options.admm.rho > 0 ? options.admm.rho : first_rho;
  std::size_t next_balance_ = balance_period;
};

}  // namespace

std::unique_ptr<Run> start_admm(const Problem& problem, const Options& options, Budget& budget) {
  return drive<Admm>(problem, options, budget);
}

Solution admm(const Problem& problem, const Options& options, Budget& budget) {
  return complete(start_admm(problem, options, budget));
}

}  // namespace amontons
