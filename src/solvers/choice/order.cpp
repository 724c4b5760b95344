// An order of methods: cheap iterations first, then factorisations, then what needs many of them.
//
//   for each method in turn
//     1.  it runs until it ends
//     2.  or until the tolerance, at its present rate, is further away than the next method from its start
//   then those that gave way go on, from their own states
//
// The number of factorisations of a central path hardly depends on the problem, and their work is counted
// when the first has been made. So there is one expectation (policy.hpp) and one rate to measure, that of the
// first-order method. Past work does not count in 2: a method that converges quickly is never left.
//
// The rate is that over the second half of its work, a compromise. Residuals of accelerated steps rise and
// fall, so the last iterations alone say little, and the first ones are quick everywhere.
#include "solvers/choice/order.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "amontons/base/budget.hpp"
#include "amontons/base/elementary.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "solvers/choice/policy.hpp"

namespace amontons {

namespace {

constexpr std::size_t no_limit = std::numeric_limits<std::size_t>::max();
constexpr double never = std::numeric_limits<double>::infinity();

// A method that runs or has run.
struct Runner {
  const Ordered* of;
  std::unique_ptr<Run> run;
  // Work and best residual at the end of each of its turns.
  struct Mark {
    double spent, residual;
  };
  std::vector<Mark> marks;
  // Its first x, and its last one once it has ended: the best x of the run, from which another may start.
  std::vector<double> x0, end;
  // Start of the run after the start of all (s); number of its records in the history.
  double started_after = 0;
  std::size_t seen = 0;
  // Index of its record among the phases.
  std::size_t record = 0;

  double expected(double tolerance) const;
};

// Work from here to the tolerance: the residual r at the work w and the residual r_h at half of it give the
// rate log(r_h / r) per w / 2.
double Runner::expected(double tolerance) const {
  const Mark& now = marks.back();
  const auto half = std::upper_bound(marks.begin(), marks.end(), 0.5 * now.spent,
                                     [](double work, const Mark& mark) { return work < mark.spent; }) -
                    1;
  const double progress =
      std::max(elementary::log(half->residual / now.residual), choice::policy.least_progress);
  const double rounding = 1e-16;  // not tuned: of a residual
  return (now.spent - half->spent) * elementary::log(now.residual / std::max(tolerance, rounding)) / progress;
}

class Order {
 public:
  Order(const Problem& problem, const Options& options, Budget& budget, const std::vector<Ordered>& methods,
        ConstrainedProblem* rest)
      : problem_(problem), options_(options), budget_(budget), rest_(rest) {
    total_.residual = never;
    runners_.resize(methods.size());
    for (std::size_t i = 0; i < methods.size(); ++i) runners_[i].of = &methods[i];
  }

  Solution run() {
    for (std::size_t i = 0; i < runners_.size() && !ended_; ++i) {
      Runner& r = runners_[i];
      if (!r.run) start(r);
      const Runner* next = i + 1 < runners_.size() ? &runners_[i + 1] : nullptr;
      while (r.run && !ended_ && !gives_way(r, next)) turn(r, next ? choice::policy.first_turn : no_limit);
    }
    for (Runner& r : runners_)
      if (r.run && !ended_) turn(r, no_limit);
    return result();
  }

 private:
  double factor_work();
  bool gives_way(const Runner& r, const Runner* next);
  void turn(Runner& r, std::size_t iterations);
  void start(Runner& r);
  Status finish(Runner& r);
  IterationRecord among_all(IterationRecord record) const;
  Solution result();

  std::size_t iterations_left() const {
    return options_.max_iterations ? options_.max_iterations - std::min(iterations_, options_.max_iterations)
                                   : no_limit;
  }
  // The running method with the best residual; null if one that has ended is as good.
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
  const Time clock_ = std::chrono::steady_clock::now();
  std::vector<Runner> runners_;
  // The best of the methods that have ended, and the records of all.
  Solution total_;
  std::optional<Status> ended_;
  // The work of a factorisation, once it has been counted.
  std::optional<double> factor_work_;
  std::size_t iterations_ = 0;
  // Totals that the records of the current turn continue: iterations and products of the other methods, the
  // start of the current one (s), and the best residual before the turn.
  IterationRecord others_{};
};

// The analysis takes as long as some hundred iterations. Without time for it there is none for a
// factorisation.
double Order::factor_work() {
  const LeaveScope scope(budget_);
  try {
    return ShiftedSystem(problem_).factor_work() / Budget::multiplications;
  } catch (const LeftEarly&) {
    return never;
  }
}

// Only if the next method would be worth it without fill is the work of its factorisations worth an analysis.
// A method that the limits would end early does not start.
bool Order::gives_way(const Runner& r, const Runner* next) {
  if (r.of->factorizations > 0 || !next || next->of->factorizations == 0 || r.marks.size() < 2) return false;
  const double expected = r.expected(options_.tolerance);
  const double assembly = choice::policy.assembly * static_cast<double>(problem_.K.blocks());
  const auto worth = [&](double factor) {
    const double work = next->of->factorizations * (assembly + factor);
    const double time = work * 2e-8;  // not tuned: s per unit of work
    return work < expected && work < budget_.work_left() && !budget_.ends_within(time);
  };
  if (!worth(0)) return false;
  if (!factor_work_) factor_work_ = factor_work();
  return worth(*factor_work_);
}

// A run of its own within the caller's limits. A method after another one starts from its end, because near
// the best x Coulomb's law may have no solution.
void Order::start(Runner& r) {
  Options o = options_;
  if (options_.callback)
    o.callback = [this](const IterationRecord& record) { return options_.callback(among_all(record)); };
  o.max_iterations = r.of->limit ? std::min(r.of->limit, iterations_left()) : options_.max_iterations;
  if (r.of->from_the_end)
    r.x0 = (&r - 1)->end;
  else if (Runner* from = leader())
    from->run->best(r.x0);
  else
    r.x0 = total_.x;
  if (!r.x0.empty()) o.x0 = r.x0;
  r.run = rest_ && r.of->factorizations == 0 ? rest_->start(r.of->start, o, budget_)
                                             : r.of->start(problem_, o, budget_);
  r.started_after = std::chrono::duration<double>(r.run->started() - clock_).count();
  r.record = total_.phases.size();
  total_.phases.push_back({r.run->name(), r.of->why, 0, 0});
  turn(r, 0);
}

void Order::turn(Runner& r, std::size_t iterations) {
  const Runner* best = leader();
  others_.best_residual = best ? best->run->best_residual() : total_.residual;
  others_.iteration = iterations_ - r.run->iterations();
  others_.products = total_.products;
  for (const Runner& other : runners_)
    if (other.run && &other != &r) others_.products += other.run->products();
  others_.time = r.started_after;
  const std::size_t before = r.run->iterations();
  const double spent = budget_.spent();
  const bool over = r.run->advance(std::min(iterations, iterations_left()));
  iterations_ += r.run->iterations() - before;
  r.marks.push_back(
      {(r.marks.empty() ? 0 : r.marks.back().spent) + budget_.spent() - spent, r.run->best_residual()});
  for (const auto& own = r.run->history(); r.seen < own.size(); ++r.seen)
    total_.history.push_back(among_all(own[r.seen]));
  // The status of a method becomes that of all only if no other method can still end differently.
  const Status status = over ? finish(r) : Status::stalled;
  if (status != Status::stalled && status != Status::iteration_limit)
    ended_ = status;
  else if (iterations_left() == 0)
    ended_ = Status::iteration_limit;
  else if (budget_.late())
    ended_ = Status::deadline;
  else if (budget_.exhausted())
    ended_ = Status::stalled;
}

// Ends a method, with a solution or without progress, and tells how it ended.
Status Order::finish(Runner& r) {
  Solution s = r.run->finish();
  const Status status = s.status;
  total_.phases[r.record].iterations = s.iterations;
  total_.phases[r.record].residual = s.residual;
  r.run.reset();
  r.end = s.x;
  join(total_, std::move(s));
  return status;
}

// A record of the current method with iterations, products, time and best residual of all.
IterationRecord Order::among_all(IterationRecord record) const {
  record.iteration += others_.iteration;
  record.products += others_.products;
  record.time += others_.time;
  record.best_residual = std::min(record.best_residual, others_.best_residual);
  return record;
}

// Methods still running: the best one is measured; for the others the counts suffice.
Solution Order::result() {
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

Solution in_order(const Problem& problem, const Options& options, Budget& budget,
                  const std::vector<Ordered>& methods, ConstrainedProblem* rest) {
  return Order(problem, options, budget, methods, rest).run();
}

}  // namespace amontons
