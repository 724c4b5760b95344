#include "solvers/choice/direct_way.hpp"

#include <limits>

#include "amontons/solvers/direct/elimination.hpp"

namespace amontons {

namespace {

// Rows of an island, and of a problem, beyond which another way is certain to be better.
constexpr double most_rows = 180, most_rows_in_all = 3000;
// ns: at all, for each row, for the dense matrix of an island of n rows n^2 and n^3. Least squares on the
// relative errors over the tuning half of the corpus.
constexpr double setup = 2400, per_row = 180, per_square = 3.3, per_cube = 0.03;

// One that is begun and ended in its first turn.
class DirectRun final : public Run {
 public:
  DirectRun(const Problem& problem, const Options& options) : problem_(problem), options_(options) {}

  bool advance(std::size_t iterations) override {
    if (iterations == 0) return false;
    if (elimination_.solve(problem_, options_, s_)) return true;
    // Contradictory rows, or no factorisation: others have to find out.
    s_.x.assign(problem_.rows(), 0.0);
    measure(problem_, options_.law, s_);
    s_.products = 1;
    s_.iterations = s_.factorizations = 0;
    s_.status = s_.residual <= options_.tolerance ? Status::converged : Status::stalled;
    s_.method = name();
    return true;
  }
  const char* name() const override { return "elimination"; }
  double best_residual() const override {
    return s_.x.empty() ? std::numeric_limits<double>::infinity() : s_.residual;
  }
  void best(std::vector<double>& x) const override { x = s_.x; }
  std::size_t iterations() const override { return s_.iterations; }
  std::size_t products() const override { return s_.products; }
  std::size_t factorizations() const override { return s_.factorizations; }
  Time started() const override { return started_; }
  const std::vector<IterationRecord>& history() const override { return s_.history; }
  Solution finish() override { return std::move(s_); }

 private:
  const Problem& problem_;
  const Options options_;  // those of a race last as long as its call
  const Time started_ = std::chrono::steady_clock::now();
  Elimination elimination_;
  Solution s_;
};

}  // namespace

double elimination_cost(const Problem& problem, const Options& options) {
  constexpr double never = std::numeric_limits<double>::infinity();
  const auto rows = static_cast<double>(problem.rows());
  if (!std::holds_alternative<ContactSystem>(problem.A) || options.history || options.callback ||
      rows > most_rows_in_all)
    return never;
  std::vector<Index> island;
  std::vector<double> size(find_islands(problem.graph, island), 0.0);
  for (const SetRun& run : problem.K.runs())
    visit_kind(run.kind, [&]<class S>() {
      if constexpr (!std::is_same_v<S, Free>)
        for (std::size_t i = 0; i < run.count; ++i) size[island[run.block + i]] += S::dim;
    });
  double cost = setup + per_row * rows;
  for (const double n : size) {
    if (n > most_rows) return never;
    cost += (per_square + per_cube * n) * n * n;
  }
  return cost;
}

std::unique_ptr<Run> start_elimination(const Problem& problem, const Options& options) {
  return std::make_unique<DirectRun>(problem, options);
}

}  // namespace amontons
