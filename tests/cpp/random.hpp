#pragma once
#include <cmath>
#include <random>

#include "amontons/base/elementary.hpp"

// Random numbers that are the same everywhere. The standard fixes what std::mt19937 draws, and leaves to each
// library how its distributions use it: those of libc++ give other numbers than those of libstdc++.
namespace small {

class Draws {
 public:
  explicit Draws(unsigned seed) : engine_(seed) {}

  std::size_t below(std::size_t n) { return engine_() % n; }

  // In [0, 1): 64 bits of two draws, rounded to 53.
  double uniform() {
    const double low = static_cast<double>(engine_()), high = static_cast<double>(engine_());
    const double value = (low + high * 0x1p32) * 0x1p-64;
    return value < 1 ? value : std::nextafter(1.0, 0.0);
  }
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }

  // Mean 0, deviation 1. A point of the unit disc gives two independent ones (Marsaglia's polar method,
  // Marsaglia and Bray, SIAM Review 6, 1964); the second is kept for the next call.
  double normal() {
    if (kept_) return kept_ = false, second_;
    double x, y, r;
    do {
      x = 2 * uniform() - 1;
      y = 2 * uniform() - 1;
      r = x * x + y * y;
    } while (r > 1 || r == 0);
    const double size = std::sqrt(-2 * amontons::elementary::log(r) / r);
    second_ = x * size;
    kept_ = true;
    return y * size;
  }

 private:
  std::mt19937 engine_;
  double second_ = 0;
  bool kept_ = false;
};

}  // namespace small
