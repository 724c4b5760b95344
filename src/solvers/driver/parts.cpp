#include "amontons/solvers/driver/parts.hpp"

#include "amontons/solvers/driver/phases.hpp"

namespace amontons {

// Severity of a status for the whole problem, by the order of Status. A part without enough iterations might
// converge with more; a part that stalled or came too late does not. One infeasible island makes the problem
// infeasible. An interrupt of the user precedes all others.
static int severity(Status status) {
  constexpr int order[] = {0, 1, 3, 2, 5, 4, 0};  // not tuned: an order
  return order[static_cast<int>(status)];
}

void Part::make(const Problem& whole, std::span<const double> x0_of_whole, std::vector<Index>& number) {
  extract(whole, blocks, number, of);
  begin_at(x0_of_whole);
}

void Part::begin_at(std::span<const double> x0_of_whole) {
  if (x0_of_whole.empty())
    x0.clear();
  else
    of.take(x0_of_whole, x0);
}

void clear_counts(Solution& s) {
  s.phases.clear();
  s.history.clear();
  s.reason.clear();
  s.iterations = s.products = s.factorizations = 0;
  s.time = 0;
}

Merging::Merging(Solution& whole, double tolerance) : whole_(whole), tolerance_(tolerance) {
  clear_counts(whole_);
  whole_.status = Status::converged;
}

void Merging::add(const Part& part) {
  const Solution& s = part.solution;
  part.of.put(s.x, whole_.x);
  if (!whole_.u.empty()) part.of.put(s.u, whole_.u);
  add_counts(whole_, s);
  if (severity(s.status) > severity(whole_.status)) whole_.status = s.status;
  const std::tuple hardness{s.residual > tolerance_ ? s.residual : 0.0, s.iterations};
  if (!(hardness > hardest_)) return;
  hardest_ = hardness;
  whole_.method = s.method;
  whole_.reason = s.reason;
  whole_.phases = s.phases;
}

}  // namespace amontons
