// The last way to the solution of a small VI: blocks come in one at a time. All are held open; the one that
// is pressed most joins those that act, which are solved by themselves; what ends at zero leaves again.
// Friction that jams has several solutions, and where contacts outnumber freedoms each has many forms: Newton
// steps on all blocks at once turn in circles there. This finds one form that few blocks carry, on matrices
// of few rows.
#include <algorithm>
#include <cmath>

#include "solvers/elimination/small_vi.hpp"

namespace amontons {

namespace {

// Newton steps of one try; starts anywhere that are tried before one of those that act leaves; rounds, beside
// two for each block.
constexpr std::size_t most_steps = 10, most_starts = 8, most_rounds = 30;
// Of the way that a block is let down: the first part, and the last that is tried; how parts shrink and grow.
constexpr double first_part = 0.25, least_part = 0.004, shorter = 0.4, longer = 1.6;
// Times diag(W), added to W: those that act may depend on each other.
constexpr double proximal = 1e-9;
// Of the target: what those that act are solved to.
constexpr double share = 0.1;

// An interval has nothing at which it were open.
template <class S>
constexpr bool can_open = !std::is_same_v<S, Interval>;

// Numbers in [0, 1), the same in every run (constants of Numerical Recipes).
double next_number(unsigned& seed) {
  seed = 1664525 * seed + 1013904223;
  return seed / 4294967296.0;
}

}  // namespace

void SmallVi::grow() {
  unsigned seed = 1;
  Index last = -1;  // the block that came in last
  open_all();
  for (std::size_t round = 0; round < most_rounds + 2 * lift_.size() && left(); ++round) {
    trial_ = x_;
    bool solved = solve_acting() || (last >= 0 && let_down(last));
    for (std::size_t i = 0; i < most_starts && !solved && left(); ++i) {
      start_anywhere(seed);
      solved = solve_acting();
    }
    if (solved) {
      keep(x_, u_);
      if (result_.map <= limits_.target || (last = let_in()) < 0) break;
    } else {
      leave_out(seed);
      last = -1;
    }
  }
  lift_.assign(lift_.size(), 0.0);
  restart();
  if (!done()) find_faces();
}

void SmallVi::open_all() {
  for_each_block(island_->K, [&]<class S>(const S&, std::size_t block, std::size_t) {
    if (can_open<S>) lift_[block] = held_open;
  });
  start_from_nothing();
}

// Newton steps on those that act, from the present x.
bool SmallVi::solve_acting() {
  sigma_ = proximal;
  for (std::size_t i = 0; left(); ++i) {
    centre_ = x_;
    if (linearise() <= share * limits_.target) return true;
    if (i == most_steps || !newton_step()) return false;
  }
  return false;
}

// From the solution without the block, which is lifted by what presses it, and then by less and less.
bool SmallVi::let_down(Index block) {
  std::vector<double>& solved = trial_;
  x_ = solved;
  evaluate(x_, u_);
  const double whole = -u_[linear_[block].row];
  for (double lift = 1, part = first_part; part >= least_part && left();) {
    const double next = std::max(0.0, lift - part);
    lift_[block] = next * whole;
    if (solve_acting()) {
      if (next == 0) return true;
      solved = x_;
      lift = next;
      part *= longer;
    } else {
      x_ = solved;
      evaluate(x_, u_);
      part *= shorter;
    }
  }
  lift_[block] = 0;
  return false;
}

void SmallVi::start_anywhere(unsigned& seed) {
  double largest = 0;
  for_each_block(island_->K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    largest = std::max(largest, std::abs(island_->q[row]) / p_[block]);
  });
  const double size = largest * std::pow(10.0, 2 * next_number(seed) - 1);
  for_each_block(island_->K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    if (lift_[block] == held_open) return;
    for (int k = 0; k < S::dim; ++k)
      x_[row + k] = size * (k == 0 ? next_number(seed) : 4 * next_number(seed) - 2);
  });
  project(island_->K, x_, x_);
  evaluate(x_, u_);
}

// What carries nothing leaves; what is pressed most comes in, -1: nothing is.
Index SmallVi::let_in() {
  double least = -share * limits_.target;
  Index pressed = -1;
  for_each_block(island_->K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    if (!can_open<S>) return;
    if (x_[row] == 0) lift_[block] = held_open;
    const double u = u_[row] / std::sqrt(p_[block]);
    if (lift_[block] != held_open || !(u < least)) return;
    least = u;
    pressed = static_cast<Index>(block);
  });
  if (pressed >= 0) lift_[pressed] = 0;
  return pressed;
}

// One of those that act, whichever; the others begin from nothing.
void SmallVi::leave_out(unsigned& seed) {
  std::vector<std::size_t>& acting = active_;
  acting.clear();
  for_each_block(island_->K, [&]<class S>(const S&, std::size_t block, std::size_t) {
    if (can_open<S> && lift_[block] != held_open) acting.push_back(block);
  });
  if (!acting.empty()) lift_[acting[static_cast<std::size_t>(next_number(seed) * acting.size())]] = held_open;
  start_from_nothing();
}

}  // namespace amontons
