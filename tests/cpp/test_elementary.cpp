#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "amontons/base/elementary.hpp"
#include "check.hpp"
#include "random.hpp"

using namespace amontons;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// The distance of two doubles of one sign in units in the last place: how many doubles lie between them.
double units(double a, double b) {
  if (a == b) return 0;
  if (!(std::signbit(a) == std::signbit(b))) return infinity;
  return std::abs(static_cast<double>(std::bit_cast<std::int64_t>(a) - std::bit_cast<std::int64_t>(b)));
}

// The C library's result is within one unit of the exact one, as those of glibc, musl, Apple and Microsoft
// state or are measured (Innocente and Zimmermann, Accuracy of Mathematical Functions, 2024).
void check_near(double ours, double of_the_library, double most) {
  CHECK(std::isnan(of_the_library) ? std::isnan(ours) : units(ours, of_the_library) <= most);
}

// Of a random sign and size.
double wide(small::Draws& random, double least, double most) {
  return (random.below(2) ? 1 : -1) * std::exp2(random.uniform(least, most));
}

std::uint64_t hash(std::uint64_t state, double value) {
  return (state ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3u;
}

}  // namespace

// Breaks when a constant, a term of a series or a quadrant is wrong: the bounds are those of elementary.hpp
// with one more unit for the library's own error.
TEST(agrees_with_the_c_library) {
  namespace e = elementary;
  small::Draws random(1);
  for (int k = 0; k < 20000; ++k) {
    // Angles of a joint, of many turns, and beyond what three parts of pi can reduce.
    for (const double x : {wide(random, -30, 3), wide(random, 0, 19), wide(random, 19, 1023)}) {
      check_near(e::sin(x), std::sin(x), 2);
      check_near(e::cos(x), std::cos(x), 2);
      check_near(e::tan(x), std::tan(x), 3);
    }
    for (const double x :
         {random.uniform(-1, 1), wide(random, -60, 0), 1 - std::exp2(random.uniform(-53, 0))})
      check_near(e::asin(x), std::asin(x), 3);
    const double a = random.normal(), b = random.normal(), c = wide(random, -300, 300),
                 d = wide(random, -300, 300);
    check_near(e::atan2(a, b), std::atan2(a, b), 3);
    check_near(e::atan2(c, d), std::atan2(c, d), 3);
    check_near(e::hypot(a, b), std::hypot(a, b), 2);
    check_near(e::hypot(c, d), std::hypot(c, d), 2);
    for (const double x : {wide(random, -50, 6), random.uniform(-3, 3)})
      check_near(e::expm1(x), std::expm1(x), 2);
    for (const double x : {std::abs(c), random.uniform(0.3, 3), 1 + 0.1 * wide(random, -50, 0)}) {
      check_near(e::log(x), std::log(x), 2);
      check_near(e::log10(x), std::log10(x), 3);
    }
  }
}

// Breaks when a value that C prescribes is lost: bodies at rest have angles of exactly zero, with their sign.
TEST(special_values) {
  namespace e = elementary;
  const double nan = std::numeric_limits<double>::quiet_NaN(), least = 0x1p-1074,
               most = 0x1.fffffffffffffp1023;
  const auto same = [](double a, double b) {
    CHECK(std::isnan(b) ? std::isnan(a) : a == b && std::signbit(a) == std::signbit(b));
  };
  const std::array values{0.0, -0.0, least, -least, 1.0, -1.0, 0.5, infinity, -infinity, nan, most, -most};
  for (const double y : values)
    for (const double x : values) {
      check_near(e::atan2(y, x), std::atan2(y, x), 1);
      check_near(e::hypot(y, x), std::hypot(y, x), 1);
    }
  for (const double x : {0.0, -0.0}) {
    same(e::sin(x), x), same(e::tan(x), x), same(e::asin(x), x), same(e::expm1(x), x);
    same(e::cos(x), 1), same(e::log(x), -infinity);
  }
  for (const double x : {infinity, -infinity, nan})
    same(e::sin(x), nan), same(e::cos(x), nan), same(e::tan(x), nan);
  same(e::asin(1.5), nan), same(e::log(-1), nan), same(e::log(1), 0), same(e::log(infinity), infinity);
  same(e::expm1(infinity), infinity), same(e::expm1(-infinity), -1), same(e::expm1(nan), nan);
  check_near(e::expm1(709.7), std::expm1(709.7), 1);
  for (int k = -300; k <= 300; ++k) check_near(e::log10(std::pow(10.0, k)), k, 1);
}

// Breaks when a system gives other bits: a function of the C library that slipped in, a contraction into
// fused multiply-adds, a compiler that reassociates. The number is that of every system, made once.
TEST(same_bits_everywhere) {
  namespace e = elementary;
  small::Draws random(2);
  std::uint64_t state = 0xcbf29ce484222325u;
  for (int k = 0; k < 100000; ++k) {
    const double x = 8 * (random.uniform() - 0.5), y = 8 * (random.uniform() - 0.5);
    const double large = x * static_cast<double>(std::uint64_t{1} << random.below(60));
    for (const double v :
         {e::sin(large), e::cos(large), e::tan(x), e::asin(x / 4), e::atan2(y, x), e::expm1(x),
          e::log(std::abs(large)), e::log10(std::abs(x)), e::hypot(x, large), random.normal()})
      state = hash(state, v);
  }
  CHECK(state == 0x48129d47a285d2b8);
}
