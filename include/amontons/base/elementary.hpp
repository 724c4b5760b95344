#pragma once

// The transcendental functions with the same bits on every system. IEEE 754 fixes +, -, *, / and the square
// root, not these: the C libraries of Linux, macOS and Windows differ from each other, and one of them from
// release to release, in the last bit. A simulation that differs in the last bit of one angle differs in all
// bits a second later. Only operations that are fixed are used here, in a fixed order.
//
// The result is within one unit in the last place of the exact one (sin, cos, atan2, log, expm1, hypot) or
// two (tan, asin, log10), for every argument; `test_elementary` measures it. Special values (zeros with a
// sign, infinities, NaN) are treated as C does. Angles in rad.
namespace amontons::elementary {

double sin(double x);
double cos(double x);
double tan(double x);
double asin(double x);
// The angle of (x, y), in [-pi, pi].
double atan2(double y, double x);
// exp(x) - 1, without the cancellation near zero.
double expm1(double x);
double log(double x);
double log10(double x);
// The length of (x, y), without overflow between.
double hypot(double x, double y);

}  // namespace amontons::elementary
