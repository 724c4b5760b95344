// D is the map from the velocities of the bodies w = (v, omega), at the centres of mass, to velocities of the
// rows. D' takes impulses of the rows to wrenches at the centres of mass. A row along e of a contact with
// arms r_a, r_b is
//  e . [ (v_A + omega_A x r_A) - (v_B + omega_B x r_B) ] = (e, r_A x e) . w_A - (e, r_B x e) . w_B,
// and that of a moment about e, in m/s by the length l, l e . (omega_A - omega_B). The world has zero
// velocity: actions on it are left out.
#include "amontons/problem/contact_system.hpp"

#include <algorithm>

#include "amontons/problem/contact_diagonal.hpp"
#include "amontons/problem/linkage.hpp"
#include "amontons/problem/threaded_product.hpp"

namespace amontons {

namespace {

double dot6(const std::array<double, 6>& j, const double* v) {
  return (j[0] * v[0] + j[2] * v[2] + j[4] * v[4]) + (j[1] * v[1] + j[3] * v[3] + j[5] * v[5]);
}

void axpy6(double x, const std::array<double, 6>& j, double* f) {
  for (int k = 0; k < 6; ++k) f[k] += x * j[k];
}

// The 6 n working velocities of a product. One array per thread, so that one operator serves concurrent
// solves; kept between calls, so that a product does not allocate.
std::vector<double>& body_scratch(std::size_t bodies) {
  static thread_local std::vector<double> scratch;
  scratch.assign(6 * bodies, 0.0);
  return scratch;
}

// On A with sign 1, on B with -1: D has opposite signs on its two bodies.
void add_wrench(double* w, const Vec3& force, const Vec3& moment, double sign) {
  for (int k = 0; k < 3; ++k) {
    w[k] += sign * force[k];
    w[3 + k] += sign * moment[k];
  }
}

Vec3 vec3(const double* v) { return {v[0], v[1], v[2]}; }

// (v_A + omega_A x r_A) - (v_B + omega_B x r_B) at the contact, and omega_A - omega_B if it has rows for
// moments: D w as world vectors, which to_rows() converts to rows.
ContactImpulse relative_motion(const ContactGeometry& c, const double* w) {
  ContactImpulse u;
  const auto add = [&](Index body, const Vec3& r, double sign) {
    if (body < 0) return;
    const Vec3 spin = vec3(w + 6 * body + 3);
    u.linear += sign * (vec3(w + 6 * body) + cross(spin, r));
    if (c.rows > 3) u.angular += sign * spin;
  };
  add(c.body_a, c.r_a, 1);
  add(c.body_b, c.r_b, -1);
  return u;
}

// j M^-1 j' for a row j of D: an entry of the diagonal of A without E.
double effective_inverse_mass(const Bodies& bodies, const JacobianRow& row) {
  double sum = 0;
  const auto add = [&](Index body, const std::array<double, 6>& j) {
    if (body < 0) return;
    double v[6];
    bodies.apply(body, j.data(), v);
    sum += dot6(j, v);
  };
  add(row.body_a, row.a);
  add(row.body_b, row.b);
  return sum;
}

// The same for a force along e at the arms of a contact: 1/m + (r x e)' I^-1 (r x e) for each body.
double effective_inverse_mass(const Bodies& bodies, const ContactGeometry& c, const Vec3& e) {
  double sum = 0;
  const auto add = [&](Index body, const Vec3& r) {
    if (body < 0) return;
    const auto& [xx, yy, zz, xy, xz, yz] = bodies.inverse_inertia[body];
    const Vec3 t = cross(r, e);
    sum += bodies.inverse_mass[body] + (xx * t.x * t.x + yy * t.y * t.y + zz * t.z * t.z) +
           2 * (xy * t.x * t.y + xz * t.x * t.z + yz * t.y * t.z);
  };
  add(c.body_a, c.r_a);
  add(c.body_b, c.r_b);
  return sum;
}

}  // namespace

void ContactBasis::turn_to(const Vec3& direction) {
  const Vec3 along = direction - dot(direction, normal) * normal;
  const double size = norm(along);
  if (!(size > 1e-9 * norm(direction))) return;
  tangent_1 = along / size;
  tangent_2 = cross(normal, tangent_1);
}

bool Bodies::moves(Index body) const {
  if (body < 0) return false;
  const auto& inertia = inverse_inertia[body];
  return inverse_mass[body] != 0 ||
         std::any_of(inertia.begin(), inertia.end(), [](double v) { return v != 0; });
}

void Bodies::apply(std::size_t body, const double* f, double* v) const {
  const double w = inverse_mass[body];
  // v = f / m, omega = I^-1 tau with the symmetric I^-1.
  const auto& [xx, yy, zz, xy, xz, yz] = inverse_inertia[body];
  const double tx = f[3], ty = f[4], tz = f[5];
  for (int k = 0; k < 3; ++k) v[k] = w * f[k];
  v[3] = xx * tx + xy * ty + xz * tz;
  v[4] = xy * tx + yy * ty + yz * tz;
  v[5] = xz * tx + yz * ty + zz * tz;
}

// A unit impulse along e at r is the wrench (e, r x e) on A, its opposite on B. A unit of a moment row is the
// torque moment_length e.
JacobianRow jacobian_row(const ContactGeometry& c, const ContactBasis& basis, int k) {
  const ContactRow row = contact_row(c.rows, k);
  const Vec3& e = basis.axis(row.axis);
  if (row.moment) {
    const Vec3 t = c.moment_length * e;
    return {c.body_a, c.body_b, {0, 0, 0, t.x, t.y, t.z}, {0, 0, 0, -t.x, -t.y, -t.z}};
  }
  const Vec3 ma = cross(c.r_a, e), mb = cross(c.r_b, e);
  return {c.body_a, c.body_b, {e.x, e.y, e.z, ma.x, ma.y, ma.z}, {-e.x, -e.y, -e.z, -mb.x, -mb.y, -mb.z}};
}

// Contacts may have different numbers of rows, so loops over them keep a running row.
std::size_t ContactSystem::contact_rows() const {
  std::size_t sum = 0;
  for (const ContactGeometry& c : contacts) sum += static_cast<std::size_t>(c.rows);
  return sum;
}

// w += D'x of the stored rows, whose impulses begin at x[row].
static void add_row_impulses(const ContactSystem& A, std::span<const double> x, std::size_t row,
                             std::span<double> w) {
  // Rows of a joint are adjacent: their sum stays in registers.
  for (std::size_t i = 0; i < A.jacobian.size();) {
    const Index a = A.jacobian[i].body_a, b = A.jacobian[i].body_b;
    std::array<double, 6> on_a{}, on_b{};
    for (; i < A.jacobian.size() && A.jacobian[i].body_a == a && A.jacobian[i].body_b == b; ++i, ++row) {
      axpy6(x[row], A.jacobian[i].a, on_a.data());
      axpy6(x[row], A.jacobian[i].b, on_b.data());
    }
    if (a >= 0) axpy6(1, on_a, &w[6 * a]);
    if (b >= 0) axpy6(1, on_b, &w[6 * b]);
  }
}

// Contact impulses are converted to world vectors first: one wrench per body for any number of rows.
void add_impulses(const ContactSystem& A, std::span<const double> x, std::span<double> w) {
  std::size_t row = 0;
  for (const ContactGeometry& c : A.contacts) {
    const ContactImpulse f = to_world(c, &x[row]);
    row += static_cast<std::size_t>(c.rows);
    if (c.body_a >= 0) add_wrench(&w[6 * c.body_a], f.linear, cross(c.r_a, f.linear) + f.angular, 1);
    if (c.body_b >= 0) add_wrench(&w[6 * c.body_b], f.linear, cross(c.r_b, f.linear) + f.angular, -1);
  }
  add_row_impulses(A, x, row, w);
}

// w = M^-1 w for free bodies; constrained bodies move as their joints allow. Those of a linkage are left out
// of the loop over free bodies, because their velocities are known already. Other maps do not say which
// bodies they move until they are called.
void apply_masses(const ContactSystem& A, std::span<double> w, const double* rates, const Subset& visited) {
  static thread_local std::vector<double> held;
  if (A.constrained && rates) {
    held.resize(6 * A.constrained->body.size());
    A.constrained->linkage->spread(rates, held.data());
  } else if (A.constrained) {
    held.clear();
    for (Index i : A.constrained->body) held.insert(held.end(), &w[6 * i], &w[6 * i] + 6);
    A.constrained->apply(held.data());
  }
  const Linkage* trees = linkage_of(A);
  visited.each(A.bodies.size(), [&](std::size_t i) {
    if (trees && trees->number_of(static_cast<Index>(i)) >= 0) return;
    double v[6];
    A.bodies.apply(i, &w[6 * i], v);
    std::copy(v, v + 6, &w[6 * i]);
  });
  if (!A.constrained) return;
  for (std::size_t i = 0; i < A.constrained->body.size(); ++i)
    std::copy_n(&held[6 * i], 6, &w[6 * A.constrained->body[i]]);
}

// y = Y (Y'x) + E x: a few numbers per row, and no sweep over bodies.
static void multiply_halves(const ContactSystem& A, std::span<const double> x, std::span<double> y) {
  static thread_local std::vector<double> z;
  z.assign(A.constrained->linkage->coordinates(), 0.0);
  const auto& [first, coordinate, value, whole] = A.half;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t k = first[i]; k < first[i + 1]; ++k) z[coordinate[k]] += value[k] * x[i];
  const auto set_row = [&](std::size_t i, double compliance) {
    double u = compliance * x[i];
    for (std::size_t k = first[i]; k < first[i + 1]; ++k) u += value[k] * z[coordinate[k]];
    y[i] = u;
  };
  std::size_t row = 0;
  for (std::size_t i = 0; i < A.contacts.size(); ++i)
    for (int k = 0; k < A.contacts[i].rows; ++k) set_row(row++, A.contact_compliance[i]);
  for (const double E : A.compliance) set_row(row++, E);
}

// y = D w + E x of one contact, whose rows begin at `row`, and of the stored rows.
static void set_contact_rows(const ContactSystem& A, std::size_t i, std::size_t row,
                             const std::vector<double>& w, std::span<const double> x, std::span<double> y) {
  const ContactGeometry& c = A.contacts[i];
  const ContactImpulse u = relative_motion(c, w.data());
  // A moment row is l omega, a velocity in m/s.
  to_rows(c, u.linear, u.angular, c.moment_length, &y[row]);
  for (int k = 0; k < c.rows; ++k) y[row + k] += A.contact_compliance[i] * x[row + k];
}

static void set_stored_rows(const ContactSystem& A, std::size_t row, const std::vector<double>& w,
                            std::span<const double> x, std::span<double> y) {
  for (std::size_t i = 0; i < A.jacobian.size(); ++i, ++row) {
    const JacobianRow& j = A.jacobian[i];
    double u = A.compliance[i] * x[row];
    if (j.body_a >= 0) u += dot6(j.a, &w[6 * j.body_a]);
    if (j.body_b >= 0) u += dot6(j.b, &w[6 * j.body_b]);
    y[row] = u;
  }
}

// y = D M^-1 D'x + E x in three sweeps:
//  1. over contacts and rows   w = D'x, the impulses at the centres of mass
//  2. over bodies              w = M^-1 w, their velocities
//  3. over contacts and rows   y = D w + E x, back to the rows
// A few dozen operations per row, and no memory but w.
void ContactSystem::product(std::span<const double> x, std::span<double> y) const {
  if (half.whole) return multiply_halves(*this, x, y);
  std::vector<double>& w = body_scratch(bodies.size());
  add_impulses(*this, x, w);
  apply_masses(*this, w);
  std::size_t row = 0;
  for (std::size_t i = 0; i < contacts.size(); row += static_cast<std::size_t>(contacts[i++].rows))
    set_contact_rows(*this, i, row, w, x, y);
  set_stored_rows(*this, row, w, x, y);
}

// The same sweeps by threads, where contacts have three rows and bodies are free. Impulses at the contacts
// are formed in parts. Then each thread owns a range of bodies and adds up theirs. The order is that of the
// contacts, so that each sum has the terms and the order of a sweep by one thread.
static void product_by_threads(const ContactSystem& A, std::span<const double> x, std::span<double> y,
                               ThreadPool& pool) {
  struct Impulse {
    Index a, b;
    Vec3 force, on_a, on_b;
  };
  static thread_local std::vector<Impulse> memory;
  std::vector<Impulse>& impulses = memory;
  const std::size_t n = A.contacts.size(), bodies = A.bodies.size();
  impulses.resize(n);
  std::vector<double>& w = body_scratch(bodies);
  const auto in_parts = [&](std::size_t count, const auto& f) {
    pool.run((count + pass_size - 1) / pass_size, [&](std::size_t part) {
      const std::size_t end = std::min(count, (part + 1) * pass_size);
      for (std::size_t i = part * pass_size; i < end; ++i) f(i);
    });
  };
  in_parts(n, [&](std::size_t i) {
    const ContactGeometry& c = A.contacts[i];
    const ContactImpulse f = to_world(c, &x[3 * i]);
    impulses[i] = {c.body_a, c.body_b, f.linear, cross(c.r_a, f.linear) + f.angular,
                   cross(c.r_b, f.linear) + f.angular};
  });
  const std::size_t owners = std::min<std::size_t>(pool.threads(), bodies);
  pool.run(owners, [&](std::size_t owner) {
    const auto low = static_cast<Index>(owner * bodies / owners);
    const auto high = static_cast<Index>((owner + 1) * bodies / owners);
    for (const Impulse& f : impulses) {
      if (f.a >= low && f.a < high) add_wrench(&w[6 * f.a], f.force, f.on_a, 1);
      if (f.b >= low && f.b < high) add_wrench(&w[6 * f.b], f.force, f.on_b, -1);
    }
  });
  add_row_impulses(A, x, 3 * n, w);
  in_parts(bodies, [&](std::size_t i) {
    double v[6];
    A.bodies.apply(i, &w[6 * i], v);
    std::copy(v, v + 6, &w[6 * i]);
  });
  in_parts(n, [&](std::size_t i) { set_contact_rows(A, i, 3 * i, w, x, y); });
  set_stored_rows(A, 3 * n, w, x, y);
}

void product(const ContactSystem& A, std::span<const double> x, std::span<double> y, unsigned threads) {
  const std::size_t n = A.contacts.size();
  const unsigned used = automatic_threads(threads, n / pass_size);
  // No contact has fewer than three rows.
  if (used <= 1 || A.constrained || x.size() != 3 * n + A.jacobian.size()) return A.product(x, y);
  PoolLease pool(used);
  product_by_threads(A, x, y, *pool);
}

namespace {

// diag(A) from the rows of D M^-1/2 on trees and the parts of free bodies. A light link that carries heavy
// ones counts with the mass that an impulse on it feels, not with its own. If the rows move bodies of trees
// alone, the second part is zero, and no row of D is formed for it.
void diagonal_of_trees(const ContactSystem& A, const Linkage& trees, std::span<double> d) {
  std::size_t row = 0;
  const auto of_free_bodies = [&](const JacobianRow& j) {
    return effective_inverse_mass(A.bodies, trees.without_trees(j));
  };
  const auto add = [&](double sum) {
    for (std::size_t k = A.half.first[row]; k < A.half.first[row + 1]; ++k)
      sum += A.half.value[k] * A.half.value[k];
    d[row++] = sum;
  };
  for (std::size_t i = 0; i < A.contacts.size(); ++i) {
    const ContactBasis basis(A.contacts[i]);
    for (int k = 0; k < A.contacts[i].rows; ++k)
      add(A.contact_compliance[i] +
          (A.half.whole ? 0 : of_free_bodies(jacobian_row(A.contacts[i], basis, k))));
  }
  for (std::size_t i = 0; i < A.jacobian.size(); ++i)
    add(A.compliance[i] + (A.half.whole ? 0 : of_free_bodies(A.jacobian[i])));
}

// The half rows of rows of D on the same bodies, or along one coordinate.
void append_halves(const Linkage& trees, std::span<const JacobianRow> rows, HalfRows& half) {
  const std::size_t first = half.coordinate.size();
  const Linkage::Paths paths = trees.append_paths(rows[0], half.coordinate);
  half.coordinate.resize(first + rows.size() * paths.size());
  half.value.resize(half.coordinate.size());
  const Index* coordinate = half.coordinate.data() + first;
  std::size_t at = first;
  for (const JacobianRow& row : rows) {
    if (at > first) std::copy_n(coordinate, paths.size(), half.coordinate.data() + at);
    trees.half_solve(row, paths, coordinate, half.value.data() + at);
    half.first.push_back(at += paths.size());
  }
}

}  // namespace

// Made with the problem, because P and the matrix of an island both need these rows. Rows on the same bodies
// go the same paths to the root: they are made together.
void ContactSystem::renew() {
  half.first.clear();
  half.coordinate.clear();
  half.value.clear();
  half.whole = false;
  if (!constrained || !constrained->linkage) return;
  const Linkage& trees = *constrained->linkage;
  half.first.push_back(0);
  for (const ContactGeometry& c : contacts) {
    const ContactBasis basis(c);
    std::array<JacobianRow, 6> of_contact;
    for (int k = 0; k < c.rows; ++k) of_contact[static_cast<std::size_t>(k)] = jacobian_row(c, basis, k);
    append_halves(trees, std::span(of_contact).first(static_cast<std::size_t>(c.rows)), half);
  }
  for (std::size_t i = 0, end = 0; i < jacobian.size(); i = end) {
    const auto same_paths = [&](const JacobianRow& row) {
      return row.coordinate == jacobian[i].coordinate && row.body_a == jacobian[i].body_a &&
             row.body_b == jacobian[i].body_b;
    };
    while (end < jacobian.size() && same_paths(jacobian[end])) ++end;
    append_halves(trees, std::span(jacobian).subspan(i, end - i), half);
  }
  const auto of_trees = [&](Index body) { return trees.number_of(body) >= 0 || !bodies.moves(body); };
  const auto reaches_trees = [&](const auto& row) { return of_trees(row.body_a) && of_trees(row.body_b); };
  half.whole = std::all_of(contacts.begin(), contacts.end(), reaches_trees) &&
               std::all_of(jacobian.begin(), jacobian.end(), reaches_trees);
}

void contact_diagonal(const ContactSystem& A, std::size_t contact, double* d) {
  const ContactGeometry& c = A.contacts[contact];
  const ContactBasis basis(c);
  for (int k = 0; k < c.rows; ++k)
    d[k] =
        A.contact_compliance[contact] + (k < 3 ? effective_inverse_mass(A.bodies, c, basis.axis(k))
                                               : effective_inverse_mass(A.bodies, jacobian_row(c, basis, k)));
}

// The sum over three orthogonal axes e of e . e / m + (r x e)' I^-1 (r x e) is 3 / m + tr(I^-1) |r|^2 - r'
// I^-1 r, whatever the axes.
double mean_diagonal(const ContactSystem& A, std::size_t contact) {
  const ContactGeometry& c = A.contacts[contact];
  double sum = 0;
  if (c.rows == 3) {
    const auto add = [&](Index body, const Vec3& r) {
      if (body < 0) return;
      const auto& [xx, yy, zz, xy, xz, yz] = A.bodies.inverse_inertia[body];
      const double x = r.x * r.x, y = r.y * r.y, z = r.z * r.z;
      sum += 3 * A.bodies.inverse_mass[body] + (xx * (y + z) + yy * (x + z) + zz * (x + y)) -
             2 * (xy * r.x * r.y + xz * r.x * r.z + yz * r.y * r.z);
    };
    add(c.body_a, c.r_a);
    add(c.body_b, c.r_b);
    return A.contact_compliance[contact] + sum / 3;
  }
  double d[6];
  contact_diagonal(A, contact, d);
  for (int k = 0; k < c.rows; ++k) sum += d[k];
  return sum / c.rows;
}

// diag(A)_i = E_i + j_i M^-1 j_i', row by row: the relative speed of the two bodies along the row per unit
// impulse along it.
void ContactSystem::diagonal(std::span<double> d) const {
  if (const Linkage* trees = linkage_of(*this)) return diagonal_of_trees(*this, *trees, d);
  std::size_t row = 0;
  for (std::size_t i = 0; i < contacts.size(); row += static_cast<std::size_t>(contacts[i++].rows))
    contact_diagonal(*this, i, &d[row]);
  row_diagonal(*this, d.subspan(row));
}

void row_diagonal(const ContactSystem& A, std::span<double> d) {
  for (std::size_t i = 0; i < A.jacobian.size(); ++i)
    d[i] = A.compliance[i] + effective_inverse_mass(A.bodies, A.jacobian[i]);
}

// Rows keep their order, so that x, b and K serve both.
ContactSystem ContactSystem::stored() const {
  ContactSystem op;
  op.bodies = bodies;
  op.constrained = constrained;
  op.half = half;
  op.jacobian.reserve(rows());
  op.compliance.reserve(rows());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactBasis basis(contacts[i]);
    for (int k = 0; k < contacts[i].rows; ++k) {
      op.jacobian.push_back(jacobian_row(contacts[i], basis, k));
      op.compliance.push_back(contact_compliance[i]);
    }
  }
  op.jacobian.insert(op.jacobian.end(), jacobian.begin(), jacobian.end());
  op.compliance.insert(op.compliance.end(), compliance.begin(), compliance.end());
  return op;
}

}  // namespace amontons
