#pragma once
#include <array>
#include <cmath>

#include "amontons/base/elementary.hpp"

// Small vectors, matrices, rotations and rigid transforms: plain data, row-major, SI units. Rotations are
// unit quaternions (w, x, y, z) that turn body coordinates into world coordinates.
//
// Everything is written out component by component in a fixed order, so that results are the same with every
// compiler and instruction set. Functions do not check their input: a zero vector has no direction, and the
// caller must exclude it.
namespace amontons {

// A point (m), a direction, or any three numbers; compared exactly.

struct Vec3 {
  double x = 0, y = 0, z = 0;

  // Component i = 0, 1, 2. By comparisons: an index that the compiler knows costs nothing.
  constexpr double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr double& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  constexpr Vec3& operator+=(const Vec3& b) { return x += b.x, y += b.y, z += b.z, *this; }
  constexpr Vec3& operator-=(const Vec3& b) { return x -= b.x, y -= b.y, z -= b.z, *this; }
  constexpr Vec3& operator*=(double s) { return x *= s, y *= s, z *= s, *this; }
  constexpr bool operator==(const Vec3&) const = default;
  constexpr std::array<double, 3> array() const { return {x, y, z}; }
};

constexpr Vec3 operator+(Vec3 a, const Vec3& b) { return a += b; }
constexpr Vec3 operator-(Vec3 a, const Vec3& b) { return a -= b; }
constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(double s, Vec3 a) { return a *= s; }
constexpr Vec3 operator*(Vec3 a, double s) { return a *= s; }
constexpr Vec3 operator/(const Vec3& a, double s) { return {a.x / s, a.y / s, a.z / s}; }
constexpr double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// Euclidean length; squares overflow beyond 1e154, far from any size in m.
inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
constexpr double norm_squared(const Vec3& a) { return dot(a, a); }
// The unit vector along a; NaN for a = 0.
inline Vec3 normalised(const Vec3& a) { return a / norm(a); }
inline bool is_finite(const Vec3& a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}
constexpr Vec3 to_vec3(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

// Inertia tensors from files and programs are symmetric only up to rounding. |a_ij - a_ji| up to this
// fraction of the largest entry is rounding; a larger difference is an error.
inline constexpr double asymmetry_of_rounding = 1e-10;

// A 3 x 3 matrix by its rows: m v is three dot products.
struct Mat3 {
  Vec3 row[3];

  static constexpr Mat3 diagonal(double a, double b, double c) { return {{{a, 0, 0}, {0, b, 0}, {0, 0, c}}}; }
  static constexpr Mat3 identity() { return diagonal(1, 1, 1); }
  constexpr double operator()(int i, int j) const { return row[i][j]; }
  constexpr double& operator()(int i, int j) { return row[i][j]; }
  constexpr Vec3 column(int j) const { return {row[0][j], row[1][j], row[2][j]}; }
};

constexpr Vec3 operator*(const Mat3& m, const Vec3& v) {
  return {dot(m.row[0], v), dot(m.row[1], v), dot(m.row[2], v)};
}
constexpr Mat3 transposed(const Mat3& m) { return {{m.column(0), m.column(1), m.column(2)}}; }
constexpr Mat3 operator*(const Mat3& a, const Mat3& b) {
  const Mat3 t = transposed(b);
  return {{{dot(a.row[0], t.row[0]), dot(a.row[0], t.row[1]), dot(a.row[0], t.row[2])},
           {dot(a.row[1], t.row[0]), dot(a.row[1], t.row[1]), dot(a.row[1], t.row[2])},
           {dot(a.row[2], t.row[0]), dot(a.row[2], t.row[1]), dot(a.row[2], t.row[2])}}};
}
constexpr Mat3 operator+(const Mat3& a, const Mat3& b) {
  return {{a.row[0] + b.row[0], a.row[1] + b.row[1], a.row[2] + b.row[2]}};
}
constexpr Mat3 operator*(double s, const Mat3& a) { return {{s * a.row[0], s * a.row[1], s * a.row[2]}}; }
// The matrix of the cross product: skew(v) a = v x a.
constexpr Mat3 skew(const Vec3& v) { return {{{0, -v.z, v.y}, {v.z, 0, -v.x}, {-v.y, v.x, 0}}}; }
// The volume that the rows span.
constexpr double determinant(const Mat3& m) { return dot(m.row[0], cross(m.row[1], m.row[2])); }
// The inverse by cofactors. The product of two rows is perpendicular to both; divided by the determinant
// these products are the columns of the inverse. The caller must ensure that the determinant is not zero.
constexpr Mat3 inverse(const Mat3& m) {
  const Vec3 a = cross(m.row[1], m.row[2]), b = cross(m.row[2], m.row[0]), c = cross(m.row[0], m.row[1]);
  const double s = 1 / dot(m.row[0], a);
  return transposed({{s * a, s * b, s * c}});
}

// The rotation by the angle a about the unit axis e is (cos(a / 2), sin(a / 2) e); q and -q are the same
// rotation. Products drift from unit length only by rounding; integrators normalise them.
struct Quat {
  double w = 1, x = 0, y = 0, z = 0;

  constexpr Vec3 vector() const { return {x, y, z}; }
  constexpr bool operator==(const Quat&) const = default;
};

// Hamilton's product, (a, u) (b, v) = (a b - <u, v>, a v + b u + u x v): first the turn b, then the turn a.
constexpr Quat operator*(const Quat& a, const Quat& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
// The inverse rotation of a unit quaternion.
constexpr Quat conjugate(const Quat& q) { return {q.w, -q.x, -q.y, -q.z}; }
inline double norm(const Quat& q) { return std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z); }
inline Quat normalised(const Quat& q) {
  const double s = 1 / norm(q);
  return {s * q.w, s * q.x, s * q.y, s * q.z};
}
// R = 1 + 2 w skew(v) + 2 skew(v)^2 for q = (w, v); its columns are the axes of the body in the world. For
// many vectors the matrix is faster, for one rotate().
constexpr Mat3 to_matrix(const Quat& q) {
  const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z, xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z,
               wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
  return {{{1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy)},
           {2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx)},
           {2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)}}};
}
// q p q* without the products by zero: with t = 2 v x p it is p + w t + v x t, as skew(v)^2 p = v x (v x p).
constexpr Vec3 rotate(const Quat& q, const Vec3& v) {
  const Vec3 t = 2 * cross(q.vector(), v);
  return v + q.w * t + cross(q.vector(), t);
}
// The rotation by the angle a = |r| about r (rad), exact: (cos(a / 2), sin(a / 2) r / a). Bodies turn little
// in a step. Up to 0.1 rad both factors come from their series in t = a^2 / 4, without a division by zero;
// the next terms are below rounding (t^5 / 10! is 3e-20).
inline Quat exponential(const Vec3& r) {
  const double t = 0.25 * dot(r, r);
  if (t < 2.5e-3) {
    const double c = 1 - t * (1.0 / 2 - t * (1.0 / 24 - t * (1.0 / 720 - t * (1.0 / 40320))));
    const double s = 0.5 - t * (1.0 / 12 - t * (1.0 / 240 - t * (1.0 / 10080 - t * (1.0 / 725760))));
    return {c, s * r.x, s * r.y, s * r.z};
  }
  const double half = std::sqrt(t), s = elementary::sin(half) / (2 * half);
  return {elementary::cos(half), s * r.x, s * r.y, s * r.z};
}
// The rotation vector of q (rad), of length at most pi: exponential(logarithm(q)) = +-q. With q = (w, v) and
// w >= 0 the angle is 2 atan2(|v|, w). This keeps all digits at every angle; an arc cosine of w would lose
// half of them near 0. Its direction is v / |v|. Up to |v| / w = 0.01, as for joint errors, it comes from the
// series of atan in t = (|v| / w)^2, whose next term t^4 / 9 is below rounding.
inline Vec3 logarithm(const Quat& q) {
  const Vec3 v = q.w < 0 ? -q.vector() : q.vector();
  const double squared = dot(v, v), w = std::abs(q.w), t = squared / (w * w);
  if (t < 1e-4) return (2 * (1 - t * (1.0 / 3 - t * (1.0 / 5 - t * (1.0 / 7)))) / w) * v;
  const double s = std::sqrt(squared);
  return (2 * elementary::atan2(s, w) / s) * v;
}
// The rotation whose third axis is the unit vector z; the other two are the tangents of a contact with the
// normal z. The quaternion half-way between the identity and the turn by twice the angle from e_z to z is (1
// + <e_z, z>, e_z x z), not normalised. It vanishes at z = -e_z, so another one is used near there. The
// tangents jump between the two, which no choice can avoid.
inline Quat rotation_to_z(const Vec3& z) {
  if (z.z > -0.9999) return normalised({1 + z.z, -z.y, z.x, 0});
  // First by pi about x, from e_z to -e_z, then from there to z.
  return normalised(Quat{1 - z.z, z.y, -z.x, 0} * Quat{0, 1, 0, 0});
}

// A rigid transform from coordinates of a frame to those of its parent, x -> rotation x + position.
struct Transform {
  Vec3 position;
  Quat rotation;

  constexpr Vec3 operator()(const Vec3& point) const { return rotate(rotation, point) + position; }
  constexpr bool operator==(const Transform&) const = default;
};
// First b, then a.
constexpr Transform operator*(const Transform& a, const Transform& b) {
  return {a(b.position), a.rotation * b.rotation};
}
// x = R y + p solved for y = R' x - R' p.
constexpr Transform inverse(const Transform& t) {
  const Quat c = conjugate(t.rotation);
  return {rotate(c, -t.position), c};
}

}  // namespace amontons
