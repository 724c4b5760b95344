// Impulses that carry the loads of bodies at rest to rounding.
#pragma once
#include <functional>
#include <span>

#include "amontons/base/budget.hpp"
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/solvers/driver/options.hpp"
#include "amontons/solvers/driver/parts.hpp"

namespace amontons {

// Impulses of a problem, and the contacts of the step from which it was made: surface velocities are theirs.
struct PosedImpulses {
  const Problem& problem;
  std::span<const Contact> contacts;
  const std::vector<double>& x;
};

// The blocks of islands that `counts` (by island), and the impulses near x with which the velocities v become
// zero, with the residual of a static problem. Impulses of zero stay. Islands on surfaces that move are left
// out: there contacts slide at rest.
Part find_carrying(const PosedImpulses& posed, const BodyVelocities& v,
                   const std::function<bool(Index)>& counts, Options options, Budget& budget);

}  // namespace amontons
