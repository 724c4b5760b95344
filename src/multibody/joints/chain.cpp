#include "multibody/joints/chain.hpp"

#include <cmath>

#include "amontons/base/elementary.hpp"
#include "amontons/base/policy.hpp"
#include "amontons/problem/contact.hpp"

namespace amontons {
namespace {

// The rotation by an angle about a unit axis.
Quat turn_about(const Vec3& axis, double angle) {
  const double c = elementary::cos(0.5 * angle), s = elementary::sin(0.5 * angle);
  return {c, s * axis.x, s * axis.y, s * axis.z};
}

// The columns of the spatial Jacobian. Dof i moves A about or along its axis, which the dofs before it have
// moved: T'(q) T^-1 = sum_i Ad(exp(s_1 q_1) ... exp(s_(i-1) q_(i-1))) s_i q'_i. `t` becomes T(q). Screws of
// slides are complete; for hinges `points` holds a point on the axis.
void place_axes(const Joint& joint, std::span<const double> q, std::array<Screw, 6>& screws,
                std::array<Vec3, 6>& points, Transform& t) {
  for (std::size_t i = 0; i < joint.dofs.size(); ++i) {
    const Dof& dof = joint.dofs[i];
    const Vec3 axis = rotate(t.rotation, dof.axis);
    if (dof.kind == Dof::Kind::slide) {
      screws[i] = {axis, {}};
      t.position += q[i] * axis;
      continue;
    }
    points[i] = t(dof.anchor);
    screws[i] = {{}, axis};
    // exp of a hinge: the rotation about a point p is x -> p + R (x - p).
    const Quat rotation = turn_about(dof.axis, q[i]);
    t = t * Transform{dof.anchor - rotate(rotation, dof.anchor), rotation};
  }
}

using Vec6 = std::array<double, 6>;

// A twist in units in which a displacement by `length` counts as one radian; twists are measured by its
// Euclidean norm. A wrench w in these units has the power <w, scaled twist>.
Vec6 scaled(const Screw& s, double length) {
  return {s.linear.x / length, s.linear.y / length, s.linear.z / length,
          s.angular.x,         s.angular.y,         s.angular.z};
}

// The scaled screw of dof i. The rotation of a spherical joint is free, so only displacements determine its
// dofs.
Vec6 column(const ChainKinematics& chain, std::size_t i, double length) {
  return scaled({chain.screws[i].linear, chain.spherical ? Vec3{} : chain.screws[i].angular}, length);
}

double dot(const Vec6& a, const Vec6& b) {
  double sum = 0;
  for (int i = 0; i < 6; ++i) sum += a[i] * b[i];
  return sum;
}

// Matrices here have the size of the joint's dofs, at most six: plain loops on arrays, no allocation.
//
// N + shift 1 = L L' in place (lower triangle); false if a pivot is not positive.
bool cholesky(std::array<Vec6, 6>& n, std::size_t k, double shift) {
  for (std::size_t j = 0; j < k; ++j) {
    double pivot = n[j][j] + shift;
    for (std::size_t l = 0; l < j; ++l) pivot -= n[j][l] * n[j][l];
    if (!(pivot > 0)) return false;
    n[j][j] = std::sqrt(pivot);
    for (std::size_t i = j + 1; i < k; ++i) {
      double sum = n[i][j];
      for (std::size_t l = 0; l < j; ++l) sum -= n[i][l] * n[j][l];
      n[i][j] = sum / n[j][j];
    }
  }
  return true;
}

// Column i of (L L')^-1: L y = e_i forwards, L' y = y backwards.
Vec6 inverse_column(const std::array<Vec6, 6>& L, std::size_t k, std::size_t i) {
  Vec6 y{};
  y[i] = 1;
  for (std::size_t r = 0; r < k; ++r) {
    for (std::size_t c = 0; c < r; ++c) y[r] -= L[r][c] * y[c];
    y[r] /= L[r][r];
  }
  for (std::size_t r = k; r-- > 0;) {
    for (std::size_t c = r + 1; c < k; ++c) y[r] -= L[c][r] * y[c];
    y[r] /= L[r][r];
  }
  return y;
}

// (N + shift 1)^-1 of the Gram matrix of unit columns. Only near a singular pose (gimbal lock) it is damped,
// in proportion to the manipulability sqrt(det N): Nakamura and Hanafusa, "Inverse kinematic solutions with
// singularity robustness for robot manipulator control", J. Dyn. Sys. Meas. Control 108 (1986).
//
// With unit columns sqrt(det N) is 1 for axes at right angles and 0 if two coincide. The damping, relative to
// the unit diagonal of N, grows from 0 at `regular` to its square at the singular pose. The square is half
// of the digits, which balances the error of the damping against rounding over it. For equal axes rounding
// keeps the factor finite.
void damped_inverse(const std::array<Vec6, 6>& gram, std::size_t k, std::array<Vec6, 6>& out) {
  std::array<Vec6, 6> n = gram;
  double manipulability = 0;
  if (cholesky(n, k, 0)) {
    manipulability = 1;
    for (std::size_t i = 0; i < k; ++i) manipulability *= n[i][i];
  }
  const double regular = std::sqrt(base::half_of_digits());
  if (manipulability < regular) {
    const double damping = regular - manipulability;
    n = gram;
    cholesky(n, k, damping * damping + 1e-15);  // not tuned: rounding
  }
  for (std::size_t i = 0; i < k; ++i) out[i] = inverse_column(n, k, i);
}

// The same for two or three columns, as in nearly all joints: by cofactors, with one division.
bool invert_small(const std::array<Vec6, 6>& n, std::size_t k, std::array<Vec6, 6>& out) {
  if (k > 3) return false;
  const double xy = n[1][0], xz = k == 3 ? n[2][0] : 0, yz = k == 3 ? n[2][1] : 0;
  const double xx = n[0][0], yy = n[1][1], zz = k == 3 ? n[2][2] : 1;
  const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
  const double det = xx * a + xy * b + xz * c;
  if (!(det >= base::half_of_digits())) return false;
  const double s = 1 / det;
  out[0] = {s * a, s * b, s * c};
  out[1] = {s * b, s * (xx * zz - xz * xz), s * (xy * xz - xx * yz)};
  out[2] = {s * c, s * (xy * xz - xx * yz), s * (xx * yy - xy * xy)};
  return true;
}

// Screws that are pure translations or pure rotations about the reference, by kind.
struct PureScrews {
  std::size_t n_slides = 0, n_hinges = 0;
  std::array<Vec3, 6> slides, hinges;
};

// Whether the wrenches split into pure forces and pure torques: all hinges pass through the reference, within
// rounding. Then forces do no work on hinges and torques none on slides, and each half is a complement in
// space.
bool split(const ChainKinematics& chain, double length, PureScrews& out) {
  for (std::size_t i = 0; i < chain.dofs; ++i) {
    const Screw& s = chain.screws[i];
    if (s.angular == Vec3{}) {
      out.slides[out.n_slides++] = s.linear;
    } else {
      if (norm(s.linear) > base::policy.rounding * length * norm(s.angular)) return false;
      out.hinges[out.n_hinges++] = s.angular;
    }
  }
  return out.n_slides <= 3 && out.n_hinges <= 3;
}

// An orthonormal basis of the complement of k directions in space: always 3 - k vectors (none for k > 3),
// even if the directions are dependent.
std::size_t complement(const std::array<Vec3, 6>& directions, std::size_t k, std::array<Vec3, 3>& out) {
  if (k == 0) {
    out = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    return 3;
  }
  if (k > 2) return 0;
  const ContactBasis basis(normalised(directions[0]));
  out[0] = basis.tangent_1;
  out[1] = basis.tangent_2;
  if (k == 1) return 2;
  // Two directions leave their normal. If they are parallel (gimbal lock) any perpendicular direction serves.
  const Vec3 normal = cross(directions[0], directions[1]);
  const double sine = norm(normal);
  if (sine > base::policy.rounding) out[0] = normal / sine;
  return 1;
}

// An orthonormal set that grows: at most six columns and six directions of their complement.
struct Basis {
  std::size_t n = 0;
  std::array<Vec6, 12> vectors;

  // Gram-Schmidt, twice for orthogonality to rounding; returns the remaining norm.
  double orthogonalise(Vec6& v) const {
    for (int pass = 0; pass < 2; ++pass)
      for (std::size_t i = 0; i < n; ++i) {
        const double s = dot(v, vectors[i]);
        for (int c = 0; c < 6; ++c) v[c] -= s * vectors[i][c];
      }
    return std::sqrt(dot(v, v));
  }
  const Vec6& keep(Vec6 v, double size) {
    for (double& c : v) c /= size;
    return vectors[n++] = v;
  }
};

// The complement of `count` columns in six dimensions, from coordinate directions, the most independent
// first.
std::size_t complement6(const std::array<Vec6, 6>& columns, std::size_t count, std::size_t dimension,
                        std::array<Vec6, 6>& out) {
  const double dependent = base::policy.rounding;
  Basis basis;
  for (std::size_t i = 0; i < count; ++i) {
    Vec6 v = columns[i];
    const double before = std::sqrt(dot(v, v));
    const double left = basis.orthogonalise(v);
    if (left > dependent * before) basis.keep(v, left);
  }
  // For the unit vector e_i: the squared part orthogonal to the basis, 1 - sum_j <e_i, v_j>^2.
  Vec6 across;
  for (int i = 0; i < 6; ++i) {
    across[i] = 1;
    for (std::size_t j = 0; j < basis.n; ++j) across[i] -= basis.vectors[j][i] * basis.vectors[j][i];
  }
  const std::size_t wanted = dimension > count ? dimension - count : 0;
  for (std::size_t found = 0; found < wanted; ++found) {
    std::size_t best = 0;
    for (std::size_t e = 1; e < dimension; ++e)
      if (across[e] > across[best] + dependent) best = e;
    Vec6 v{};
    v[best] = 1;
    const double left = basis.orthogonalise(v);
    out[found] = basis.keep(v, left);
    for (int i = 0; i < 6; ++i) across[i] -= out[found][i] * out[found][i];
  }
  return wanted;
}

// One hinge: T(q) does not move the points of its axis, including the reference.
ChainKinematics hinge_kinematics(const Dof& dof, const Transform& relative, double q) {
  ChainKinematics chain;
  const Quat turn = turn_about(dof.axis, q);
  chain.dofs = 1;
  chain.target = {dof.anchor - rotate(turn, dof.anchor), turn};
  chain.reference = dof.anchor;
  chain.screws[0] = {{}, dof.axis};
  chain.error = {relative.position + (rotate(relative.rotation, dof.anchor) - dof.anchor),
                 logarithm(relative.rotation * conjugate(turn))};
  return chain;
}

}  // namespace

// T(q), the axes in that pose, and the difference of the present pose from it. The twists are those at T(q)
// and not at the present pose, which the joint may be unable to reach.
ChainKinematics chain_kinematics(const Joint& joint, const Transform& relative, std::span<const double> q) {
  if (is_hinge(joint)) return hinge_kinematics(joint.dofs[0], relative, q[0]);
  ChainKinematics chain;
  chain.dofs = joint.dofs.size();
  chain.spherical = joint.spherical || joint.kind == JointKind::distance;
  std::array<Vec3, 6> points;
  Transform& t = chain.target;
  place_axes(joint, q, chain.screws, points, t);
  chain.reference = t.position;
  for (std::size_t i = 0; i < chain.dofs && !chain.spherical; ++i)
    if (joint.dofs[i].kind == Dof::Kind::hinge) chain.reference = points[i];
  // Screws refer to points of their own axes until now; all are moved to the reference, where they can be
  // added. A rotation about an axis through p moves the reference r by axis x (r - p).
  for (std::size_t i = 0; i < chain.dofs; ++i)
    if (joint.dofs[i].kind == Dof::Kind::hinge)
      chain.screws[i].linear = cross(chain.screws[i].angular, chain.reference - points[i]);
  // X T^-1 with the present pose X moves the reference by this. If the reference is the origin itself, it is
  // a difference of positions without cancellation.
  const Quat rotation = relative.rotation * conjugate(t.rotation);
  const Vec3 lever = chain.reference - t.position;
  chain.error = {(relative.position - t.position) + (rotate(rotation, lever) - lever), logarithm(rotation)};
  return chain;
}

bool is_chain(const Joint& joint) { return joint.kind == JointKind::chain || joint.upper_distance == 0; }

// With the scaled screws as the columns of S, q' = (S'S)^-1 S' twist, and dual_i is column i of S (S'S)^-1.
// The columns are scaled to unit length, C = S U, so that N = C'C shows how singular the pose is:
//   S (S'S)^-1 = C N^-1 U.
std::array<Screw, 6> dual_wrenches(const ChainKinematics& chain, double length) {
  std::array<Screw, 6> duals;
  const std::size_t k = chain.dofs;
  if (k == 0) return duals;
  if (k == 1) {
    const Vec6 c = column(chain, 0, length);
    const double squared = dot(c, c), s = squared > 0 ? 1 / squared : 0;
    duals[0] = {(s / length) * Vec3{c[0], c[1], c[2]}, s * Vec3{c[3], c[4], c[5]}};
    return duals;
  }
  std::array<Vec6, 6> columns, n;
  Vec6 unit;  // U
  const double per_length = 1 / length;
  for (std::size_t i = 0; i < k; ++i) {
    columns[i] = column(chain, i, length);
    // A hinge through the origin of frame_a of a ball has no displacement there: its rate is undetermined,
    // and set to zero.
    const double size = std::sqrt(dot(columns[i], columns[i]));
    unit[i] = size > 0 ? 1 / size : 0;
    for (double& c : columns[i]) c *= unit[i];
    for (std::size_t j = 0; j <= i; ++j) n[i][j] = dot(columns[i], columns[j]);
    if (size == 0) n[i][i] = 1;
  }
  // y is column i of N^-1; dual_i = C y u_i, in units of forces and torques again.
  std::array<Vec6, 6> inverse;
  if (!invert_small(n, k, inverse)) damped_inverse(n, k, inverse);
  for (std::size_t i = 0; i < k; ++i) {
    const Vec6& y = inverse[i];
    Vec6 p{};
    for (std::size_t j = 0; j < k; ++j) {
      const double f = unit[i] * y[j];
      for (int c = 0; c < 6; ++c) p[c] += f * columns[j][c];
    }
    duals[i] = {per_length * Vec3{p[0], p[1], p[2]}, {p[3], p[4], p[5]}};
  }
  return duals;
}

// The complement of the screws: <wrench, screw_i> = 0. In all common joints every screw is a pure slide or a
// hinge through the reference. Forces then complement the slides and torques the hinges: a hinge has three
// forces and two torques, as in a textbook. Otherwise the complement is one in six dimensions.
std::size_t locked_wrenches(const ChainKinematics& chain, double length, std::array<Screw, 6>& wrenches) {
  PureScrews pure;
  if (split(chain, length, pure)) {
    std::size_t count = 0;
    std::array<Vec3, 3> basis;
    const std::size_t forces = complement(pure.slides, pure.n_slides, basis);
    for (std::size_t i = 0; i < forces; ++i) wrenches[count++] = {basis[i], {}};
    const std::size_t torques = chain.spherical ? 0 : complement(pure.hinges, pure.n_hinges, basis);
    for (std::size_t i = 0; i < torques; ++i) wrenches[count++] = {{}, length * basis[i]};
    return count;
  }
  std::array<Vec6, 6> columns, out;
  for (std::size_t i = 0; i < chain.dofs; ++i) columns[i] = column(chain, i, length);
  const std::size_t count = complement6(columns, chain.dofs, chain.spherical ? 3 : 6, out);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec6& v = out[i];
    wrenches[i] = {{v[0], v[1], v[2]}, length * Vec3{v[3], v[4], v[5]}};
  }
  return count;
}

}  // namespace amontons
