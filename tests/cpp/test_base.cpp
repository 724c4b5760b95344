#include <cstdlib>
#include <limits>
#include <string>

#include "amontons/base/error.hpp"
#include "amontons/base/isa.hpp"
#include "check.hpp"

using namespace amontons;

// Breaks when AMONTONS_REQUIRE stops being the one way in which user errors become exceptions, or forms its
// message although nothing is wrong.
TEST(require_throws_its_message) {
  int formed = 0;
  const auto message = [&] { return ++formed, std::string("mu[3] is negative"); };
  const auto check = [&](bool condition) { AMONTONS_REQUIRE(condition, message()); };
  check(true);
  CHECK(formed == 0);
  CHECK_THROWS(check(false), "mu[3]");
}

// Breaks when the choice of the instruction set changes during a run, or ignores AMONTONS_ISA.
TEST(active_isa_is_constant_and_obeys_the_environment) {
  const Isa isa = active_isa();
  CHECK(active_isa() == isa);
  const char* wish = std::getenv("AMONTONS_ISA");
  if (wish && std::string(wish) == "baseline") CHECK(isa == Isa::baseline);
  if (wish && std::string(wish) == "avx2") CHECK(isa != Isa::avx512);
#if !defined(AMONTONS_X86)
  CHECK(isa == Isa::baseline);
#elif defined(__GNUC__) && !defined(__clang__)
  // The same by GCC's own table, another reading of the processor.
  __builtin_cpu_init();
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512vl");
  if (!wish) CHECK((isa != Isa::baseline) == bool(__builtin_cpu_supports("avx2")));
  if (!wish && isa != Isa::baseline) CHECK((isa == Isa::avx512) == avx512);
#endif
}

// Breaks when a NaN passes as near, or equal infinities do not: every other test relies on CHECK_NEAR.
TEST(near_handles_infinity_and_nan) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(check::is_near(infinity, infinity, 0.0) && check::is_near(1.0, 1.0 + 1e-12, 1e-11));
  CHECK(!check::is_near(1.0, 1.0 + 1e-12, 1e-13) && !check::is_near(infinity, 1.0, 1e300));
  CHECK(!check::is_near(nan, 0.0, 1e300) && !check::is_near(0.0, nan, infinity));
  CHECK(!check::is_near(nan, nan, 1.0));
}
