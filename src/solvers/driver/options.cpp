#include "amontons/solvers/driver/options.hpp"

#include <cmath>
#include <string>

#include "amontons/base/error.hpp"

namespace amontons {

// The comparisons are written so that a NaN fails them. Ranges are documented at the fields. The messages
// contain the value, because it may come from a file or a command line.
void validate(const Options& o, const Problem& problem) {
  const auto text = [](double v) { return std::to_string(v); };
  AMONTONS_REQUIRE(o.tolerance >= 0, "tolerance = " + text(o.tolerance) + "; it must be zero or positive");
  AMONTONS_REQUIRE(o.deadline > 0, "deadline = " + text(o.deadline) + " s; it must be positive");
  AMONTONS_REQUIRE(o.x0.empty() || o.x0.size() == problem.rows(),
                   "x0 has " + std::to_string(o.x0.size()) + " entries but the problem has " +
                       std::to_string(problem.rows()) + " rows");
  for (std::size_t i = 0; i < o.x0.size(); ++i)
    AMONTONS_REQUIRE(std::isfinite(o.x0[i]), "x0[" + std::to_string(i) + "] is not finite");
  // All groups are checked for every method: a wrong value is reported at once, not when its method is used.
  const SpgOptions& s = o.spg;
  AMONTONS_REQUIRE(s.alpha_min > 0 && std::isfinite(s.alpha_max) && s.alpha_max > s.alpha_min,
                   "alpha_min = " + text(s.alpha_min) + ", alpha_max = " + text(s.alpha_max) +
                       "; they must satisfy 0 < alpha_min < alpha_max < inf");
  AMONTONS_REQUIRE(s.sigma_min > 0 && s.sigma_max >= s.sigma_min && s.sigma_max < 1,
                   "sigma_min = " + text(s.sigma_min) + ", sigma_max = " + text(s.sigma_max) +
                       "; they must satisfy 0 < sigma_min <= sigma_max < 1");
  // The window is allocated; a million values are 8 MB.
  AMONTONS_REQUIRE(s.memory <= 1000000,
                   "memory (N_GLL) = " + std::to_string(s.memory) + "; it must be at most 1000000");
  AMONTONS_REQUIRE(s.gamma > 0 && s.gamma < 1, "gamma = " + text(s.gamma) + "; it must be between 0 and 1");
  AMONTONS_REQUIRE(s.tau_g > 0 && std::isfinite(s.tau_g),
                   "tau_g = " + text(s.tau_g) + "; it must be positive");
  AMONTONS_REQUIRE(o.sor.omega > 0 && o.sor.omega < 2,
                   "omega = " + text(o.sor.omega) + "; Gauss-Seidel converges for 0 < omega < 2");
  AMONTONS_REQUIRE(o.jacobi.omega >= 0 && std::isfinite(o.jacobi.omega),
                   "omega = " + text(o.jacobi.omega) + "; Jacobi needs a positive factor, or 0 to choose it");
}

}  // namespace amontons
