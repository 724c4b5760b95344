// Light bodies beside heavy ones, which the residual of the whole does not see.
#pragma once
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// Of the fastest centre of a body, and of points beside the centre of what spins the fastest (m/s): rows are
// rounded to both.
struct Speeds {
  double moving = 0, turning = 0;
};

// The residual is an energy norm, relative to the whole: with masses of 1e8 and 1e-8 kg a light body may have
// any velocity within a tolerance that the heavy ones keep. Where blocks are wrong by a good share of their
// own velocities, and the tolerance is too coarse to tell: the tolerance that would. Else infinity. So are
// bodies beside what is stiffly driven, and what slides along steep cones; they are wrong by a good share of
// the speed of the fastest body.
double tolerance_for_light_bodies(const Problem& problem, Law law, const Solution& s, const Speeds& fastest,
                                  double tolerance);

}  // namespace amontons
