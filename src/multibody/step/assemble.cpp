// Anitescu-Tasora time stepping (Anitescu, Tasora 2010; Tasora, Anitescu 2011) with velocities v of the
// bodies and impulses x over the step h:
//
//   v+ = v_free + M^-1 D'x,   u = D v+ + E x + c,   x in K, -u in N_K(x).
//
// docs/algorithm.md (1, 5, 10). Substituting gives u = (D M^-1 D' + E) x + D v_free + c: A = D M^-1 D' + E
// and b = D v_free + c. The entry c of a row is the velocity that the constraint demands at the end of the
// step. gap / h lets an open contact close within the step and no faster (contacts act before they touch). A
// position error over h removes that error.
#include "multibody/step/assemble.hpp"

#include <algorithm>

#include "amontons/base/parts.hpp"
#include "amontons/problem/linkage.hpp"
#include "amontons/problem/threaded_product.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/joints/row_terms.hpp"

namespace amontons {

namespace {

// M^-1 as the problem stores it: first the bodies of the model, then the auxiliary bodies of couplings.
void fill(const StepBodies& step, const std::vector<double>& auxiliary, unsigned threads, Bodies& bodies) {
  const std::size_t n = step.mobility.size();
  bodies.inverse_mass.resize(n);
  bodies.inverse_inertia.resize(n);
  bodies.centre.resize(n);
  for_entries(threads, n, [&](std::size_t i) {
    const Mat3& J = step.mobility[i].inverse_inertia;
    bodies.inverse_mass[i] = step.mobility[i].inverse_mass;
    bodies.inverse_inertia[i] = {J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2)};
    bodies.centre[i] = step.frames[i].centre;
  });
  // Six numbers with one mass, for a coupling of many bodies; they have no position.
  for (double w : auxiliary) {
    bodies.inverse_mass.push_back(w);
    bodies.inverse_inertia.push_back({w, w, w, 0, 0, 0});
    bodies.centre.emplace_back();
  }
}

// A compliant contact is a spring of compliance e with a parallel damper tau / e, both implicit,
// docs/algorithm.md (7):
//
//   x_n = -k (gap + h u_n + tau u_n) / e,   that is   u_n + E x_n + gap / (h + tau) = 0,   E = e / (k (h +
//   tau)),
//
// with impulses over the kick k. While the gap is open the damper does nothing, and the spring acts only
// after it closes: x_n = -(h + tau) (gap / h + u_n) k / e, where the overlap at the end of the step counts
// for both.
//
// A bouncing contact follows its restitution and ignores its compliance.
double contact_compliance(const Material& m, const Assembly& options) {
  if (options.impact && m.restitution > 0) return 0;
  return m.compliance / (options.kick * (options.h + m.relaxation_time));
}

// Joints of trees cannot give way at all. Friction can lock a link between others that way: if its contacts
// overlap by rounding, no motion closes them, and impulses grow without bound. Rows of joints have the same
// compliance (row_terms).
double softness(const StepBodies& bodies, const Contact& c, const Model* model) {
  if (!bodies.trees || !model) return 0;
  const Linkage& trees = *bodies.trees->linkage;
  if (trees.number_of(c.body_a) < 0 && trees.number_of(c.body_b) < 0) return 0;
  double inverse_mass = 0;
  for (const Index i : {c.body_a, c.body_b})
    if (i >= 0) inverse_mass += bodies.mobility[i].inverse_mass;
  return base::policy.compliance * model->lightness(c.body_a, c.body_b) * inverse_mass;
}

// c_n of a contact, docs/algorithm.md (6). A gap may close within the step. A penetration is removed at no
// more than `recovery` (m/s). The force of a compliant contact is not limited. An impact closes no gap: u_n^+
// = -e u_n^-. Gaps and overlaps up to the slack count as zero. Bodies that rest on several others have more
// closed contacts than degrees of freedom. Gaps then differ by the errors of the last steps, and no velocity
// closes all of them; the choice of the contacts that carry would change with each such difference.
double contact_bias(const Contact& contact, double approach, double recovery, const Assembly& options) {
  const Material& m = contact.material;
  if (options.impact) return m.restitution * std::min(approach, 0.0);
  const double gap = contact.gap;
  if (!(m.compliance > 0))
    return std::max((gap - std::clamp(gap, -options.slack, options.slack)) / options.h, -recovery);
  return gap < 0 ? gap / (options.h + m.relaxation_time) : gap / options.h;
}

// c_t of a compliant contact. E is on the diagonal of all rows of a contact. u_t + E x_t = 0 would be a
// viscous law, with which a soft foot under a tangential load creeps for ever. With E times the change of x_t
// instead it is a spring: u_t h is its stretch by the change of the force. A sticking contact under a
// constant load then rests.
void hold_tangents(const Contact& contact, double E, double* b) {
  const ContactBasis basis(contact);
  b[1] -= E * dot(basis.tangent_1, contact.held);
  b[2] -= E * dot(basis.tangent_2, contact.held);
}

}  // namespace

// The joint rows supply their E, sets and, below, c.
void assemble_system(const StepBodies& bodies, std::vector<Contact>& contacts, const JointRows& rows,
                     const Assembly& options, Problem& problem) {
  if (!std::holds_alternative<ContactSystem>(problem.A)) problem.A = ContactSystem{};
  auto& A = std::get<ContactSystem>(problem.A);
  SetProduct& K = problem.K;
  A.contact_compliance.resize(contacts.size());
  A.contacts.resize(contacts.size());
  for_entries(options.threads, contacts.size(), [&](std::size_t i) {
    Contact& c = contacts[i];
    if (c.rows > 3) c.moment_length = moment_length(c, bodies.mobility);
    A.contact_compliance[i] =
        std::max(contact_compliance(c.material, options), softness(bodies, c, options.model));
    // A copy, because a Problem is constant and may be shared, without the results: the step writes those
    // into its own contacts later.
    A.contacts[i] = c;
  });
  // One thread: where a set lies follows from the kinds of all sets before it.
  K.clear();
  for (const Contact& c : contacts) append_set(c, K);
  K.append(rows.cones);
  fill(bodies, rows.auxiliary_inverse_mass, options.threads, A.bodies);
  A.jacobian = rows.jacobian;
  A.compliance = rows.compliance;
  A.constrained = bodies.trees;
  problem.b.resize(K.rows());
  renew(problem, options.threads);
}

// The free velocities are known last: those of trees, and the turns of contacts, follow from the start, which
// needs A. So b is not written with A.
//
// b = D v_free + c, of contacts in the frame of each. It includes the velocity of bodies that impulses do not
// move, and of moving surfaces. Auxiliary bodies start at rest.
void write_b(const BodyVelocities& free, std::span<const Contact> contacts, const JointRows& rows,
             const Assembly& options, std::span<const Vec3> turns, Problem& problem) {
  for_entries(options.threads, contacts.size(), [&](std::size_t i) {
    const Contact& c = contacts[i];
    // Rows of its own for each contact: no thread reads what another writes.
    double* b = &problem.b[problem.graph.first_row[i]];
    const ContactImpulse u = relative_motion(c, free);
    to_rows(c, u.linear, u.angular, c.moment_length, b);
    const double recovery = std::max({options.recovery_speed, options.closing,
                                      -c.gap <= options.h * options.at_once ? options.at_once : 0});
    b[0] += contact_bias(c, b[0], recovery, options);
    const double E = contact_compliance(c.material, options);
    if (E > 0 && !options.impact) hold_tangents(c, E, b);
    if (!turns.empty())
      for (int k = 0; k < 3; ++k) b[k] += turns[i][k];
  });
  double* b = problem.b.data() + problem.rows() - rows.jacobian.size();
  for (std::size_t i = 0; i < rows.jacobian.size(); ++i)
    *b++ = row_velocity(rows.jacobian[i], free, rows.c[i]);
}

Problem assemble(const StepBodies& bodies, std::vector<Contact>& contacts, const JointRows& rows,
                 const Assembly& options) {
  Problem problem;
  assemble_system(bodies, contacts, rows, options, problem);
  write_b(bodies.free, contacts, rows, options, {}, problem);
  return problem;
}

std::span<double> impulses_on_bodies(const Problem& problem, std::span<const double> x) {
  const auto& A = std::get<ContactSystem>(problem.A);
  static thread_local std::vector<double> w;
  w.assign(6 * A.bodies.size(), 0.0);
  add_impulses(A, x, w);
  return w;
}

// Auxiliary bodies have no entry in v: their velocities are discarded after the step.
void add_moved(const Problem& problem, std::span<double> w, const double* rates, const Subset& visited,
               BodyVelocities& v) {
  apply_masses(std::get<ContactSystem>(problem.A), w, rates, visited);
  visited.each(v.size(), [&](std::size_t i) {
    const double* change = &w[6 * i];
    v[i].linear += Vec3{change[0], change[1], change[2]};
    v[i].angular += Vec3{change[3], change[4], change[5]};
  });
}

// D'x is summed per body first, six numbers about its centre of mass, then multiplied by M^-1.
void apply_impulses(const Problem& problem, std::span<const double> x, BodyVelocities& v,
                    const Subset& visited) {
  add_moved(problem, impulses_on_bodies(problem, x), nullptr, visited, v);
}

}  // namespace amontons
