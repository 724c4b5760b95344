#pragma once
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/contact_system.hpp"

// Products of one Jacobian row j, a wrench on each of its bodies, with the bodies' velocities and inverse
// masses.
namespace amontons {

// One side of the row: the power of its wrench, <j, v>.
inline double power(const std::array<double, 6>& j, const BodyVelocity& v) {
  return j[0] * v.linear.x + j[1] * v.linear.y + j[2] * v.linear.z + j[3] * v.angular.x + j[4] * v.angular.y +
         j[5] * v.angular.z;
}

// The velocity along the row, u + j v. Bodies without an entry, the world and auxiliary ones, are at rest.
inline double row_velocity(const JacobianRow& row, const BodyVelocities& v, double u = 0) {
  const Index n = static_cast<Index>(v.size());
  if (row.body_a >= 0 && row.body_a < n) u += power(row.a, v[row.body_a]);
  if (row.body_b >= 0 && row.body_b < n) u += power(row.b, v[row.body_b]);
  return u;
}

// One side of j M^-1 j': f'f / m + t' I^-1 t.
inline double side_inverse_mass(const std::array<double, 6>& j, const BodyMobility& body) {
  const Vec3 f{j[0], j[1], j[2]}, t{j[3], j[4], j[5]};
  return body.inverse_mass * dot(f, f) + dot(t, body.inverse_inertia * t);
}

// The inverse of the row's effective mass, j M^-1 j': the velocity along the row that a unit impulse along it
// makes.
inline double inverse_effective_mass(const JacobianRow& row, const BodyMobilities& bodies) {
  double w = 0;
  if (row.body_a >= 0) w += side_inverse_mass(row.a, bodies[row.body_a]);
  if (row.body_b >= 0) w += side_inverse_mass(row.b, bodies[row.body_b]);
  return w;
}

}  // namespace amontons
