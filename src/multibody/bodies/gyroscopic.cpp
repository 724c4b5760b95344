#include "multibody/bodies/gyroscopic.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace amontons {

namespace {

// One implicit midpoint step of Euler's equations, I (W1 - W0) = s (I Wm) x Wm with Wm = (W0 + W1) / 2. For
// any s it keeps |I W| and <W, I W>, and the Cayley transform of s Wm, a rotation by 2 atan(s |Wm| / 2),
// keeps the momentum in space (Simo and Wong, IJNME 1991; Krysl and Endres, IJNME 2005).
// s = 2 tan(h |Wm| / 2) / |Wm| makes that rotation exp(h Wm), which is exact when W is constant.
//
// Newton's method for F(W) = 2 I (W - W0) - s (I W) x W = 0 in W = Wm, with s taken as constant in the
// derivative: d((I W) x W) = ([I W]x - [W]x I) dW.
Vec3 midpoint(const Mat3& I, const Vec3& W0, double h) {
  Vec3 W = W0;
  const double size = norm(W0);
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double w = norm(W), half = std::min(0.5 * h * w, 1.2);
    const double s = half < 1e-6 ? h : 2 * std::tan(half) / w;
    const Vec3 L = I * W;
    const Vec3 F = 2 * (I * (W - W0)) - s * cross(L, W);
    const Mat3 J = 2.0 * I + -s * (skew(L) + -1.0 * (skew(W) * I));
    const Vec3 step = inverse(J) * F;
    W -= step;
    if (norm(step) <= 1e-16 * size) break;
  }
  return W;
}

// Rotations of more than this in a step (rad) are made of several.
constexpr double largest_turn = 0.5;
constexpr double most_parts = 1e6;

}  // namespace

Vec3 torque_free_mean(const Mat3& I, const Vec3& omega, double h) {
  const Vec3 L = I * omega;
  const double spin = norm(omega), momentum = norm(L);
  // A principal axis stays the axis: there is nothing to solve (and spheres stay exact).
  if (norm(cross(L, omega)) <= 1e-14 * momentum * spin) return omega;
  const double parts = std::ceil(h * spin / largest_turn);
  if (parts <= 1) return midpoint(I, omega, h);
  // Body axes: W1 = 2 Wm - W0 after each part; the turns compose from the right.
  const double part = h / std::min(parts, most_parts);
  Quat turn;
  Vec3 W = omega;
  for (double k = 0; k < std::min(parts, most_parts); ++k) {
    const Vec3 mean = midpoint(I, W, part);
    turn = turn * exponential(part * mean);
    W = 2 * mean - W;
  }
  // The logarithm is short of whole turns: take the branch next to h omega.
  const Vec3 r = logarithm(normalised(turn));
  const double angle = norm(r);
  if (angle == 0) return omega;
  const Vec3 axis = r / angle;
  const double turns = std::round((h * dot(omega, axis) - angle) / (2 * std::numbers::pi));
  return ((angle + 2 * std::numbers::pi * turns) / h) * axis;
}

}  // namespace amontons
