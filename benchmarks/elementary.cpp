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

double fastest(const std::vector<double>& arguments, double (*function)(double)) {
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
  struct Function {
    const char* name;
    double (*fixed)(double);
    double (*library)(double);
    const std::vector<double>& arguments;
  };
  const Function functions[] = {
      {"sin", own::sin, std::sin, x},
      {"cos", own::cos, std::cos, x},
      {"atan2", [](double v) { return own::atan2(v, 0.7); }, [](double v) { return std::atan2(v, 0.7); }, x},
      {"log", own::log, std::log, positive},
      {"expm1", own::expm1, std::expm1, x},
      {"hypot", [](double v) { return own::hypot(v, 0.7); }, [](double v) { return std::hypot(v, 0.7); }, x},
  };
  std::printf("| Function | Fixed bits (ns) | C library (ns) | Ratio |\n|---|--:|--:|--:|\n");
  for (const Function& f : functions) {
    const double fixed = fastest(f.arguments, f.fixed), library = fastest(f.arguments, f.library);
    std::printf("| `%s` | %.1f | %.1f | %.2f |\n", f.name, fixed, library, fixed / library);
  }
  return std::isnan(sink);
}
