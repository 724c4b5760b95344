#include "multibody/contacts/contact_law.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "amontons/base/parts.hpp"
#include "multibody/model/stribeck.hpp"

namespace amontons {

namespace {

// Equal coefficients along and across form a circle, which has the cheaper set.
bool is_anisotropic(const Material& m) { return m.friction_across >= 0 && m.friction_across != m.friction; }
// Friction coefficient that stands for interlocking: a cone of half an angle of 89.94 degrees. In a wider
// cone the normal impulse is lost in the rounding of its tangents, and a sticking body falls through.
constexpr double roughest = 1e3;  // not tuned: rounding
double at_most(double friction) { return std::min(friction, roughest); }
double across(const Material& m) { return m.friction_across >= 0 ? m.friction_across : m.friction; }

// t' I^-1 t: the angular velocity along t per unit impulse of torque t.
double power(const Mat3& inverse_inertia, const Vec3& torque) {
  return dot(torque, inverse_inertia * torque);
}

// The position of x in its set gives the state of a contact. It is open if the projection of the trial point
// x - g / p is the apex, and sticks if the trial point is inside. At a solution x is that projection. The
// trial point decides without a tolerance, while x alone would need one at the boundary. Rolling beside
// sliding is no slip: for the product set only the sliding rows count. In an elliptic cone all rows slip
// together.
template <class S>
ContactState state_of(const S& set, double p, Law law, const double* x, const double* u) {
  double g[S::dim], trial[S::dim], foot[S::dim];
  add_de_saxce_term(set, law, u, g);
  for (int k = 0; k < S::dim; ++k) trial[k] = x[k] - g[k] / p;
  set.project(trial, foot);
  constexpr bool beside = std::is_same_v<S, RollingFriction>;
  bool open = true, inside = true;
  for (int k = 0; k < S::dim; ++k) {
    open = open && foot[k] == 0;
    if (!beside || k == 1 || k == 2) inside = inside && foot[k] == trial[k];
  }
  return open ? ContactState::open : inside ? ContactState::stick : ContactState::slip;
}

}  // namespace

// The cheapest set for the material. Torsion couples with sliding in one ellipsoid, which requires the
// elliptic cones. Rolling friction alone is bounded separately from sliding, as a ball rolls and slides
// independently.
int rows_of(const Material& m) {
  const bool elliptic = m.torsional_friction > 0 || is_anisotropic(m);
  if (!elliptic) return m.rolling_friction > 0 ? 5 : 3;
  return m.rolling_friction > 0 ? 6 : m.torsional_friction > 0 ? 4 : 3;
}

void set_friction(const Material& material, double slip, Contact& contact) {
  Material& m = contact.material;
  m.friction = friction_at(material.friction, material.friction_static, material.stribeck_speed, slip);
  if (!is_anisotropic(material))
    m.friction_across = material.friction_across >= 0 ? m.friction : -1;
  else if (material.friction > 0)
    m.friction_across = material.friction_across * (m.friction / material.friction);
}

// For unit impulses along the axes e_k of the contact, A has on its diagonal the sum over both bodies of
//   1/m + (r x e_k)' I^-1 (r x e_k)   for forces (`force`),   e_k' I^-1 e_k   for moments (`moment`).
// Moments enter as m / L, spins as L w: with rows in m/s their diagonal is L^2 times the second. The two
// means agree for L^2 = force / moment; for a rolling ball that is about its radius. All three axes are
// summed, so that L does not depend on the tangents. Between bodies that cannot turn L has no effect: 1.
double moment_length(const ContactGeometry& contact, const BodyMobilities& mobility) {
  const ContactBasis basis(contact);
  double force = 0, moment = 0;
  const auto add = [&](Index body, const Vec3& r) {
    if (body < 0) return;
    const BodyMobility& m = mobility[body];
    for (int k = 0; k < 3; ++k) {
      force += m.inverse_mass + power(m.inverse_inertia, cross(r, basis.axis(k)));
      moment += power(m.inverse_inertia, basis.axis(k));
    }
  };
  add(contact.body_a, contact.r_a);
  add(contact.body_b, contact.r_b);
  return moment > 0 ? std::sqrt(force / moment) : 1;
}

// Coefficients of moments are lengths, m <= mu_r f_n; rows hold m / L, hence mu_r / L.
void append_set(const Contact& contact, SetProduct& K) {
  const Material& m = contact.material;
  const double along = at_most(m.friction);
  if (contact.rows == 3 && !is_anisotropic(m)) return K.append(Friction{along});
  const double torsion = at_most(m.torsional_friction / contact.moment_length),
               rolling = at_most(m.rolling_friction / contact.moment_length), athwart = at_most(across(m));
  if (contact.rows == 3)
    K.append(EllipticFriction<3>{along, athwart});
  else if (contact.rows == 4)
    K.append(EllipticFriction<4>{along, athwart, torsion});
  else if (contact.rows == 5)
    K.append(RollingFriction{along, rolling});
  else
    K.append(EllipticFriction<6>{along, athwart, torsion, rolling, rolling});
}

// Contacts are the first blocks of the problem, in their order. Impulses are added, because those of impacts
// at the start of the step are already stored.
void store_impulses(const Problem& problem, Law law, const Solution& solution, const BodyVelocities& v,
                    std::vector<Contact>& contacts, unsigned threads) {
  const auto store = [&](const auto& set, std::size_t block, std::size_t row) {
    Contact& c = contacts[block];
    const ContactImpulse impulse = to_world(c, &solution.x[row]), u = relative_motion(c, v);
    c.impulse += impulse.linear;
    c.angular_impulse += impulse.angular;
    c.normal_velocity = dot(c.normal, u.linear);
    c.slip = u.linear - c.normal_velocity * c.normal;
    c.spin = u.angular;
    c.state = state_of(set, problem.P[block], law, &solution.x[row], &solution.u[row]);
    // Bodies that were stopped (step/lookahead) stick, whatever the trial point of the inaccurate start.
    if (c.state == ContactState::slip && c.slip == Vec3{} && c.spin == Vec3{}) c.state = ContactState::stick;
  };
  // Sets of a run are of one kind, so that row and block of each follow from its place in the run.
  for (const SetRun& run : problem.K.runs()) {
    if (run.block >= contacts.size()) break;
    visit_kind(run.kind, [&]<class S>() {
      const S* sets = problem.K.all<S>().data() + run.first;
      for_entries(threads, std::min(run.count, contacts.size() - run.block),
                  [&](std::size_t i) { store(sets[i], run.block + i, run.row + S::dim * i); });
    });
  }
}

}  // namespace amontons
