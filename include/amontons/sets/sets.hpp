#pragma once
#include "amontons/sets/bilateral.hpp"
#include "amontons/sets/elliptic_friction.hpp"
#include "amontons/sets/friction.hpp"
#include "amontons/sets/interval.hpp"
#include "amontons/sets/nonnegative.hpp"
#include "amontons/sets/planar_friction.hpp"
#include "amontons/sets/rolling_friction.hpp"

namespace amontons {

template <Set... S>
struct SetList {};

// All sets. The index in the list is the kind of a run in a SetProduct.
using Sets = SetList<Bilateral, NonNegative, Interval, Friction, EllipticFriction<3>, EllipticFriction<4>,
                     EllipticFriction<6>, RollingFriction, PlanarFriction>;

inline constexpr int largest_dim = 6;

}  // namespace amontons
