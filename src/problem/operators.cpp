#include "amontons/problem/operators.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

void SparseOperator::product(std::span<const double> x, std::span<double> y) const {
  const std::size_t m = rows();
  for (std::size_t i = 0; i < m; ++i) {
    double sum = 0;
    for (Index k = indptr[i]; k < indptr[i + 1]; ++k) sum += data[k] * x[indices[k]];
    y[i] = sum;
  }
}

void SparseOperator::diagonal(std::span<double> d) const {
  for (std::size_t i = 0; i < rows(); ++i) {
    d[i] = 0;
    for (Index k = indptr[i]; k < indptr[i + 1]; ++k)
      if (static_cast<std::size_t>(indices[k]) == i) d[i] += data[k];
  }
}

void DenseOperator::product(std::span<const double> x, std::span<double> y) const {
  // Column sweeps: A is symmetric, so row j is column j, and y += x_j A_j vectorises without reordering a
  // sum.
  std::fill(y.begin(), y.end(), 0.0);
  for (std::size_t j = 0; j < m; ++j) {
    const double* column = data.data() + j * m;
    const double xj = x[j];
    for (std::size_t i = 0; i < m; ++i) y[i] += xj * column[i];
  }
}

void DenseOperator::diagonal(std::span<double> d) const {
  for (std::size_t i = 0; i < m; ++i) d[i] = data[i * m + i];
}

void CallbackOperator::diagonal(std::span<double> d) const { std::copy(diag.begin(), diag.end(), d.begin()); }

void InverseMass::apply(std::size_t body, const double* f, double* v) const {
  const double w = translation[body];
  const auto& [xx, yy, zz, xy, xz, yz] = inertia[body];
  const double tx = f[3], ty = f[4], tz = f[5];
  v[0] = w * f[0], v[1] = w * f[1], v[2] = w * f[2];
  v[3] = xx * tx + xy * ty + xz * tz;
  v[4] = xy * tx + yy * ty + yz * tz;
  v[5] = xz * tx + yz * ty + zz * tz;
}

namespace {

double dot6(const std::array<double, 6>& j, const double* v) {
  return j[0] * v[0] + j[1] * v[1] + j[2] * v[2] + j[3] * v[3] + j[4] * v[4] + j[5] * v[5];
}

void axpy6(double x, const std::array<double, 6>& j, double* f) {
  for (int k = 0; k < 6; ++k) f[k] += x * j[k];
}

// The 6 n working velocities of a product: per thread, so that one operator serves concurrent solves, and
// kept between calls, so that a product does not allocate.
std::vector<double>& body_scratch(std::size_t bodies) {
  static thread_local std::vector<double> scratch;
  scratch.assign(6 * bodies, 0.0);
  return scratch;
}

void apply_in_place(const InverseMass& mass, std::vector<double>& body_vector) {
  for (std::size_t i = 0; i < mass.bodies(); ++i) {
    double v[6];
    mass.apply(i, &body_vector[6 * i], v);
    std::copy(v, v + 6, &body_vector[6 * i]);
  }
}

void scatter(const std::vector<JacobianRow>& rows, std::span<const double> x, std::vector<double>& f) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].body_a >= 0) axpy6(x[i], rows[i].a, &f[6 * rows[i].body_a]);
    if (rows[i].body_b >= 0) axpy6(x[i], rows[i].b, &f[6 * rows[i].body_b]);
  }
}

void gather(const std::vector<JacobianRow>& rows, const std::vector<double>& v,
            const std::vector<double>& compliance, std::span<const double> x, std::span<double> y) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    double u = compliance[i] * x[i];
    if (rows[i].body_a >= 0) u += dot6(rows[i].a, &v[6 * rows[i].body_a]);
    if (rows[i].body_b >= 0) u += dot6(rows[i].b, &v[6 * rows[i].body_b]);
    y[i] = u;
  }
}

std::array<double, 3> cross(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// A unit impulse along e at r: the wrench (e, r x e) on body A, its opposite on body B.
JacobianRow contact_row(const ContactFrame& c, const std::array<double, 3>& e) {
  const auto ma = cross(c.r_a, e), mb = cross(c.r_b, e);
  return {c.body_a,
          c.body_b,
          {e[0], e[1], e[2], ma[0], ma[1], ma[2]},
          {-e[0], -e[1], -e[2], -mb[0], -mb[1], -mb[2]}};
}

std::array<JacobianRow, 3> contact_rows(const ContactFrame& c) {
  std::array<double, 3> t1, t2;
  contact_tangents(c.normal, t1, t2);
  return {contact_row(c, c.normal), contact_row(c, t1), contact_row(c, t2)};
}

}  // namespace

void BodyOperator::product(std::span<const double> x, std::span<double> y) const {
  std::vector<double>& w = body_scratch(inverse_mass.bodies());
  scatter(jacobian, x, w);
  apply_in_place(inverse_mass, w);
  gather(jacobian, w, compliance, x, y);
}

void BodyOperator::diagonal(std::span<double> d) const {
  double v[6];
  for (std::size_t i = 0; i < rows(); ++i) {
    d[i] = compliance[i];
    if (jacobian[i].body_a >= 0) {
      inverse_mass.apply(jacobian[i].body_a, jacobian[i].a.data(), v);
      d[i] += dot6(jacobian[i].a, v);
    }
    if (jacobian[i].body_b >= 0) {
      inverse_mass.apply(jacobian[i].body_b, jacobian[i].b.data(), v);
      d[i] += dot6(jacobian[i].b, v);
    }
  }
}

void contact_tangents(const std::array<double, 3>& n, std::array<double, 3>& t1, std::array<double, 3>& t2) {
  const double sign = std::copysign(1.0, n[2]);
  const double a = -1.0 / (sign + n[2]);
  const double b = n[0] * n[1] * a;
  t1 = {1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
  t2 = {b, sign + n[1] * n[1] * a, -n[1]};
}

void ContactOperator::product(std::span<const double> x, std::span<double> y) const {
  std::vector<double>& w = body_scratch(joints.inverse_mass.bodies());
  using V3 = std::array<double, 3>;
  V3 t1, t2;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const ContactFrame& contact = contacts[c];
    contact_tangents(contact.normal, t1, t2);
    V3 force;
    for (int k = 0; k < 3; ++k)
      force[k] = contact.normal[k] * x[3 * c] + t1[k] * x[3 * c + 1] + t2[k] * x[3 * c + 2];
    const auto add = [&](Index body, const V3& r, double sign) {
      if (body < 0) return;
      const V3 moment = cross(r, force);
      for (int k = 0; k < 3; ++k) w[6 * body + k] += sign * force[k], w[6 * body + 3 + k] += sign * moment[k];
    };
    add(contact.body_a, contact.r_a, 1);
    add(contact.body_b, contact.r_b, -1);
  }
  const std::size_t first_joint = 3 * contacts.size();
  scatter(joints.jacobian, x.subspan(first_joint), w);
  apply_in_place(joints.inverse_mass, w);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const ContactFrame& contact = contacts[c];
    contact_tangents(contact.normal, t1, t2);
    V3 velocity{};  // of A relative to B at the contact point, v + omega x r
    const auto add = [&](Index body, const V3& r, double sign) {
      if (body < 0) return;
      const V3 spin = cross({w[6 * body + 3], w[6 * body + 4], w[6 * body + 5]}, r);
      for (int k = 0; k < 3; ++k) velocity[k] += sign * (w[6 * body + k] + spin[k]);
    };
    add(contact.body_a, contact.r_a, 1);
    add(contact.body_b, contact.r_b, -1);
    const V3* axes[] = {&contact.normal, &t1, &t2};
    for (int i = 0; i < 3; ++i) {
      double u = contact_compliance[c] * x[3 * c + i];
      for (int k = 0; k < 3; ++k) u += (*axes[i])[k] * velocity[k];
      y[3 * c + i] = u;
    }
  }
  gather(joints.jacobian, w, joints.compliance, x.subspan(first_joint), y.subspan(first_joint));
}

void ContactOperator::diagonal(std::span<double> d) const { stored().diagonal(d); }

BodyOperator ContactOperator::stored() const {
  BodyOperator op;
  op.inverse_mass = joints.inverse_mass;
  op.jacobian.reserve(rows());
  op.compliance.reserve(rows());
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (const JacobianRow& row : contact_rows(contacts[c])) {
      op.jacobian.push_back(row);
      op.compliance.push_back(contact_compliance[c]);
    }
  op.jacobian.insert(op.jacobian.end(), joints.jacobian.begin(), joints.jacobian.end());
  op.compliance.insert(op.compliance.end(), joints.compliance.begin(), joints.compliance.end());
  return op;
}

}  // namespace amontons
