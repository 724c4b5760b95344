#pragma once
#include <array>

#include "amontons/problem/contact.hpp"

namespace amontons {

// One row of D: the gradient of a constraint direction in body space, for at most two bodies (index -1: the
// world).
struct JacobianRow {
  Index body_a, body_b;
  std::array<double, 6> a, b;  // (linear, angular) of each body
  // If the bodies are of a tree (Linkage) and the row is `scale` times the rate of one of its coordinates:
  // that coordinate, else -1. A limit, a servo or dry friction along a joint is such a row.
  Index coordinate = -1;
  double scale = 0;
};

}  // namespace amontons
