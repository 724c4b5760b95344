#pragma once
#include <cstdint>
#include <vector>

#include "amontons/base/budget.hpp"
#include "solvers/central_path/central_curve.hpp"
#include "solvers/direct/block_sweeps.hpp"
#include "solvers/direct/island_system.hpp"
#include "solvers/direct/newton_direction.hpp"
#include "solvers/direct/reduction.hpp"

namespace amontons {

// Solves the VI of an island with a dense matrix: find x in K with u = W x + q (and the De Saxce term under
// coulomb) in the normal cone. Two stages:
//   1. semismooth Newton steps on the faces of the start, which are right in most steps of a simulation;
//   after
//      a step that failed, sweeps over the blocks choose others;
//   2. the central path as a curve (central_path/central_curve.hpp), from a point near the best x, then from
//      the middle of the sets, which needs no start.
// The work is bounded for every problem.
class IslandSolver {
 public:
  struct Limits {
    // Natural maps in the P of the island, absolute. `target` must be reached; `aim` is worth another step or
    // two after that.
    double target, aim;
    std::size_t iterations;  // Newton steps and steps along the curve; 0: the method's own limit
  };
  struct Result {
    bool solved;  // the target is reached
    double map;   // natural map of the returned x, the best seen
    std::size_t iterations, factorizations;
  };
  // x: the start, if it has as many entries as the island has rows; then the best x seen. Its memory is kept.
  // No result depends on earlier calls: a simulation that was saved and loaded gives the same bits.
  Result solve(const Reduction::Island& island, Law law, const Limits& limits, Budget& budget,
               std::vector<double>& x);

 private:
  void start(const Reduction::Island& island);
  void choose_start(std::vector<double>& x);
  void evaluate(const std::vector<double>& x, std::vector<double>& u);
  double natural_map(const std::vector<double>& x, const std::vector<double>& u) const;
  double keep_better(const std::vector<double>& x, const std::vector<double>& u);
  bool has_budget();
  bool is_unsolved() { return result_.map > limits_.target && has_budget(); }
  void pay();
  void find_faces();
  bool newton_step(double proximal);
  void settle();
  void follow_curve();
  bool start_near();
  bool follow(bool near);

  Budget* budget_ = nullptr;
  const Reduction::Island* island_ = nullptr;
  Law law_{};
  Limits limits_{};
  std::vector<double> p_, diagonal_;  // mean of diag(W) per block; diag(W)
  std::vector<double> x_, u_, dx_, trial_, trial_u_, best_;
  NewtonDirection newton_;
  BlockSweeps sweeps_;
  bool swept_ = false;  // sweeps_ knows the island
  IslandSystem system_;
  CentralCurve<IslandSystem> curve_;
  // Multiplications that are not charged yet. They may exceed 32 bits, which std::size_t has in WebAssembly.
  std::uint64_t work_ = 0;
  Result result_{};
};

}  // namespace amontons
