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
  std::vector<double> x0;
  // Its last x, once it has started and stalled.
  std::vector<double> end;
  // Start of the run after the start of the race (s); number of its records in the history.
  double started_after = 0;
  std::size_t seen = 0;
  // Index of its record among the phases.
  std::size_t record = 0;

  double spent(const FactorCost& factor) const {
    return static_cast<double>(run->products()) * of->product +
           static_cast<double>(run->factorizations()) * factor.nominal;
  }
  // Whether it may start: only once. A contender that continues from the end of another one waits for it.
  bool may_start() const {
    return !run && end.empty() && (of->from != Contender::From::previous || !(this - 1)->end.empty());
  }
  double prior(const FactorCost& factor) const {
    return of->products * of->product + of->factorizations * factor.nominal;
  }
  double expected(double tolerance, const FactorCost& factor) const;
};

// Nominal cost from here to the tolerance. The first expectation holds until it is used up. Then the residual
// r at the total work w and the residual r_h at half of it give a rate, log(r_h / r) per w / 2.
double Runner::expected(double tolerance, const FactorCost& factor) const {
  if (!run) return prior(factor);
  const Mark& now = marks.back();
  // Factoring methods gain most at the end, so they are given the whole expected work. Other methods show
  // their rate at once.
  const double before = of->factorizations > 0 ? prior(factor) : 0;
  if (now.spent < before) return before - now.spent;
  const Mark* half = &marks.front();
  for (const Mark& mark : marks)
    if (mark.spent <= 0.5 * now.spent) half = &mark;
  const double progress =
      std::max(elementary::log(half->residual / now.residual), choice::policy.least_progress);
  const double left =
      elementary::log(now.residual / std::max(tolerance, 1e-16));  // not tuned: the rounding of a residual
  return (now.spent - half->spent) * left / progress;
}

class Race {
 public:
  Race(const Problem& problem, const Options& options, Budget& budget,
       const std::vector<Contender>& contenders, FactorCost factor, double work, ConstrainedProblem* rest)
      : problem_(problem), options_(options), budget_(budget), rest_(rest), factor_(factor) {
    const bool limited = options.max_iterations > 0 || std::isfinite(budget.left());
    work_ = limited ? std::numeric_limits<double>::infinity() : work;
    runners_.resize(contenders.size());
    for (std::size_t i = 0; i < contenders.size(); ++i) runners_[i].of = &contenders[i];
    if (options.callback)
      watch_ = [this](const IterationRecord& record) { return options_.callback(among_all(record)); };
  }

  Solution run() {
    while (Runner* next = favourite()) {
      turn(*next);
      if (ended_) break;
    }
    return result();
  }

 private:
  Runner* favourite();
  double analysed() const;
  void turn(Runner& r);
  void count_others(const Runner& r);
  void start(Runner& r);
  void end(Runner& r);
  IterationRecord among_all(IterationRecord record);
  Solution result();

  std::size_t iterations_left() const {
    return options_.max_iterations ? options_.max_iterations - std::min(iterations_, options_.max_iterations)
                                   : std::numeric_limits<std::size_t>::max();
  }
  double best_residual() const {
    double best = total_.x.empty() ? std::numeric_limits<double>::infinity() : total_.residual;
    for (const Runner& r : runners_)
      if (r.run) best = std::min(best, r.run->best_residual());
    return best;
  }

  const Problem& problem_;
  const Options& options_;
  Budget& budget_;
  ConstrainedProblem* rest_;
  FactorCost factor_;
  const Time clock_ = std::chrono::steady_clock::now();
  std::function<bool(const IterationRecord&)> watch_;
  std::vector<Runner> runners_;
  // The best of the contenders that have ended, and the records of all.
  Solution total_;
  std::optional<Status> ended_;
  double work_, spent_ = 0;
  std::size_t iterations_ = 0;
  // Counts of all contenders except the current one, for its records.
  std::size_t other_iterations_ = 0, other_products_ = 0;
  double now_started_ = 0;  // start of the current contender (s)
  double best_before_ = std::numeric_limits<double>::infinity();
};

// The analysis takes as long as some hundred iterations. Without time for it there is none for a
// factorisation.
double Race::analysed() const {
  constexpr double never = 1e18;  // ns; not tuned: thirty years
  const LeaveScope scope(budget_);
  try {
    return factor_.analyse(problem_);
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
    if (r.of->factorizations > 0 && 2 * factor_.nominal > time_left) continue;
    const double expected = r.expected(options_.tolerance, factor_);
    if (expected < least) {
      least = expected;
      favourite = &r;
    }
  }
  // Only now the true cost of the factorisations is worth an analysis.
  if (favourite && favourite->of->factorizations > 0 && factor_.analyse) {
    factor_.nominal = analysed();
    factor_.analyse = nullptr;
    return this->favourite();
  }
  return favourite;
}

// A contender starts from the best x of all, as a run of its own within the caller's limits.
void Race::start(Runner& r) {
  Options o = options_;
  if (watch_) o.callback = watch_;
  o.max_iterations = r.of->limit ? std::min(r.of->limit, iterations_left()) : options_.max_iterations;
  const Runner* from = nullptr;
  double best = total_.x.empty() ? std::numeric_limits<double>::infinity() : total_.residual;
  for (const Runner& other : runners_)
    if (other.run && other.run->best_residual() < best) {
      best = other.run->best_residual();
      from = &other;
    }
  if (r.of->from == Contender::From::previous) {
    o.x0 = (&r - 1)->end;
  } else if (r.of->from == Contender::From::best && std::isfinite(best)) {
    if (from)
      from->run->best(r.x0);
    else
      r.x0 = total_.x;
    o.x0 = r.x0;
  }
  r.seen = 0;
  r.run =
      rest_ && r.of->constrained ? rest_->start(r.of->start, o, budget_) : r.of->start(problem_, o, budget_);
  r.started_after = std::chrono::duration<double>(r.run->started() - clock_).count();
  r.marks.clear();
  r.record = total_.phases.size();
  total_.phases.push_back({r.run->name(), r.of->why, 0, 0});
}

void Race::turn(Runner& r) {
  count_others(r);
  best_before_ = best_residual();
  std::size_t iterations = r.of->first_turn;
  double spent = 0;
  std::size_t before = 0;
  if (!r.run) {
    start(r);
    now_started_ = r.started_after;
    r.run->advance(0);
    r.marks.push_back({r.spent(factor_), r.run->best_residual()});
  } else {
    now_started_ = r.started_after;
    before = r.run->iterations();
    spent = r.spent(factor_);
    iterations =
        std::max(iterations, static_cast<std::size_t>(choice::policy.turn * static_cast<double>(before)));
  }
  const bool over = r.run->advance(std::min(iterations, iterations_left()));
  iterations_ += r.run->iterations() - before;
  spent_ += r.spent(factor_) - spent;
  r.marks.push_back({r.spent(factor_), r.run->best_residual()});
  for (const auto& own = r.run->history(); r.seen < own.size(); ++r.seen)
    total_.history.push_back(among_all(own[r.seen]));
  if (over) end(r);
  if (!ended_ && iterations_left() == 0) ended_ = Status::iteration_limit;
  if (!ended_ && budget_.late()) ended_ = Status::deadline;
  if (!ended_ && (spent_ > work_ || budget_.exhausted())) ended_ = Status::stalled;
}

// Counts before this turn of r, without those of r in this run: its records continue from there.
void Race::count_others(const Runner& r) {
  other_iterations_ = iterations_ - (r.run ? r.run->iterations() : 0);
  other_products_ = total_.products;
  for (const Runner& other : runners_)
    if (other.run && &other != &r) other_products_ += other.run->products();
}

// A contender has ended, with a solution or without progress. Its status becomes that of the race only if no
// other contender can still end differently.
void Race::end(Runner& r) {
  Solution s = r.run->finish();
  total_.phases[r.record].iterations = s.iterations;
  total_.phases[r.record].residual = s.residual;
  r.run.reset();
  r.end = s.x;
  if (s.status == Status::converged || s.status == Status::infeasible || s.status == Status::interrupted ||
      s.status == Status::deadline)
    ended_ = s.status;
  join(total_, std::move(s));
}

// A record of the current contender with iterations, products, time and best residual of the whole race.
IterationRecord Race::among_all(IterationRecord record) {
  record.iteration += other_iterations_;
  record.products += other_products_;
  record.time += now_started_;
  record.best_residual = std::min(record.best_residual, best_before_);
  return record;
}

// Contenders still running: the best one is measured; for the others the counts suffice.
Solution Race::result() {
  while (true) {
    Runner* best = nullptr;
    for (Runner& r : runners_)
      if (r.run && (!best || r.run->best_residual() < best->run->best_residual())) best = &r;
    if (!best) break;
    if (total_.x.empty() || best->run->best_residual() < total_.residual) {
      Solution s = best->run->finish();
      total_.phases[best->record].iterations = s.iterations;
      total_.phases[best->record].residual = s.residual;
      join(total_, std::move(s));
    } else {
      total_.phases[best->record].iterations = best->run->iterations();
      total_.phases[best->record].residual = best->run->best_residual();
      total_.iterations += best->run->iterations();
      total_.products += best->run->products();
      total_.factorizations += best->run->factorizations();
    }
    best->run.reset();
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
              const std::vector<Contender>& contenders, FactorCost factor, double work,
              ConstrainedProblem* rest) {
  return Race(problem, options, budget, contenders, factor, work, rest).run();
}

}  // namespace amontons
