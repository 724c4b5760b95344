// Where a solve ends early, or nobody knows how to solve it, forces between bodies are wrong for a step, and
// the next steps make up for it. Of a body that has left through its floor nothing comes back. So the rows of
// what is fixed have the last word: one contact after the other (Gauss-Seidel), of each body alone,
//
//   dx = (least - v_n) / (1 / m + (r x n)' J^-1 (r x n)).
#include "multibody/step/ground.hpp"

#include <algorithm>

namespace amontons {

std::span<const double> stop_at_ground(const Ground& ground, BodyVelocities& v) {
  constexpr int sweeps = 20;               // of a body in a corner
  constexpr double many = 100, far = 1e4;  // errors
  static thread_local std::vector<char> jointed;
  static thread_local std::vector<double> impulse;
  jointed.assign(v.size(), 0);
  for (const Joint& joint : ground.model.description().joints)
    for (Index body : {joint.body_a, joint.body_b})
      if (body >= 0) jointed[body] = 1;
  impulse.assign(ground.contacts.size(), 0);
  const auto moves = [&](Index body) { return body >= 0 && ground.mobility[body].inverse_mass > 0; };
  bool any = false, changed = true;
  for (int sweep = 0; sweep < sweeps && changed; ++sweep) {
    changed = false;
    for (std::size_t i = 0; i < ground.contacts.size(); ++i) {
      const Contact& c = ground.contacts[i];
      const bool first = moves(c.body_a);
      if (first == moves(c.body_b) || c.material.compliance > 0) continue;
      const Index body = first ? c.body_a : c.body_b;
      const double short_of = ground.least[i] - dot(c.normal, relative_motion(c, v).linear);
      if (!(short_of > 0)) continue;
      if (jointed[body] && c.gap > -many * ground.error && !(ground.h * short_of > far * ground.error))
        continue;
      const BodyMobility& mobility = ground.mobility[body];
      const Vec3 n = first ? c.normal : -c.normal, turn = cross(first ? c.r_a : c.r_b, n);
      const Vec3 spin = mobility.inverse_inertia * turn;
      const double dx = short_of / (mobility.inverse_mass + dot(turn, spin));
      impulse[i] += dx;
      v[body].linear += dx * mobility.inverse_mass * n;
      v[body].angular += dx * spin;
      any = changed = true;
    }
  }
  return any ? std::span<const double>(impulse) : std::span<const double>();
}

void slow_spins(const Model& model, const BodyVelocities& start, double h, BodyVelocities& v) {
  constexpr double angle = 0.5;
  for (std::size_t i = 0; i < v.size(); ++i) {
    const double spin = norm(v[i].angular), most = std::max(norm(start[i].angular), angle / h);
    if (model.is_dynamic(static_cast<Index>(i)) && spin > most) v[i].angular = (most / spin) * v[i].angular;
  }
}

}  // namespace amontons
