#include "multibody/joints/joint_kinematics.hpp"

#include <algorithm>
#include <cmath>

#include "multibody/step/step.hpp"

namespace amontons {
namespace {

const Transform& body_pose(const std::vector<BodyFrame>& bodies, Index body) {
  static const Transform identity;
  return body < 0 ? identity : bodies[body].pose;
}

using Vec6 = std::array<double, 6>;

// In units in which a displacement by `length` counts as much as one radian.
Vec6 scaled(const Screw& s, double length) {
  return {s.linear.x / length, s.linear.y / length, s.linear.z / length,
          s.angular.x,         s.angular.y,         s.angular.z};
}

double dot(const Vec6& a, const Vec6& b) {
  double sum = 0;
  for (int i = 0; i < 6; ++i) sum += a[i] * b[i];
  return sum;
}

// N = L L' in place (lower triangle); false if a pivot is not positive.
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

// The factor of the Gram matrix of unit columns. Near a singular pose (gimbal lock) it is damped in
// proportion to the manipulability sqrt(det N), and only there: Nakamura and Hanafusa, "Inverse kinematic
// solutions with singularity robustness for robot manipulator control", J. Dyn. Sys. Meas. Control 108
// (1986).
void damped_factor(std::array<Vec6, 6>& n, std::size_t k) {
  constexpr double regular = 1e-3, largest_damping = 1e-6;
  const std::array<Vec6, 6> gram = n;
  double manipulability = 0;
  if (cholesky(n, k, 0)) {
    manipulability = 1;
    for (std::size_t i = 0; i < k; ++i) manipulability *= n[i][i];
  }
  if (manipulability >= regular) return;
  const double s = 1 - manipulability / regular;
  n = gram;
  cholesky(n, k, largest_damping * s * s + 1e-15);
}

// An orthonormal basis of the complement of k directions in space; always 3 - k of them (none for k > 3),
// also where the directions have become dependent.
std::size_t complement(const std::array<Vec3, 6>& directions, std::size_t k, std::array<Vec3, 3>& out) {
  if (k == 0) {
    out = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    return 3;
  }
  if (k > 2) return 0;
  std::array<double, 3> t1, t2;
  contact_tangents(normalised(directions[0]).array(), t1, t2);
  out[0] = to_vec3(t1), out[1] = to_vec3(t2);
  if (k == 1) return 2;
  const Vec3 normal = cross(directions[0], directions[1]);
  const double sine = norm(normal);
  if (sine > 1e-12) out[0] = normal / sine;
  return 1;
}

// Whether each screw is a pure translation or a pure rotation about the reference.
bool splits(const ChainKinematics& chain, double length, std::array<Vec3, 6>& slides, std::size_t& n_slides,
            std::array<Vec3, 6>& hinges, std::size_t& n_hinges) {
  constexpr double pure = 1e-12;
  n_slides = n_hinges = 0;
  for (std::size_t i = 0; i < chain.dofs; ++i) {
    const Screw& s = chain.screws[i];
    if (s.angular == Vec3{}) {
      slides[n_slides++] = s.linear;
    } else {
      if (norm(s.linear) > pure * length * norm(s.angular)) return false;
      hinges[n_hinges++] = s.angular;
    }
  }
  return n_slides <= 3 && n_hinges <= 3;
}

// Gram-Schmidt, twice for orthogonality to rounding; the norm that is left.
double orthogonalise(Vec6& v, const std::array<Vec6, 12>& basis, std::size_t n) {
  for (int pass = 0; pass < 2; ++pass)
    for (std::size_t i = 0; i < n; ++i) {
      const double s = dot(v, basis[i]);
      for (int c = 0; c < 6; ++c) v[c] -= s * basis[i][c];
    }
  return std::sqrt(dot(v, v));
}

// The complement of `count` columns in six dimensions, out of coordinate directions, the most independent
// first.
std::size_t complement6(const std::array<Vec6, 6>& columns, std::size_t count, std::size_t dimension,
                        std::array<Vec6, 6>& out) {
  constexpr double dependent = 1e-9;
  std::array<Vec6, 12> basis;
  std::size_t n = 0;
  const auto keep = [&](Vec6 v, double size) {
    for (double& c : v) c /= size;
    basis[n++] = v;
  };
  for (std::size_t i = 0; i < count; ++i) {
    Vec6 v = columns[i];
    const double before = std::sqrt(dot(v, v));
    const double left = orthogonalise(v, basis, n);
    if (left > dependent * before) keep(v, left);
  }
  const std::size_t wanted = dimension > count ? dimension - count : 0;
  for (std::size_t found = 0; found < wanted; ++found) {
    Vec6 best{};
    double best_size = 0;
    for (std::size_t e = 0; e < dimension; ++e) {
      Vec6 v{};
      v[e] = 1;
      const double left = orthogonalise(v, basis, n);
      // A candidate must be clearly better, so that rounding does not choose between equal ones.
      if (left > best_size + 1e-6) best = v, best_size = left;
    }
    keep(best, best_size);
    out[found] = basis[n - 1];
  }
  return wanted;
}

}  // namespace

JointPose joint_pose(const Joint& joint, const std::vector<BodyFrame>& bodies) {
  JointPose pose;
  pose.a = body_pose(bodies, joint.body_a) * joint.frame_a;
  pose.b = body_pose(bodies, joint.body_b) * joint.frame_b;
  pose.relative = inverse(pose.b) * pose.a;
  return pose;
}

ChainKinematics chain_kinematics(const Joint& joint, const Transform& relative, std::span<const double> q) {
  ChainKinematics chain;
  chain.dofs = joint.dofs.size();
  chain.spherical = joint.spherical || joint.kind == JointKind::distance;
  std::array<Vec3, 6> points;
  bool has_hinge = false;
  Vec3 last_anchor;
  Transform t;
  for (std::size_t i = 0; i < chain.dofs; ++i) {
    const Dof& dof = joint.dofs[i];
    const Vec3 axis = rotate(t.rotation, dof.axis);
    if (dof.kind == Dof::Kind::slide) {
      chain.screws[i] = {axis, {}};
      t.position += q[i] * axis;
    } else {
      points[i] = last_anchor = t(dof.anchor);
      has_hinge = true;
      chain.screws[i] = {{}, axis};
      const Quat rotation = exponential(q[i] * dof.axis);
      t = t * Transform{dof.anchor - rotate(rotation, dof.anchor), rotation};
    }
  }
  chain.target = t;
  chain.reference = has_hinge && !chain.spherical ? last_anchor : t.position;
  for (std::size_t i = 0; i < chain.dofs; ++i)
    if (joint.dofs[i].kind == Dof::Kind::hinge)
      chain.screws[i].linear = cross(chain.screws[i].angular, chain.reference - points[i]);
  const Quat rotation = relative.rotation * conjugate(t.rotation);
  // X T^-1 moves the reference by this; written as a difference of positions for the origin itself, where
  // nothing then cancels.
  const Vec3 lever = chain.reference - t.position;
  chain.error = {(relative.position - t.position) + (rotate(rotation, lever) - lever), logarithm(rotation)};
  return chain;
}

std::array<Screw, 6> dual_wrenches(const ChainKinematics& chain, double length) {
  std::array<Screw, 6> duals;
  const std::size_t k = chain.dofs;
  std::array<Vec6, 6> columns, n{};
  Vec6 unit{};  // scales of the columns
  for (std::size_t i = 0; i < k; ++i) {
    Screw s = chain.screws[i];
    if (chain.spherical) s.angular = {};
    columns[i] = scaled(s, length);
    const double size = std::sqrt(dot(columns[i], columns[i]));
    unit[i] = size > 0 ? 1 / size : 0;
    for (double& c : columns[i]) c *= unit[i];
    for (std::size_t j = 0; j <= i; ++j) n[i][j] = dot(columns[i], columns[j]);
    if (size == 0) n[i][i] = 1;
  }
  damped_factor(n, k);
  for (std::size_t i = 0; i < k; ++i) {
    Vec6 y{};  // column i of N^-1
    y[i] = 1;
    for (std::size_t r = 0; r < k; ++r) {
      for (std::size_t c = 0; c < r; ++c) y[r] -= n[r][c] * y[c];
      y[r] /= n[r][r];
    }
    for (std::size_t r = k; r-- > 0;) {
      for (std::size_t c = r + 1; c < k; ++c) y[r] -= n[c][r] * y[c];
      y[r] /= n[r][r];
    }
    Vec6 p{};
    for (std::size_t j = 0; j < k; ++j)
      for (int c = 0; c < 6; ++c) p[c] += unit[i] * y[j] * columns[j][c];
    duals[i] = {Vec3{p[0], p[1], p[2]} / length, {p[3], p[4], p[5]}};
  }
  return duals;
}

std::size_t locked_wrenches(const ChainKinematics& chain, double length, std::array<Screw, 6>& wrenches) {
  std::size_t count = 0;
  std::array<Vec3, 6> slides, hinges;
  std::size_t n_slides, n_hinges;
  if (splits(chain, length, slides, n_slides, hinges, n_hinges)) {
    std::array<Vec3, 3> basis;
    const std::size_t forces = complement(slides, n_slides, basis);
    for (std::size_t i = 0; i < forces; ++i) wrenches[count++] = {basis[i], {}};
    const std::size_t torques = chain.spherical ? 0 : complement(hinges, n_hinges, basis);
    for (std::size_t i = 0; i < torques; ++i) wrenches[count++] = {{}, length * basis[i]};
    return count;
  }
  std::array<Vec6, 6> columns, out;
  for (std::size_t i = 0; i < chain.dofs; ++i) columns[i] = scaled(chain.screws[i], length);
  if (chain.spherical)
    for (std::size_t i = 0; i < chain.dofs; ++i) columns[i][3] = columns[i][4] = columns[i][5] = 0;
  count = complement6(columns, chain.dofs, chain.spherical ? 3 : 6, out);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec6& v = out[i];
    wrenches[i] = {{v[0], v[1], v[2]}, length * Vec3{v[3], v[4], v[5]}};
  }
  return count;
}

bool is_chain(const Joint& joint) { return joint.kind == JointKind::chain || joint.upper_distance == 0; }

bool is_active(const Model& model, const Joint& joint) {
  return model.is_dynamic(joint.body_a) || model.is_dynamic(joint.body_b);
}

namespace {

// Everything of a context that follows from the pose of the joint and its coordinates.
void place(JointContext& ctx, const JointPose& pose, const Vec3& centre_a, const Vec3& centre_b,
           std::span<const double> q) {
  ctx.pose = pose;
  ctx.axes = to_matrix(pose.b.rotation);
  Vec3 point = pose.a.position;
  if (is_chain(*ctx.joint)) {
    ctx.chain = chain_kinematics(*ctx.joint, pose.relative, q);
    ctx.duals = dual_wrenches(ctx.chain, ctx.length);
    ctx.arm = (ctx.chain.reference + ctx.chain.error.linear) - pose.relative.position;
    if (!(ctx.chain.spherical))
      point += ctx.axes * ctx.arm;
    else
      ctx.arm = {};
  }
  if (ctx.body_a >= 0) ctx.r_a = point - centre_a;
  if (ctx.body_b >= 0) ctx.r_b = point - centre_b;
}

Vec3 centre_of(const std::vector<BodyFrame>& bodies, Index body) {
  return body >= 0 ? bodies[body].centre : Vec3{};
}

}  // namespace

JointContext joint_context(const Model& model, const std::vector<BodyFrame>& bodies, const State& state,
                           std::size_t j) {
  const auto moving = [&](Index body) {
    return body >= 0 && model.body(body).motion != Motion::fixed ? body : world;
  };
  JointContext ctx;
  ctx.joint = &model.joint(static_cast<Index>(j));
  ctx.index = static_cast<Index>(j);
  ctx.body_a = moving(ctx.joint->body_a);
  ctx.body_b = moving(ctx.joint->body_b);
  ctx.length = model.length();
  const std::span<const double> q(state.coordinates);
  place(ctx, joint_pose(*ctx.joint, bodies), centre_of(bodies, ctx.body_a), centre_of(bodies, ctx.body_b),
        q.subspan(model.first_dof(j), ctx.joint->dofs.size()));
  return ctx;
}

JacobianRow joint_row(const JointContext& ctx, const Screw& wrench) {
  const Vec3 f = ctx.axes * wrench.linear, t = ctx.axes * wrench.angular;
  JacobianRow row{ctx.body_a, ctx.body_b, {}, {}};
  if (ctx.body_a >= 0) {
    const Vec3 m = cross(ctx.r_a, f) + t;
    row.a = {f.x, f.y, f.z, m.x, m.y, m.z};
  }
  if (ctx.body_b >= 0) {
    const Vec3 m = cross(ctx.r_b, f) + t;
    row.b = {-f.x, -f.y, -f.z, -m.x, -m.y, -m.z};
  }
  return row;
}

JacobianRow operator*(double s, const JacobianRow& row) {
  JacobianRow out = row;
  for (double& c : out.a) c *= s;
  for (double& c : out.b) c *= s;
  return out;
}

namespace {

double side_inverse_mass(const std::vector<BodyFrame>& bodies, Index body, const Vec6& j) {
  if (body < 0) return 0;
  const BodyFrame& frame = bodies[body];
  const Vec3 f{j[0], j[1], j[2]}, t{j[3], j[4], j[5]};
  return frame.inverse_mass * dot(f, f) + dot(t, frame.inverse_inertia * t);
}

double side_velocity(const Vec6& j, const Vec3& v, const Vec3& w) {
  return j[0] * v.x + j[1] * v.y + j[2] * v.z + j[3] * w.x + j[4] * w.y + j[5] * w.z;
}

}  // namespace

double inverse_effective_mass(const std::vector<BodyFrame>& bodies, const JacobianRow& row) {
  return side_inverse_mass(bodies, row.body_a, row.a) + side_inverse_mass(bodies, row.body_b, row.b);
}

double start_velocity(const std::vector<BodyFrame>& bodies, const JacobianRow& row) {
  double u = 0;
  if (row.body_a >= 0) u += side_velocity(row.a, bodies[row.body_a].velocity, bodies[row.body_a].omega);
  if (row.body_b >= 0) u += side_velocity(row.b, bodies[row.body_b].velocity, bodies[row.body_b].omega);
  return u;
}

double free_velocity(const std::vector<BodyFrame>& bodies, const JacobianRow& row) {
  double u = 0;
  if (row.body_a >= 0)
    u += side_velocity(row.a, bodies[row.body_a].free_velocity, bodies[row.body_a].free_omega);
  if (row.body_b >= 0)
    u += side_velocity(row.b, bodies[row.body_b].free_velocity, bodies[row.body_b].free_omega);
  return u;
}

std::array<double, 6> rates_before(const JointContext& now, const std::vector<BodyFrame>& bodies,
                                   std::span<const double> q, double h) {
  struct Past {
    Transform pose;
    Vec3 centre, spin;
  };
  const auto past = [&](Index body) -> Past {
    if (body < 0) return {};
    const BodyFrame& frame = bodies[body];
    // The solve of a step knows the mean of the gyroscopic rotation; backwards in time it is this one.
    const Vec3 spin = -torque_free_mean(frame.inertia, -frame.omega, h);
    const Quat turn = exponential(-h * spin);
    const Vec3 centre = frame.centre - h * frame.velocity;
    return {{centre + rotate(turn, frame.pose.position - frame.centre), turn * frame.pose.rotation},
            centre,
            spin};
  };
  const Past a = past(now.joint->body_a), b = past(now.joint->body_b);
  std::array<double, 6> before{};
  for (std::size_t i = 0; i < now.chain.dofs; ++i)
    before[i] = q[i] - h * start_velocity(bodies, joint_row(now, now.duals[i]));
  JointContext ctx = now;
  JointPose pose{a.pose * now.joint->frame_a, b.pose * now.joint->frame_b, {}};
  pose.relative = inverse(pose.b) * pose.a;
  place(ctx, pose, a.centre, b.centre, std::span(before).first(now.chain.dofs));
  std::array<double, 6> rates{};
  for (std::size_t i = 0; i < now.chain.dofs; ++i) {
    const JacobianRow row = joint_row(ctx, ctx.duals[i]);
    if (row.body_a >= 0) rates[i] += side_velocity(row.a, bodies[row.body_a].velocity, a.spin);
    if (row.body_b >= 0) rates[i] += side_velocity(row.b, bodies[row.body_b].velocity, b.spin);
  }
  return rates;
}

}  // namespace amontons
