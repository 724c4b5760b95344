#pragma once
#include <cstddef>
#include <span>
#include <tuple>
#include <vector>

#include "amontons/problem/island_part.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// Whole islands of a problem, which are solved apart from its others.
struct Part {
  std::vector<std::size_t> blocks;  // of the whole, ascending
  IslandPart of;
  std::vector<double> x0;  // start; empty: zero
  Solution solution;
  // Makes the problem and the start of `blocks`. `number`: scratch of extract().
  void make(const Problem& whole, std::span<const double> x0_of_whole, std::vector<Index>& number);
  // The start again.
  void begin_at(std::span<const double> x0_of_whole);
};

// Forgets the counts and records of an earlier solve, whose arrays are used again.
void clear_counts(Solution& s);

// Merges solutions of parts into that of the whole, whose x, and u unless it is empty, hold those of the
// rows that no part has. Counts are sums, status and reason those of the hardest part. The caller
// measures the residual.
class Merging {
 public:
  Merging(Solution& whole, double tolerance);
  void add(const Part& part);

 private:
  Solution& whole_;
  double tolerance_;
  // Hardness of a part: the factor by which it misses the tolerance; for a converged part its cost.
  std::tuple<double, std::size_t> hardest_{-1, 0};
};

}  // namespace amontons
