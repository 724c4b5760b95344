#include "amontons/base/elementary.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

// Method of each function. An identity brings the argument into a short interval, exactly or with the
// remainder in a second double. There Horner's rule sums the Taylor series, with as many terms as leave a
// remainder below 1e-17 of the result. Bounds are given at the series. The last operation determines the
// rounding: a large part, known exactly, plus a small one (Muller, Elementary Functions, 3rd edition, 2016,
// chapters 3 and 11).
//
// Only functions of the C library whose result IEEE 754 or their definition fixes are used: sqrt, rint, abs,
// copysign, frexp, ldexp.
namespace amontons::elementary {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();

// A number as high + low, with low below the rounding of high: 106 bits.
struct Pair {
  double high, low;
};
constexpr Pair half_pi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
constexpr Pair pi = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};

// a + b without error, if |a| >= |b| or a = 0 (Dekker 1971).
constexpr Pair fast_sum(double a, double b) {
  const double s = a + b;
  return {s, b - (s - a)};
}

// The angle minus the nearest multiple of pi/2, and that multiple modulo 4.
struct Reduced {
  Pair rest;
  int quarter;
};

// Cody and Waite (1980): pi/2 in three parts, of which the first two have 33 bits. Their products with a
// number of at most 20 bits are exact. The first difference, of two numbers of one size, is exact too. The
// second one has a rounding error, which is kept, and the third part ends 119 bits below the first.
Reduced reduce_moderate(double x) {
  constexpr double first = 0x1.921fb544p+0, second = 0x1.0b4611a6p-34, third = 0x1.3198a2e037073p-69;
  const double n = std::rint(x * (2 / std::numbers::pi));
  const double a = x - n * first, b = n * second, r = a - b;
  const double low = ((a - r) - b) - n * third;
  return {fast_sum(r, low), static_cast<int>(static_cast<std::int64_t>(n) & 3)};
}

// The bits of 2/pi behind the binary point, from the first on.
constexpr std::uint64_t two_over_pi[] = {
    0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561, 0xb7246e3a424dd2e0,
    0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41, 0x3991d639835339f4,
    0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d,
    0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab, 0xf0cfbc209af4361d};

// 64 bits of 2/pi, the first of which has the weight 2^-(1 + at); bits before the binary point are zero.
std::uint64_t bits_from(int at) {
  const auto word = [](int k) { return k < 0 ? 0 : two_over_pi[k]; };
  const int k = at >> 6, shift = at & 63;  // rounded down, also for at < 0
  return shift == 0 ? word(k) : word(k) << shift | word(k + 1) >> (64 - shift);
}

// Payne and Hanek (1983): x = m 2^e with an integer m of 53 bits. m is multiplied by those bits of 2/pi whose
// products are not multiples of 4: 192 bits from the weight 2^(1 - e) on. The top two bits of the product
// modulo 2^192 are the quarter. The rest is a fraction of pi/2, right to 192 - 2 - 53 bits. No double comes
// nearer to a multiple of pi/2 than 2^-62 of it, so that 75 bits of this rest are left.
Reduced reduce_large(double x) {
  int e = 0;
  const auto m = static_cast<std::uint64_t>(std::ldexp(std::frexp(x, &e), 53));
  const int at = e - 53 - 2;  // the first bit of 2/pi in use, of the weight 2^(1 - (e - 53))
  __extension__ using Wide = unsigned __int128;
  const Wide low = Wide{m} * bits_from(at + 128), middle = Wide{m} * bits_from(at + 64) + (low >> 64);
  std::uint64_t top = m * bits_from(at) + static_cast<std::uint64_t>(middle >> 64);
  Wide fraction = Wide{top} << 64 | static_cast<std::uint64_t>(middle);
  const bool up = top >> 61 & 1;  // a fraction of half or more belongs to the next multiple
  const int quarter = static_cast<int>((top >> 62) + up) & 3;
  fraction <<= 2;
  if (up) fraction = -fraction;
  // As a pair: the leading 53 bits, and those behind them; the whole is at most 0.5.
  if (fraction == 0) return {{0, 0}, quarter};
  int zeros = 0;
  while (!(fraction >> 127)) fraction <<= 1, ++zeros;
  const double sign = up ? -1 : 1;
  const double high =
      sign * std::ldexp(static_cast<double>(static_cast<std::uint64_t>(fraction >> 75)), -53 - zeros);
  const double rest = static_cast<double>(static_cast<std::uint64_t>(fraction >> 22) & ((1ull << 53) - 1));
  const double tail = sign * std::ldexp(rest, -106 - zeros);
  // Times pi/2. The product of the high parts is split into halves of 26 bits (Veltkamp 1968, Dekker 1971).
  const auto upper = [](double a) { return 134217729.0 * a - (134217729.0 * a - a); };
  const double a = upper(high), b = high - a, c = upper(half_pi.high), d = half_pi.high - c;
  const double product = high * half_pi.high;
  const double error = ((a * c - product) + a * d + b * c) + b * d;
  return {fast_sum(product, error + (high * half_pi.low + tail * half_pi.high)), quarter};
}

Reduced reduce(double x) {
  if (std::abs(x) < 0x1p19) return reduce_moderate(x);
  Reduced r = reduce_large(std::abs(x));
  if (x < 0) r = {{-r.rest.high, -r.rest.low}, -r.quarter & 3};
  return r;
}

// The series in |x| <= pi/4, for x + low: sin(x + low) = sin x + low cos x. The omitted terms are below x^19
// / 19! = 8e-20 and x^18 / 18! = 2e-18.
double sine(Pair x) {
  const double z = x.high * x.high;
  const double s =
      -1.0 / 6 +
      z * (1.0 / 120 +
           z * (-1.0 / 5040 +
                z * (1.0 / 362880 +
                     z * (-1.0 / 39916800 + z * (1.0 / 6227020800 + z * (-1.0 / 1307674368000 +
                                                                         z * (1.0 / 355687428096000)))))));
  return x.high + (x.high * z * s + x.low * (1 - 0.5 * z));
}
// 1 - z / 2 is rounded first; its rounding error is added to the smaller terms.
double cosine(Pair x) {
  const double z = x.high * x.high, half = 0.5 * z, large = 1 - half;
  const double c =
      1.0 / 24 +
      z * (-1.0 / 720 + z * (1.0 / 40320 + z * (-1.0 / 3628800 +
                                                z * (1.0 / 479001600 + z * (-1.0 / 87178291200 +
                                                                            z * (1.0 / 20922789888000))))));
  return large + (((1 - large) - half) + (z * z * c - x.high * x.low));
}

// atan(k / 8).
constexpr Pair arcs[] = {{0, 0},
                         {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
                         {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
                         {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
                         {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
                         {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
                         {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
                         {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
                         {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}};

// atan(a / b) for 0 <= a <= b, b of a moderate size. Let c = k / 8 be near a / b. Then
//   atan(a / b) = atan(c) + atan(t), t = (a - c b) / (b + c a), |t| <= 1/16.
// a - c b is exact except for the rounding of c b (Sterbenz 1974), which is 2^-54 of the result. The omitted
// term is t^14 / 15 = 1e-18 of t.
Pair arc(double a, double b) {
  const double k = std::rint(8 * (a / b)), c = k / 8;
  const double t = (a - c * b) / (b + c * a), z = t * t;
  const double s =
      z * (-1.0 / 3 + z * (1.0 / 5 + z * (-1.0 / 7 + z * (1.0 / 9 + z * (-1.0 / 11 + z * (1.0 / 13))))));
  const Pair& known = arcs[static_cast<int>(k)];
  return k == 0 ? fast_sum(t, t * s) : fast_sum(known.high, known.low + (t + t * s));
}

double signed_as(double size, double sign) { return std::copysign(size, sign); }

// x = f 2^e with f in [sqrt(1/2), sqrt(2)); log f = 2 artanh(s) = 2 (s + s^3 / 3 + ...) for s = (f - 1) / (f
// + 1), |s| <= 0.172. The omitted term is s^22 / 23 = 7e-19 of s. 2 s = f - 1 - s (f - 1), whose first part
// is exact.
struct Logarithm {
  double exponent, high, low;
};
Logarithm logarithm_parts(double x) {
  int e = 0;
  double f = std::frexp(x, &e);
  if (f < std::numbers::sqrt2 / 2) f *= 2, --e;
  const double g = f - 1, s = g / (2 + g), z = s * s;
  const double r =
      z * (2.0 / 3 +
           z * (2.0 / 5 +
                z * (2.0 / 7 +
                     z * (2.0 / 9 +
                          z * (2.0 / 11 +
                               z * (2.0 / 13 +
                                    z * (2.0 / 15 + z * (2.0 / 17 + z * (2.0 / 19 + z * (2.0 / 21))))))))));
  // 2 s = g - s g = g - g^2 / 2 + s g^2 / 2: the square is the large part of the difference.
  const double half = 0.5 * g * g;
  return {static_cast<double>(e), g, s * (half + r) - half};
}

}  // namespace

double sin(double x) {
  if (!(std::abs(x) < infinity)) return nan;
  if (std::abs(x) < 0x1p-26) return x;  // also -0
  const Reduced r = reduce(x);
  const double value = r.quarter & 1 ? cosine(r.rest) : sine(r.rest);
  return r.quarter & 2 ? -value : value;
}

double cos(double x) {
  if (!(std::abs(x) < infinity)) return nan;
  const Reduced r = reduce(x);
  const double value = r.quarter & 1 ? sine(r.rest) : cosine(r.rest);
  return ((r.quarter + 1) & 2) ? -value : value;
}

double tan(double x) {
  if (!(std::abs(x) < infinity)) return nan;
  if (std::abs(x) < 0x1p-26) return x;
  const Reduced r = reduce(x);
  const double s = sine(r.rest), c = cosine(r.rest);
  return r.quarter & 1 ? -c / s : s / c;
}

// sqrt((1 - x) (1 + x)) is the third side of the triangle, without the cancellation of 1 - x^2.
double asin(double x) { return std::abs(x) < 0x1p-26 ? x : atan2(x, std::sqrt((1 - x) * (1 + x))); }

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return nan;
  double a = std::abs(y), b = std::abs(x);
  if (a == infinity || b == infinity) a = a == infinity, b = b == infinity;
  const bool steep = a > b, back = std::signbit(x);
  if (steep) std::swap(a, b);
  if (b == 0) return signed_as(back ? pi.high : 0, y);
  // Sizes for which neither products overflow nor quotients lose digits below the smallest double. The digits
  // of a that are lost are far below the result.
  if (b > 0x1p1000) a *= 0x1p-100, b *= 0x1p-100;
  if (b < 0x1p-900) a *= 0x1p200, b *= 0x1p200;
  Pair r = arc(a, b);
  if (steep)
    r = fast_sum(half_pi.high - r.high,
                 ((half_pi.high - (half_pi.high - r.high)) - r.high) + (half_pi.low - r.low));
  if (back) r = fast_sum(pi.high - r.high, ((pi.high - (pi.high - r.high)) - r.high) + (pi.low - r.low));
  return signed_as(r.high + r.low, y);
}

// x = k log 2 + r, |r| <= 0.35, and exp(x) - 1 = 2^k (exp(r) - 1) + (2^k - 1). log 2 is split in two parts,
// the first of 32 bits, whose product with k is exact. The omitted term is r^14 / 15! = 3e-19 of r.
double expm1(double x) {
  if (std::isnan(x)) return nan;
  if (x > 709.8) return infinity;
  if (x < -40) return -1;  // exp(-40) is below the rounding of 1
  if (std::abs(x) < 0x1p-54) return x;
  const double k = std::rint(x * std::numbers::log2e);
  const double a = x - k * 0x1.62e42feep-1, b = k * 0x1.a39ef35793c76p-33, r = a - b, low = (a - r) - b;
  const double t =
      r *
      (1.0 / 6 +
       r * (1.0 / 24 +
            r * (1.0 / 120 +
                 r * (1.0 / 720 +
                      r * (1.0 / 5040 +
                           r * (1.0 / 40320 +
                                r * (1.0 / 362880 +
                                     r * (1.0 / 3628800 +
                                          r * (1.0 / 39916800 +
                                               r * (1.0 / 479001600 + r * (1.0 / 6227020800 +
                                                                           r * (1.0 / 87178291200))))))))))));
  // exp(r + low) - 1 = r + (r^2 / 2 + r^2 t + low exp(r)), the large part first.
  const Pair p = fast_sum(r, r * r * (0.5 + t) + low * (1 + r));
  if (k == 0) return p.high + p.low;
  const int n = static_cast<int>(k);
  if (n > 60) return std::ldexp(1 + p.high, n - 1) * 2;  // 2^1024 is no double, its half is
  const double scale = std::ldexp(1.0, n);
  const Pair s = n > 0 ? fast_sum(scale, -1) : fast_sum(-1, scale);  // 2^k - 1
  const double high = s.high + scale * p.high;
  const double first = std::abs(s.high) > std::abs(scale * p.high) ? s.high : scale * p.high;
  const double second = first == s.high ? scale * p.high : s.high;
  return high + ((second - (high - first)) + (scale * p.low + s.low));
}

double log(double x) {
  if (std::isnan(x) || x < 0) return nan;
  if (x == 0) return -infinity;
  if (x == infinity) return x;
  const Logarithm l = logarithm_parts(x);
  if (l.exponent == 0) return l.high + l.low;
  const Pair sum = fast_sum(l.exponent * 0x1.62e42feep-1, l.high);
  return sum.high + (sum.low + (l.low + l.exponent * 0x1.a39ef35793c76p-33));
}

// In parts, so that powers of ten give integers.
double log10(double x) {
  const double value = log(x);
  return value * 0x1.bcb7b1526e50ep-2 + value * 0x1.95355baaafad3p-57;
}

double hypot(double x, double y) {
  double a = std::abs(x), b = std::abs(y);
  if (a == infinity || b == infinity) return infinity;
  if (a < b) std::swap(a, b);
  if (a == 0 || b == 0) return a + b;
  double scale = 1;
  if (a > 0x1p500) scale = 0x1p600, a *= 0x1p-600, b *= 0x1p-600;
  if (a < 0x1p-450) scale = 0x1p-600, a *= 0x1p600, b *= 0x1p600;
  return scale * std::sqrt(a * a + b * b);
}

}  // namespace amontons::elementary
