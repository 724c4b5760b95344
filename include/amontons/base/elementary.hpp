#pragma once

// The transcendental functions with the same bits on every system. IEEE 754 fixes +, -, *, / and the square
// root, but not these functions. The C libraries of Linux, macOS and Windows differ in the last bit, and one
// of them differs between releases. A simulation that differs in the last bit of one angle differs in all
// bits a second later. Only fixed operations are used here, in a fixed order.
//
// The result is within one unit in the last place of the exact one (sin, cos, atan2, log, expm1, hypot), or
// within two (tan, asin, log10). This holds for every argument; `test_elementary` measures it. Special values
// (zeros with a sign, infinities, NaN) are treated as C does. Angles in rad.
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
// The length of (x, y), without overflow of intermediate results.
double hypot(double x, double y);

}  // namespace amontons::elementary
