// The cost of functions whose bits are the same on every system, beside those of the C library.
//
//   elementary
//
// Prints ns per call, the fastest of 20 passes over 100,000 arguments between -3 and 3 (positive ones for
// the logarithm), and the ratio. Every result enters a sum, so that no call is left out.
#include "amontons/base/elementary.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

namespace {

double sink = 0;

template <class Function>
double fastest(const std::vector<double>& arguments, Function function) {
  double least = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 20; ++pass) {
    const auto start = std::chrono::steady_clock::now();
    double sum = 0;
    for (const double x : arguments) sum += function(x);
    const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
    least = std::min(least, spent.count() / static_cast<double>(arguments.size()));
    sink += sum;
  }
  return least;
}

}  // namespace

int main() {
  namespace own = amontons::elementary;
  std::vector<double> x(100'000), positive(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = 6 * std::fmod(0.6180339887498949 * static_cast<double>(i + 1), 1.0) - 3;
    positive[i] = std::abs(x[i]) + 1e-3;
  }
  std::printf("| Function | Fixed bits (ns) | C library (ns) | Ratio |\n|---|--:|--:|--:|\n");
  const auto row = [](const char* name, double fixed, double library) {
    std::printf("| `%s` | %.1f | %.1f | %.2f |\n", name, fixed, library, fixed / library);
  };
  row("sin", fastest(x, [](double v) { return own::sin(v); }),
      fastest(x, [](double v) { return std::sin(v); }));
  row("cos", fastest(x, [](double v) { return own::cos(v); }),
      fastest(x, [](double v) { return std::cos(v); }));
  row("atan2", fastest(x, [](double v) { return own::atan2(v, 0.7); }),
      fastest(x, [](double v) { return std::atan2(v, 0.7); }));
  row("log", fastest(positive, [](double v) { return own::log(v); }),
      fastest(positive, [](double v) { return std::log(v); }));
  row("expm1", fastest(x, [](double v) { return own::expm1(v); }),
      fastest(x, [](double v) { return std::expm1(v); }));
  row("hypot", fastest(x, [](double v) { return own::hypot(v, 0.7); }),
      fastest(x, [](double v) { return std::hypot(v, 0.7); }));
  return std::isnan(sink);
}
