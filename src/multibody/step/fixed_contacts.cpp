// If a solve ends early or fails, forces between bodies are wrong for a step, and the next steps correct
// this. But a body that has left through its floor does not come back. So contacts with fixed geometry are
// enforced last: one contact after the other (Gauss-Seidel), each body independently,
//
//   dx = (least - v_n) / (1 / m + (r x n)' J^-1 (r x n)).
#include "multibody/step/fixed_contacts.hpp"

#include <algorithm>

#include "multibody/bodies/motion.hpp"
#include "multibody/step/policy.hpp"

namespace amontons {

namespace {

// A contact of a dynamic body with fixed geometry.
struct Stop {
  std::size_t contact;
  Index body;
  bool first;  // the body is A
  bool jointed;
};

// Selects the contacts that stop a body. A wall has few of them, and all sweeps run over them.
void find_stops(const FixedContacts& fixed, std::size_t bodies, std::vector<Stop>& stops) {
  static thread_local std::vector<char> jointed;
  jointed.assign(bodies, 0);
  for (const Joint& joint : fixed.model.description().joints)
    for (Index body : {joint.body_a, joint.body_b})
      if (body >= 0) jointed[body] = 1;
  const auto moves = [&](Index body) { return body >= 0 && fixed.mobility[body].inverse_mass > 0; };
  stops.clear();
  for (std::size_t i = 0; i < fixed.contacts.size(); ++i) {
    const Contact& c = fixed.contacts[i];
    const bool first = moves(c.body_a);
    if (first == moves(c.body_b) || c.material.compliance > 0) continue;
    const Index body = first ? c.body_a : c.body_b;
    stops.push_back({i, body, first, jointed[body] != 0});
  }
}

// Sweeps until nothing changes; returns whether anything changed.
bool sweep_stops(const FixedContacts& fixed, std::span<const Stop> stops, std::span<double> impulse,
                 BodyVelocities& v) {
  bool any = false, changed = true;
  for (std::size_t sweep = 0; sweep < step::policy.few_iterations && changed; ++sweep) {
    changed = false;
    for (const auto& [i, body, first, jointed] : stops) {
      const Contact& c = fixed.contacts[i];
      const double short_of = fixed.least[i] - dot(c.normal, relative_motion(c, v).linear);
      if (!(short_of > 0)) continue;
      // A body that stops alone comes apart from those that its joints hold. Errors between bodies are
      // corrected later, so it stops only where it would leave.
      if (jointed && fixed.h * short_of - std::min(c.gap, 0.0) < fixed.model.length()) continue;
      const BodyMobility& mobility = fixed.mobility[body];
      const Vec3 n = first ? c.normal : -c.normal, turn = cross(first ? c.r_a : c.r_b, n);
      const Vec3 spin = mobility.inverse_inertia * turn;
      const double dx = short_of / (mobility.inverse_mass + dot(turn, spin));
      impulse[i] += dx;
      v[body].linear += dx * mobility.inverse_mass * n;
      v[body].angular += dx * spin;
      any = changed = true;
    }
  }
  return any;
}

}  // namespace

// An off-centre stop spins the body. Limiting that spin can let the centre approach again, so both alternate.
std::span<const double> stop_at_fixed(const FixedContacts& fixed, BodyVelocities& v) {
  static thread_local std::vector<Stop> stops;
  static thread_local std::vector<double> impulse;
  find_stops(fixed, v.size(), stops);
  impulse.assign(fixed.contacts.size(), 0);
  bool any = false;
  for (std::size_t round = 0; round < step::policy.few_iterations && sweep_stops(fixed, stops, impulse, v);
       ++round) {
    any = true;
    if (fixed.start == nullptr) break;
    slow_spins(fixed.model, *fixed.start, fixed.h, v);
  }
  return any ? std::span<const double>(impulse) : std::span<const double>();
}

// A contact foresees no faster turn.
void slow_spins(const Model& model, const BodyVelocities& start, double h, BodyVelocities& v) {
  for (std::size_t i = 0; i < v.size(); ++i) {
    const double spin = norm(v[i].angular), most = std::max(norm(start[i].angular), resolved_turn / h);
    if (model.is_dynamic(static_cast<Index>(i)) && spin > most) v[i].angular = (most / spin) * v[i].angular;
  }
}

}  // namespace amontons
