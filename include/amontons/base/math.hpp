#pragma once
#include <array>
#include <cmath>

// Small vectors, matrices, rotations and rigid transforms: plain data, row-major, SI units. Rotations are
// unit quaternions (w, x, y, z) that turn body coordinates into world coordinates.
namespace amontons {

struct Vec3 {
  double x = 0, y = 0, z = 0;

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
inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
constexpr double norm_squared(const Vec3& a) { return dot(a, a); }
inline Vec3 normalised(const Vec3& a) { return a / norm(a); }
inline bool is_finite(const Vec3& a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}
constexpr Vec3 to_vec3(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

// |a_ij - a_ji| up to this fraction of the largest entry is rounding; beyond it a matrix is not symmetric.
inline constexpr double asymmetry_of_rounding = 1e-10;

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
constexpr Mat3 skew(const Vec3& v) { return {{{0, -v.z, v.y}, {v.z, 0, -v.x}, {-v.y, v.x, 0}}}; }
constexpr double determinant(const Mat3& m) { return dot(m.row[0], cross(m.row[1], m.row[2])); }
// The inverse by cofactors; the caller makes sure that the determinant is not zero.
constexpr Mat3 inverse(const Mat3& m) {
  const Vec3 a = cross(m.row[1], m.row[2]), b = cross(m.row[2], m.row[0]), c = cross(m.row[0], m.row[1]);
  const double s = 1 / dot(m.row[0], a);
  return transposed({{s * a, s * b, s * c}});
}

struct Quat {
  double w = 1, x = 0, y = 0, z = 0;

  constexpr Vec3 vector() const { return {x, y, z}; }
  constexpr bool operator==(const Quat&) const = default;
};

constexpr Quat operator*(const Quat& a, const Quat& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
constexpr Quat conjugate(const Quat& q) { return {q.w, -q.x, -q.y, -q.z}; }
inline double norm(const Quat& q) { return std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z); }
inline Quat normalised(const Quat& q) {
  const double s = 1 / norm(q);
  return {s * q.w, s * q.x, s * q.y, s * q.z};
}
constexpr Mat3 to_matrix(const Quat& q) {
  const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z, xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z,
               wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
  return {{{1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy)},
           {2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx)},
           {2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)}}};
}
constexpr Vec3 rotate(const Quat& q, const Vec3& v) {
  const Vec3 t = 2 * cross(q.vector(), v);
  return v + q.w * t + cross(q.vector(), t);
}
// The rotation by the angle |r| about r (rad), exact; series below 1e-4 rad, where sin(a) / a cancels.
inline Quat exponential(const Vec3& r) {
  const double a = norm(r), half = 0.5 * a;
  const double s = a < 1e-4 ? 0.5 - a * a / 48 : std::sin(half) / a;
  return {std::cos(half), s * r.x, s * r.y, s * r.z};
}
// The rotation vector of q, of length at most pi: exponential(logarithm(q)) = +-q.
inline Vec3 logarithm(const Quat& q) {
  const Vec3 v = q.w < 0 ? -q.vector() : q.vector();
  const double s = norm(v), w = std::abs(q.w);
  return s < 1e-8 ? (2 / w) * v : (2 * std::atan2(s, w) / s) * v;
}
// The rotation whose third axis is the unit vector z, the other two as in contact_tangents().
inline Quat rotation_to_z(const Vec3& z) {
  // Half-way quaternion of e_z -> z; for z near -e_z turn by pi about x first.
  if (z.z > -0.9999) return normalised({1 + z.z, -z.y, z.x, 0});
  return normalised(Quat{1 - z.z, z.y, -z.x, 0} * Quat{0, 1, 0, 0});
}

// A rigid transform: coordinates of a frame into those of its parent, x -> rotation x + position.
struct Transform {
  Vec3 position;
  Quat rotation;

  constexpr Vec3 operator()(const Vec3& point) const { return rotate(rotation, point) + position; }
  constexpr bool operator==(const Transform&) const = default;
};
constexpr Transform operator*(const Transform& a, const Transform& b) {
  return {a(b.position), a.rotation * b.rotation};
}
constexpr Transform inverse(const Transform& t) {
  const Quat c = conjugate(t.rotation);
  return {rotate(c, -t.position), c};
}

}  // namespace amontons
