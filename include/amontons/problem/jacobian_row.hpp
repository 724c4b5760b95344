#pragma once
#include <array>

#include "amontons/problem/contact.hpp"

namespace amontons {

// One row of D: the gradient of a constraint direction in body space, for at most two bodies (index -1: the
// world).
struct JacobianRow {
  Index body_a, body_b;
  std::array<double, 6> a, b;  // (linear, angular) of each body
};

}  // namespace amontons
