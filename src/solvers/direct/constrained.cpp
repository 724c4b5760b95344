// A product with W of the remaining rows (c) is D_c', a solve with the factors of K in place of M^-1
// (mechanism.hpp), and D_c. Its q is the u of the whole problem if only bilateral rows (f) act:
//   u_c = D_c v + E_c x_c + b_c,   K (v, -x_f) = (D_c'x_c, -b_f).
// P of the remaining rows is that of the whole problem, so natural maps agree. Residuals differ only in their
// divisor, the map of zero impulses.
#include "solvers/direct/constrained.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "amontons/problem/residual.hpp"
#include "solvers/direct/policy.hpp"

namespace amontons {

namespace {

// A run on the remaining rows, presented as a run on the whole problem. Its residual needs no product of the
// whole: bilateral rows hold, so their part of the natural map is zero except for rounding. finish() measures
// that rounding and removes it if necessary.
class ConstrainedRun final : public Run {
 public:
  ConstrainedRun(ConstrainedProblem& problem, Starter starter, const Options& options, Budget& budget)
      : problem_(problem), options_(options) {
    Options inner = options;
    inner.tolerance = direct::policy.reduced_share * options.tolerance / problem.ratio();
    // The start drops impulses of bilateral rows: they follow from the others.
    if (!options.x0.empty()) problem.restrict_to_rest(options.x0, x0_);
    inner.x0 = x0_;
    inner_ = starter(problem.rest(), inner, budget);
  }
  bool advance(std::size_t iterations) override { return inner_->advance(iterations); }
  const char* name() const override { return inner_->name(); }
  double best_residual() const override { return problem_.ratio() * inner_->best_residual(); }
  void best(std::vector<double>& x) const override {
    inner_->best(rest_);
    problem_.extend(rest_, x);
  }
  std::size_t iterations() const override { return inner_->iterations(); }
  std::size_t products() const override { return inner_->products(); }
  std::size_t factorizations() const override { return inner_->factorizations(); }
  Time started() const override { return inner_->started(); }
  const std::vector<IterationRecord>& history() const override { return inner_->history(); }

  Solution finish() override {
    Solution s = inner_->finish();
    rest_ = std::move(s.x);
    problem_.extend(rest_, s.x);
    // The residual of the whole problem, joints included: the residual of the remaining rows is never
    // reported.
    measure(problem_.whole(), law_of(problem_.whole(), options_), s);
    ++s.products;
    // A correction removes the rounding of K. Where it does not halve the residual, only that of the product
    // is left, or an error of the other rows, which no correction reaches.
    for (double before = std::numeric_limits<double>::infinity();
         s.residual > options_.tolerance && s.residual < 0.5 * before; ++s.products) {
      before = s.residual;
      problem_.correct(s.u, s.x);
      measure(problem_.whole(), law_of(problem_.whole(), options_), s);
    }
    if (s.residual <= options_.tolerance)
      s.status = Status::converged;
    else if (s.status == Status::converged)
      s.status = Status::stalled;
    return s;
  }

 private:
  ConstrainedProblem& problem_;
  Options options_;
  std::vector<double> x0_;
  mutable std::vector<double> rest_;
  std::unique_ptr<Run> inner_;
};

}  // namespace

bool ConstrainedProblem::make(const Problem& problem, Law law) {
  if (!mechanism_.factor_held(problem) || mechanism_.rows().size() == problem.rows()) return false;
  problem_ = &problem;
  const auto* A = &std::get<ContactSystem>(problem.A);
  held_.clear();
  for (std::size_t i = 0; i < A->bodies.size(); ++i)
    if (mechanism_.last_node(static_cast<Index>(i)) >= 0) held_.push_back(static_cast<Index>(i));
  // q is u for impulses that only hold the joints.
  Solution at_zero;
  extend({}, at_zero.x);
  measure(problem, law, at_zero);
  // All other sets, in their order: ContactSystem requires contacts first.
  SetProduct K;
  ContactSystem rest;
  rest.bodies = A->bodies;
  rest.contacts = A->contacts;
  rest.contact_compliance = A->contact_compliance;
  std::vector<double> q;
  const std::size_t contact_rows = A->contact_rows();
  row_.clear();
  for (const SetRun& run : problem.K.runs())
    visit_kind(run.kind, [&]<class S>() {
      if constexpr (!std::is_same_v<S, Bilateral>) {
        K.append(std::span<const S>(problem.K.all<S>()).subspan(run.first, run.count));
        for (std::size_t row = run.row; row < run.row + S::dim * run.count; ++row) {
          row_.push_back(row);
          q.push_back(at_zero.u[row]);
          if (row < contact_rows) continue;
          rest.jacobian.push_back(A->jacobian[row - contact_rows]);
          rest.compliance.push_back(A->compliance[row - contact_rows]);
        }
      }
    });
  const auto move = [this, bodies = A->bodies](double* w) { mechanism_.move(bodies, held_, w, z_); };
  rest.constrained = std::make_shared<ConstrainedBodies>(ConstrainedBodies{held_, move});
  rest_ = trusted_problem(std::move(rest), std::move(q), std::move(K), law);
  ratio_ = natural_map_at_zero(rest_, law) / natural_map_at_zero(problem, law);
  return ratio_ > 0 && std::isfinite(ratio_);
}

void ConstrainedProblem::restrict_to_rest(std::span<const double> x, std::vector<double>& rest) const {
  rest.clear();
  for (std::size_t row : row_) rest.push_back(x[row]);
}

void ConstrainedProblem::extend(std::span<const double> rest, std::vector<double>& x) {
  x.assign(problem_->rows(), 0.0);
  for (std::size_t i = 0; i < rest.size(); ++i) x[row_[i]] = rest[i];
  mechanism_.hold(*problem_, x, wrenches_, z_);
}

std::unique_ptr<Run> ConstrainedProblem::start(Starter starter, const Options& options, Budget& budget) {
  return std::make_unique<ConstrainedRun>(*this, starter, options, budget);
}

}  // namespace amontons
