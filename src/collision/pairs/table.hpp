#pragma once
#include "collision/pairs/pair.hpp"
#include "collision/shapes/kinds.hpp"

namespace amontons::collision {

// How the shapes of some kinds meet.
struct PairRow {
  Kinds a, b;
  PairFunction* collide;
  const char* why;
};

// The row for a shape of kind `a` and one of kind `b`, a <= b; null for two that are static only.
const PairRow* find_row(std::size_t a, std::size_t b);

}  // namespace amontons::collision
