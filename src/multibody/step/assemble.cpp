// The one place where bodies become a variational inequality (DESIGN: Anitescu-Tasora time stepping).
//   x: impulses; v+ = v_free + M^-1 D'x; u = D v+ + E x + c, b = D v_free + c.
#include <algorithm>

#include "multibody/bodies/row_products.hpp"
#include "multibody/step/step.hpp"

namespace amontons {

namespace {

InverseMass inverse_mass_of(const std::vector<BodyMobility>& bodies, const std::vector<double>& auxiliary) {
  InverseMass mass;
  mass.translation.reserve(bodies.size() + auxiliary.size());
  mass.inertia.reserve(bodies.size() + auxiliary.size());
  for (const BodyMobility& body : bodies) {
    const Mat3& J = body.inverse_inertia;
    mass.translation.push_back(body.inverse_mass);
    mass.inertia.push_back({J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2)});
  }
  for (double w : auxiliary) {
    mass.translation.push_back(w);
    mass.inertia.push_back({w, w, w, 0, 0, 0});
  }
  return mass;
}

// The stabilisation of a contact: a gap may close within the step, a penetration is taken back at no more
// than recovery_speed. A compliant contact is a spring, x_n = -(gap + h u_n) / (h compliance / h^2), of which
// nothing may be cut off. An impact closes no gap: u_n^+ = -e u_n^-.
double contact_bias(const ContactSite& site, double approach, const Assembly& options) {
  if (options.impact) return site.material.restitution * std::min(approach, 0.0);
  const double rate = site.gap / options.h;
  return site.material.compliance > 0 ? rate : std::max(rate, -options.recovery_speed);
}

}  // namespace

Problem assemble(const Model& model, const std::vector<BodyMobility>& mobility,
                 const std::vector<BodyVelocity>& free, const std::vector<ContactSite>& sites,
                 const JointRows& rows, const Assembly& options) {
  ContactOperator A;
  SetProduct K;
  std::vector<double> b, mu;
  const std::size_t m = 3 * sites.size() + rows.jacobian.size();
  A.contacts.reserve(sites.size()), A.contact_compliance.reserve(sites.size());
  b.reserve(m), mu.reserve(sites.size());
  const Index n = static_cast<Index>(model.bodies());
  for (const ContactSite& site : sites) {
    // Bodies that impulses do not move are the world: their velocity is part of b.
    const Index body_b = model.is_dynamic(site.body_b) ? site.body_b : world;
    A.contacts.push_back({site.body_a, body_b, site.r_a.array(), site.r_b.array(), site.normal.array()});
    A.contact_compliance.push_back(site.material.compliance / (options.h * options.h));
    mu.push_back(site.material.friction);
    const Vec3 u = relative_velocity(site, free);
    std::array<double, 3> t1, t2;
    contact_tangents(site.normal.array(), t1, t2);
    const double approach = dot(site.normal, u);
    b.push_back(approach + contact_bias(site, approach, options));
    b.push_back(dot(to_vec3(t1), u));
    b.push_back(dot(to_vec3(t2), u));
  }
  K.add_friction(mu);
  for (std::size_t i = 0; i < rows.jacobian.size(); ++i) {
    const JacobianRow& row = rows.jacobian[i];
    double u = rows.c[i];
    if (row.body_a >= 0 && row.body_a < n) u += power(row.a, free[row.body_a]);
    if (row.body_b >= 0 && row.body_b < n) u += power(row.b, free[row.body_b]);
    b.push_back(u);
  }
  for (const SetRun& run : rows.cones.runs()) {
    if (run.kind == SetKind::free) K.add_free(run.count);
    if (run.kind == SetKind::nonnegative) K.add_nonnegative(run.count);
    if (run.kind == SetKind::interval)
      K.add_interval({rows.cones.lo().data() + run.param, run.count},
                     {rows.cones.hi().data() + run.param, run.count});
  }
  A.joints.inverse_mass = inverse_mass_of(mobility, rows.auxiliary_inverse_mass);
  A.joints.jacobian = rows.jacobian;
  A.joints.compliance = rows.compliance;
  return make_problem(std::move(A), std::move(b), std::move(K));
}

void apply_impulses(const Problem& problem, std::span<const double> x, std::vector<BodyVelocity>& v) {
  const auto& A = std::get<ContactOperator>(problem.A);
  std::vector<std::array<double, 6>> wrench(A.joints.inverse_mass.bodies(), std::array<double, 6>{});
  const auto add = [&](Index body, const Vec3& force, const Vec3& torque, double sign) {
    if (body < 0) return;
    for (int k = 0; k < 3; ++k) wrench[body][k] += sign * force[k], wrench[body][3 + k] += sign * torque[k];
  };
  for (std::size_t i = 0; i < A.contacts.size(); ++i) {
    const ContactFrame& contact = A.contacts[i];
    std::array<double, 3> t1, t2;
    contact_tangents(contact.normal, t1, t2);
    const Vec3 force =
        x[3 * i] * to_vec3(contact.normal) + x[3 * i + 1] * to_vec3(t1) + x[3 * i + 2] * to_vec3(t2);
    add(contact.body_a, force, cross(to_vec3(contact.r_a), force), 1);
    add(contact.body_b, force, cross(to_vec3(contact.r_b), force), -1);
  }
  for (std::size_t i = 0; i < A.joints.jacobian.size(); ++i) {
    const JacobianRow& row = A.joints.jacobian[i];
    const double value = x[3 * A.contacts.size() + i];
    if (row.body_a >= 0)
      for (int k = 0; k < 6; ++k) wrench[row.body_a][k] += value * row.a[k];
    if (row.body_b >= 0)
      for (int k = 0; k < 6; ++k) wrench[row.body_b][k] += value * row.b[k];
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    double change[6];
    A.joints.inverse_mass.apply(i, wrench[i].data(), change);
    v[i].linear += Vec3{change[0], change[1], change[2]};
    v[i].angular += Vec3{change[3], change[4], change[5]};
  }
}

}  // namespace amontons
