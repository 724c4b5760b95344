#include <array>
#include <cstdio>
#include <vector>

#include "amontons/cones/product.hpp"

// Uses an inline function, a compiled one and an exception of the installed library.
int main() {
  amontons::ConeProduct K;
  K.add_friction(std::vector<double>{0.5});
  const std::array<double, 3> x = {1.0, 3.0, 0.0};
  std::array<double, 3> foot{};
  amontons::project(K, x, foot);
  // The foot on the ray (1, mu)/sqrt(1 + mu^2): (1 + .5 * 3) / 1.25 * (1, .5) = (2, 1).
  const bool right = std::abs(foot[0] - 2) < 1e-12 && std::abs(foot[1] - 1) < 1e-12;
  std::printf("projection of (1, 3, 0): (%g, %g, %g), %s\n", foot[0], foot[1], foot[2],
              right ? "as expected" : "WRONG");
  return right ? 0 : 1;
}
