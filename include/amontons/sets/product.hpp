#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "amontons/sets/free.hpp"
#include "amontons/sets/friction.hpp"
#include "amontons/sets/interval.hpp"
#include "amontons/sets/nonnegative.hpp"

namespace amontons {

// Every set offers
//   project(x, out)            out = Pi(x)
//   natural_map(x, step, out)  out = x - Pi(x - step), formed without cancellation: where the trial point is
//   inside, that
//                              is `step` itself, however large x is. A method that lets impulses run off to
//                              1e16 would otherwise look converged because x - step rounds to x.
enum class SetKind : unsigned char { free, nonnegative, interval, friction };

// Consecutive blocks of one kind: blocks [block, block + count) cover rows from `row`; `param` is the index
// of the first block in the parameter arrays of that kind (mu, or lo and hi).
struct SetRun {
  SetKind kind;
  std::size_t count, row, block, param;
};

// K = a product of small sets in the order in which they were added. A block is one set: one row of R, R+ or
// [lo, hi], three rows (normal, tangent 1, tangent 2) of a friction cone.
class SetProduct {
 public:
  void add_free(std::size_t count);
  void add_nonnegative(std::size_t count);
  // lo[i] <= hi[i], not NaN, infinite allowed; throws InputError naming the first bad index.
  void add_interval(std::span<const double> lo, std::span<const double> hi);
  // mu[i] >= 0 and finite; throws InputError naming the first bad contact.
  void add_friction(std::span<const double> mu);

  std::size_t rows() const { return rows_; }
  std::size_t blocks() const { return blocks_; }
  std::size_t contacts() const { return mu_.size(); }
  bool all_free() const;  // K = R^m: the VI is a linear system
  const std::vector<SetRun>& runs() const { return runs_; }
  const std::vector<double>& mu() const { return mu_; }
  const std::vector<double>& lo() const { return lo_; }
  const std::vector<double>& hi() const { return hi_; }

 private:
  void append(SetKind kind, std::size_t count, std::size_t param, std::size_t dim);
  std::vector<SetRun> runs_;
  std::vector<double> mu_, lo_, hi_;
  std::size_t rows_ = 0, blocks_ = 0;
};

// Calls f(set, block, row) for every block in order, with the static type of the set, so that the loop over
// a run is compiled for its kind.
template <class F>
inline void for_each_block(const SetProduct& K, F&& f) {
  for (const SetRun& run : K.runs()) {
    switch (run.kind) {
      case SetKind::free:
        for (std::size_t i = 0; i < run.count; ++i) f(Free{}, run.block + i, run.row + i);
        break;
      case SetKind::nonnegative:
        for (std::size_t i = 0; i < run.count; ++i) f(NonNegative{}, run.block + i, run.row + i);
        break;
      case SetKind::interval:
        for (std::size_t i = 0; i < run.count; ++i)
          f(Interval{K.lo()[run.param + i], K.hi()[run.param + i]}, run.block + i, run.row + i);
        break;
      case SetKind::friction:
        for (std::size_t i = 0; i < run.count; ++i)
          f(Friction{K.mu()[run.param + i]}, run.block + i, run.row + 3 * i);
        break;
    }
  }
}

// out = Pi_K(x). x and out may be the same memory; both of K.rows() entries.
void project(const SetProduct& K, std::span<const double> x, std::span<double> out);
// |x - Pi_K(x)|_2, the Euclidean distance to K.
double distance(const SetProduct& K, std::span<const double> x);
// out = x - Pi_K(x): by Moreau's decomposition the projection on the polar cone (for cones).
void project_polar(const SetProduct& K, std::span<const double> x, std::span<double> out);

}  // namespace amontons
