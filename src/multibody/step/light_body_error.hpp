// Errors of light bodies beside heavy ones, which the residual of the whole problem does not see.
#pragma once
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// Speed (m/s) of the fastest centre of a body, and of points beside the centre of the body with the fastest
// spin. Rows are rounded relative to both.
struct Speeds {
  double moving = 0, turning = 0;
};

// The residual is an energy norm, relative to the whole problem. With masses of 1e8 and 1e-8 kg a light body
// may have any velocity error within a tolerance that the heavy ones meet. If blocks are wrong by a large
// share of their own velocity and the tolerance does not see this, returns a tolerance that does; otherwise
// infinity. For bodies beside stiff drives, and for bodies that slide along steep cones, the share is that of
// the speed of the fastest body.
double tolerance_for_light_bodies(const Problem& problem, Law law, const Solution& s, const Speeds& fastest,
                                  double tolerance);

}  // namespace amontons
