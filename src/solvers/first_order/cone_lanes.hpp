// Private to *.isa.cpp: Coulomb's cone in world axes, `width` contacts at a time.
#pragma once
#include "solvers/first_order/contact_lanes.hpp"
#include "solvers/first_order/pass_data.hpp"

namespace amontons::AMONTONS_ISA {
namespace {

// Projection of z on { |t| <= mu n } along the unit vector n without a frame or a branch. In the third
// region the foot on the boundary ray (1, mu z_t / t) is
//  Pi(z) = k t n + mu k z_t,  k = (z_n + mu t) / ((1 + mu^2) t),  t = |z_t|
//        = mu k z + k (t - mu z_n) n            with z_t = z - z_n n,
// This form needs no z_t and is exact for z inside after the blend. All three regions are a z + b n:
//  inside (1, 0),   polar (0, 0),   else (mu k, k (t - mu z_n)).
// If t = 0, k is infinite or NaN and not used.
//
// In a metric that scales tangents by `aspect`, aspect t and aspect mu replace t and mu.
AMONTONS_INLINE Vec3 project(const Vec3& z, const Vec3& n, Vec mu, Vec aspect) {
  const Vec zero = {}, one = zero + 1.0;
  const Vec zn = dot(z, n);
  const Vec3 zt = z - zn * n;
  const Vec t = aspect * square_root(dot(zt, zt));
  mu = aspect * mu;
  const Vec k = (zn + mu * t) / ((one + mu * mu) * t);
  const Vec on_z = mu * k, on_n = k * (t - mu * zn);
  // Each region is computed for every lane; the blend selects by masks.
  const auto inside = t <= mu * zn;
  const auto polar = mu * t <= -zn;
  const Vec a = polar ? zero : inside ? one : on_z;  // polar first: with mu = 0 inside is 0 <= -0
  const Vec b = polar ? zero : inside ? zero : on_n;
  return a * z + b * n;
}

// n x u| = |u_t| for a unit n; the De Saxce term is mu times that.
AMONTONS_INLINE Vec tangential_speed(const Vec3& u, const Vec3& n) {
  const Vec3 ut = cross(n, u);
  return square_root(dot(ut, ut));
}

// p |x - Pi_K(x - step)|^2 with step = g / p, as natural_map_squared() in problem/residual.hpp. It is formed
// without cancellation, as in Friction::natural_map(). With the trial point z = x - step it is
//  e = step + (z - Pi(z)),   z - Pi(z) = k z_t - mu k t n,   k = (t - mu z_n) / ((1 + mu^2) t),   t = |z_t|
// on the boundary. Inside, z - Pi(z) is zero, however large x is; in the polar cone it is z_t + z_n n.
AMONTONS_INLINE Vec natural_map(const ContactBatch& batch, int lane, const Vec3& x, const Vec3& g,
                                const Vec3& n) {
  const Vec zero = {}, one = zero + 1.0, mu = load(batch.mu + lane);
  const Vec3 step = load(batch.p_inverse + lane) * g, z = x - step;
  const Vec zn = dot(z, n);
  const Vec3 zt = z - zn * n;
  const Vec t = square_root(dot(zt, zt));
  const Vec k = (t - mu * zn) / ((one + mu * mu) * t);  // not used where t = 0
  const auto inside = t <= mu * zn;
  const auto polar = mu * t <= -zn;
  const Vec a = polar ? one : inside ? zero : k;  // polar first: with mu = 0 inside is 0 <= -0
  const Vec b = polar ? zn : inside ? zero : -(mu * k * t);
  const Vec3 e = step + (a * zt + b * n);
  return load(batch.p + lane) * dot(e, e);
}

}  // namespace
}  // namespace amontons::AMONTONS_ISA
