#pragma once
#include <cstddef>
#include <type_traits>
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons::collision {

// Appends the contact points of two shapes with a gap of at most `margin` (m), in world coordinates; the
// normals point from b to a. The rows in collide.cpp define the kinds that a and b may have.
using PairFunction = void(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points);

// A set of kinds of shapes, as bits by their place in Shape. The compiler knows the kinds of a row of the
// table, and builds the look-up from them.
using Kinds = unsigned;
constexpr std::size_t kind_count = std::variant_size_v<Shape>;

// The index of a type in Shape.
template <class T, std::size_t i = 0>
constexpr std::size_t kind_of() {
  if constexpr (std::is_same_v<T, std::variant_alternative_t<i, Shape>>)
    return i;
  else
    return kind_of<T, i + 1>();
}
template <class... T>
constexpr Kinds kinds = ((1u << kind_of<T>()) | ...);
constexpr Kinds convex_kinds = (1u << kind_of<Plane>()) - 1;
constexpr Kinds static_kinds = ((1u << kind_count) - 1) & ~convex_kinds;

constexpr bool holds(Kinds set, std::size_t kind) { return (set >> kind & 1) != 0; }

// The algorithm for pairs of some kinds.
struct PairRow {
  Kinds a, b;
  PairFunction* collide;
  const char* why;  // reason for this and not a more general algorithm
};

// The row for shapes of kinds `a` and `b`, a <= b; null for two static-only ones.
const PairRow* find_row(std::size_t a, std::size_t b);

}  // namespace amontons::collision
