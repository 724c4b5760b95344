// Every tuned number of the central curve, with its unit, its reason, and the test that protects it.
// tools/check_policy.py finds numbers elsewhere. Counts of factorisations are from 79 steps of
// benchmarks/corpus.py and from the FCLIB files under coulomb, solved by "auto" and "interior-point".
#pragma once
#include "amontons/base/policy.hpp"

namespace amontons::curve {

struct Policy {
  // Kink (relative to t): radius by which the kink of the De Saxce term is rounded; 1 leaves two more
  // problems unsolved (tests/cpp/test_central_curve.cpp).
  double rounding = 0.8;
  // Step (relative to the distance to the boundary): where the curve bends, and back to the curve; 0.9 takes
  // 3 % more factorisations. Back to the curve, 1 leaves eight more problems unsolved.
  double fraction = 0.8;
  // Step (relative to the distance to the boundary): where the curve hardly bends; usual for interior points.
  // The share that it leaves is the least aim of a step, relative to t, and the length of a step that makes
  // no progress.
  double most_fraction = 0.99;
  // Correction (relative to the step): a larger one halves the step; 0.5 takes 4 % more factorisations.
  double most_bend = 0.7;

  // Round numbers, whose neighbours are no better.

  // Change (ratio of t): largest rise of a step, and largest fall of one back to the curve, because the curve
  // bends away beyond. After a larger fall beyond a fold the step has jumped to another branch of the curve,
  // on which it might circle. Also the share of a step that the boundary must leave, or else the step is
  // repeated with this length. So the first aim lies beyond the boundary by its inverse: a step is cut there.
  double most_change = 0.5;
  // Distance (units of t): of one block to the curve, above which a step only goes back to the curve.
  double neighbourhood = 2;
  // Repetitions (count): halvings of a step; the last one is taken without the correction. Also steps back in
  // a row; if they do not reach the curve, the last step along it was too long.
  int most_repeats = 6;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named = name_policy("curve", {{"rounding", &policy.rounding},
                                                {"fraction", &policy.fraction},
                                                {"most_fraction", &policy.most_fraction},
                                                {"most_bend", &policy.most_bend},
                                                {"most_change", &policy.most_change},
                                                {"neighbourhood", &policy.neighbourhood},
                                                {"most_repeats", &policy.most_repeats}});

}  // namespace amontons::curve
