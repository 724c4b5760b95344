// A race of methods without thresholds tuned to particular scenes: it measures the rates of convergence.
//
//   while no contender has reached the tolerance
//     1.  choose the contender with the least expected nominal cost from here to the tolerance
//     2.  its turn: it continues from its own state until its total work has grown by a quarter
//     3.  update its expected cost from its rate over the second half of its work
//
// Past cost does not count in 1: only the remaining cost matters. A first-order method that converges quickly
// is never left. One that slows down hands over once its remaining cost, at its present rate, exceeds the
// expected cost of a factoring method from the start. It continues if that method is slower than expected.
// Each contender keeps momentum, metric and step lengths; a restart from a shared iterate would lose them.
//
// Measuring the rate over half of the work is a compromise. Residuals of spectral and accelerated steps rise
// and fall, so the last iterations alone say little, and the first ones are quick everywhere. A method
// without progress is expected to need many times its past work. Stagnating contenders therefore get turns
// that grow together, none is starved, and the race costs at most a multiple of the winner alone.
#include "solvers/choice/race.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "amontons/base/budget.hpp"
#include "amontons/base/elementary.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "solvers/choice/policy.hpp"

namespace amontons {

namespace {

// A contender in the race.
struct Runner {
  const Contender* of;
  std::unique_ptr<Run> run;
  // Nominal cost and best residual at the end of each of its turns.
  struct Mark {
    double spent, residual;
  };
  std::vector<Mark> marks;
  // Its first x, and its last one once it has ended.
  std::vector<double> x0, end;
  // Start of the run after the start of the race (s); number of its records in the history.
  double started_after = 0;
  std::size_t seen = 0;
  // Index of its record among the phases.
  std::size_t record = 0;

  bool factors() const { return of->factorizations > 0; }
  double spent(const Costs& costs) const {
    return factors() ? static_cast<double>(run->factorizations()) * costs.factorization
                     : static_cast<double>(run->products()) * costs.product;
  }
  // Whether it may start: only once. A contender that continues from the end of another one waits for it.
  bool may_start() const { return !run && end.empty() && (!of->after_previous || !(this - 1)->end.empty()); }
  double prior(const Costs& costs) const {
    return of->products * costs.product + of->factorizations * costs.factorization;
  }
  double expected(double tolerance, const Costs& costs) const;
};

// Nominal cost from here to the tolerance. The first expectation holds until it is used up. Then the residual
// r at the total work w and the residual r_h at half of it give a rate, log(r_h / r) per w / 2.
double Runner::expected(double tolerance, const Costs& costs) const {
  if (!run) return prior(costs);
  const Mark& now = marks.back();
  // Factoring methods gain most at the end, so they are given the whole expected work. Other methods show
  // their rate at once.
  const double before = factors() ? prior(costs) : 0;
  if (now.spent < before) return before - now.spent;
  const Mark* half = &marks.front();
  for (const Mark& mark : marks)
    if (mark.spent <= 0.5 * now.spent) half = &mark;
  const double progress = std::max(elementary::log(half->residual / now.residual), choice::policy.turn);
  const double left =
      elementary::log(now.residual / std::max(tolerance, 1e-16));  // not tuned: the rounding of a residual
  return (now.spent - half->spent) * left / progress;
}

class Race {
 public:
  Race(const Problem& problem, const Options& options, Budget& budget,
       const std::vector<Contender>& contenders, const Costs& costs, double work, ConstrainedProblem* rest)
      : problem_(problem), options_(options), budget_(budget), rest_(rest), costs_(costs) {
    constexpr double unlimited = std::numeric_limits<double>::infinity();
    work_ = options.max_iterations > 0 || std::isfinite(budget.left()) ? unlimited : work;
    total_.residual = unlimited;
    runners_.resize(contenders.size());
    for (std::size_t i = 0; i < contenders.size(); ++i) runners_[i].of = &contenders[i];
  }

  Solution run() {
    while (!ended_) {
      Runner* next = favourite();
      if (!next) break;
      turn(*next);
    }
    return result();
  }

 private:
  Runner* favourite();
  double analysed() const;
  void turn(Runner& r);
  void start(Runner& r);
  Status finish(Runner& r);
  IterationRecord among_all(IterationRecord record) const;
  Solution result();

  std::size_t iterations_left() const {
    return options_.max_iterations ? options_.max_iterations - std::min(iterations_, options_.max_iterations)
                                   : std::numeric_limits<std::size_t>::max();
  }
  // The running contender with the best residual; null if one that has ended is as good.
  Runner* leader() {
    Runner* best = nullptr;
    for (Runner& r : runners_) {
      if (!r.run) continue;
      const bool first = !best && total_.x.empty();
      if (first || r.run->best_residual() < (best ? best->run->best_residual() : total_.residual)) best = &r;
    }
    return best;
  }

  const Problem& problem_;
  const Options& options_;
  Budget& budget_;
  ConstrainedProblem* rest_;
  Costs costs_;
  const Time clock_ = std::chrono::steady_clock::now();
  std::vector<Runner> runners_;
  // The best of the contenders that have ended, and the records of all.
  Solution total_;
  std::optional<Status> ended_;
  double work_, spent_ = 0;
  std::size_t iterations_ = 0;
  // Totals that the records of the current turn continue: iterations and products of the other contenders,
  // the start of the current one (s), and the best residual before the turn.
  IterationRecord others_{};
};

// The analysis takes as long as some hundred iterations. Without time for it there is none for a
// factorisation.
double Race::analysed() const {
  constexpr double never = 1e18;  // ns; not tuned: thirty years
  const LeaveScope scope(budget_);
  try {
    return costs_.analyse(problem_);
  } catch (const LeftEarly&) {
    return never;
  }
}

Runner* Race::favourite() {
  Runner* favourite = nullptr;
  double least = std::numeric_limits<double>::infinity();
  const double time_left = 1e9 * budget_.left();  // not tuned: ns per s
  for (Runner& r : runners_) {
    if (!r.run && !r.may_start()) continue;
    // A deadline during a factorisation would leave the caller without a result.
    if (r.factors() && 2 * costs_.factorization > time_left) continue;
    const double expected = r.expected(options_.tolerance, costs_);
    if (expected < least) {
      least = expected;
      favourite = &r;
    }
  }
  // Only now the true cost of the factorisations is worth an analysis.
  if (favourite && favourite->factors() && costs_.analyse) {
    costs_.factorization = analysed();
    costs_.analyse = nullptr;
    return this->favourite();
  }
  return favourite;
}

// A run of its own within the caller's limits. A method after another one starts from its end, because near
// the best x Coulomb's law may have no solution.
void Race::start(Runner& r) {
  Options o = options_;
  if (options_.callback)
    o.callback = [this](const IterationRecord& record) { return options_.callback(among_all(record)); };
  o.max_iterations = r.of->limit ? std::min(r.of->limit, iterations_left()) : options_.max_iterations;
  if (r.of->after_previous)
    r.x0 = (&r - 1)->end;
  else if (Runner* from = leader())
    from->run->best(r.x0);
  else
    r.x0 = total_.x;
  if (!r.x0.empty()) o.x0 = r.x0;
  r.run = rest_ && !r.factors() ? rest_->start(r.of->start, o, budget_) : r.of->start(problem_, o, budget_);
  r.started_after = std::chrono::duration<double>(r.run->started() - clock_).count();
  r.record = total_.phases.size();
  total_.phases.push_back({r.run->name(), r.of->why, 0, 0});
}

void Race::turn(Runner& r) {
  const Runner* best = leader();
  others_.best_residual = best ? best->run->best_residual() : total_.residual;
  others_.iteration = iterations_ - (r.run ? r.run->iterations() : 0);
  others_.products = total_.products;
  for (const Runner& other : runners_)
    if (other.run && &other != &r) others_.products += other.run->products();
  std::size_t iterations = r.of->to_the_end ? iterations_left() : r.factors() ? 1 : choice::policy.first_turn;
  std::size_t before = 0;
  double spent = 0;
  if (r.run) {
    before = r.run->iterations();
    spent = r.spent(costs_);
    iterations =
        std::max(iterations, static_cast<std::size_t>(choice::policy.turn * static_cast<double>(before)));
    others_.time = r.started_after;
  } else {
    start(r);
    others_.time = r.started_after;
    r.run->advance(0);
    r.marks.push_back({r.spent(costs_), r.run->best_residual()});
  }
  const bool over = r.run->advance(std::min(iterations, iterations_left()));
  iterations_ += r.run->iterations() - before;
  spent_ += r.spent(costs_) - spent;
  r.marks.push_back({r.spent(costs_), r.run->best_residual()});
  for (const auto& own = r.run->history(); r.seen < own.size(); ++r.seen)
    total_.history.push_back(among_all(own[r.seen]));
  // The status of a contender becomes that of the race only if no other contender can still end differently.
  const Status status = over ? finish(r) : Status::stalled;
  if (status != Status::stalled && status != Status::iteration_limit)
    ended_ = status;
  else if (iterations_left() == 0)
    ended_ = Status::iteration_limit;
  else if (budget_.late())
    ended_ = Status::deadline;
  else if (spent_ > work_ || budget_.exhausted())
    ended_ = Status::stalled;
}

// Ends a contender, with a solution or without progress, and tells how it ended.
Status Race::finish(Runner& r) {
  Solution s = r.run->finish();
  const Status status = s.status;
  total_.phases[r.record].iterations = s.iterations;
  total_.phases[r.record].residual = s.residual;
  r.run.reset();
  r.end = s.x;
  join(total_, std::move(s));
  return status;
}

// A record of the current contender with iterations, products, time and best residual of the whole race.
IterationRecord Race::among_all(IterationRecord record) const {
  record.iteration += others_.iteration;
  record.products += others_.products;
  record.time += others_.time;
  record.best_residual = std::min(record.best_residual, others_.best_residual);
  return record;
}

// Contenders still running: the best one is measured; for the others the counts suffice.
Solution Race::result() {
  if (Runner* best = leader()) finish(*best);
  for (const Runner& r : runners_) {
    if (!r.run) continue;
    total_.phases[r.record].iterations = r.run->iterations();
    total_.phases[r.record].residual = r.run->best_residual();
    total_.iterations += r.run->iterations();
    total_.products += r.run->products();
    total_.factorizations += r.run->factorizations();
  }
  total_.status = total_.residual <= options_.tolerance ? Status::converged
                  : ended_ == Status::converged         ? Status::stalled
                                                        : ended_.value_or(Status::stalled);
  total_.time = seconds_since(clock_);
  total_.reason = describe(total_.phases);
  return std::move(total_);
}

}  // namespace

Solution race(const Problem& problem, const Options& options, Budget& budget,
              const std::vector<Contender>& contenders, const Costs& costs, double work,
              ConstrainedProblem* rest) {
  return Race(problem, options, budget, contenders, costs, work, rest).run();
}

}  // namespace amontons
