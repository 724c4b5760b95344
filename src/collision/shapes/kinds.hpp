#pragma once
#include <cstddef>
#include <type_traits>
#include <variant>

#include "amontons/collision/shapes/shapes.hpp"

// Sets of kinds of shapes, as bits by their place in Shape.
namespace amontons::collision {

using Kinds = unsigned;
constexpr std::size_t kind_count = std::variant_size_v<Shape>;

template <class T, std::size_t i = 0>
constexpr std::size_t kind_of() {
  if constexpr (std::is_same_v<T, std::variant_alternative_t<i, Shape>>)
    return i;
  else
    return kind_of<T, i + 1>();
}
template <class... T>
constexpr Kinds kinds = ((1u << kind_of<T>()) | ...);

constexpr bool holds(Kinds set, std::size_t kind) { return (set >> kind & 1) != 0; }

constexpr Kinds convex_kinds = (1u << kind_of<Plane>()) - 1;
constexpr Kinds static_kinds = ((1u << kind_count) - 1) & ~convex_kinds;

}  // namespace amontons::collision
