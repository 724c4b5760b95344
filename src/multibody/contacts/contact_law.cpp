#include "multibody/contacts/contact_law.hpp"

#include <cmath>
#include <type_traits>

namespace amontons {

namespace {

bool is_anisotropic(const Material& m) { return m.friction_across >= 0 && m.friction_across != m.friction; }
double across(const Material& m) { return m.friction_across >= 0 ? m.friction_across : m.friction; }

double power(const Mat3& inverse_inertia, const Vec3& torque) {
  return dot(torque, inverse_inertia * torque);
}

// Where x lies in its set decides what the contact does: it carries nothing where the projection of the trial
// point is the apex, and sticks where the projection leaves the trial point alone. Rolling beside sliding is
// no slip: of the product only the sliding rows count. An elliptic cone gives way in all rows together.
template <class S>
ContactState state_of(const S& set, double p, Law law, const double* x, const double* u) {
  double g[S::dim], trial[S::dim], foot[S::dim];
  add_saxce_term(set, law, u, g);
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

int rows_of(const Material& m) {
  const bool elliptic = m.torsional_friction > 0 || is_anisotropic(m);
  if (!elliptic) return m.rolling_friction > 0 ? 5 : 3;
  return m.rolling_friction > 0 ? 6 : m.torsional_friction > 0 ? 4 : 3;
}

double moment_length(const Contact& contact, const std::vector<BodyMobility>& mobility) {
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

void append_set(const Contact& contact, SetProduct& K) {
  const Material& m = contact.material;
  const double torsion = m.torsional_friction / contact.moment_length,
               rolling = m.rolling_friction / contact.moment_length;
  if (contact.rows == 3 && !is_anisotropic(m))
    K.append(Friction{m.friction});
  else if (contact.rows == 3)
    K.append(EllipticFriction<3>{m.friction, across(m)});
  else if (contact.rows == 4)
    K.append(EllipticFriction<4>{m.friction, across(m), torsion});
  else if (contact.rows == 5)
    K.append(RollingFriction{m.friction, rolling});
  else
    K.append(EllipticFriction<6>{m.friction, across(m), torsion, rolling, rolling});
}

ContactImpulse relative_motion(const Contact& c, const std::vector<BodyVelocity>& v) {
  ContactImpulse u{v[c.body_a].linear + cross(v[c.body_a].angular, c.r_a) + c.surface_velocity,
                   v[c.body_a].angular};
  if (c.body_b >= 0) {
    u.linear -= v[c.body_b].linear + cross(v[c.body_b].angular, c.r_b);
    u.angular -= v[c.body_b].angular;
  }
  return u;
}

void store_impulses(const Problem& problem, Law law, const Solution& solution,
                    const std::vector<BodyVelocity>& v, std::vector<Contact>& contacts) {
  for_each_block(problem.K, [&](const auto& set, std::size_t block, std::size_t row) {
    if (block >= contacts.size()) return;
    Contact& c = contacts[block];
    const ContactImpulse impulse = to_world(c, &solution.x[row]), u = relative_motion(c, v);
    c.impulse += impulse.linear;
    c.angular_impulse += impulse.angular;
    c.normal_velocity = dot(c.normal, u.linear);
    c.slip = u.linear - c.normal_velocity * c.normal;
    c.spin = u.angular;
    c.state = state_of(set, problem.P[block], law, &solution.x[row], &solution.u[row]);
  });
}

}  // namespace amontons
