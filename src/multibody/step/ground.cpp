// Where a solve ends early, or nobody knows how to solve it, forces between bodies are wrong for a step, and
// the next steps make up for it. Of a body that has left through its floor nothing comes back. So the rows of
// what is fixed have the last word: one contact after the other (Gauss-Seidel), of each body alone,
//
//   dx = (least - v_n) / (1 / m + (r x n)' J^-1 (r x n)).
#include "multibody/step/ground.hpp"

#include <algorithm>

namespace amontons {

namespace {

// Contacts of one body with what does not move.
struct Stop {
  std::size_t contact;
  Index body;
  bool first;  // the body is A
  bool jointed;
};

// Of all contacts those that stop a body: few of a wall, and all sweeps are over them.
void find_stops(const Ground& ground, std::size_t bodies, std::vector<Stop>& stops) {
  static thread_local std::vector<char> jointed;
  jointed.assign(bodies, 0);
  for (const Joint& joint : ground.model.description().joints)
    for (Index body : {joint.body_a, joint.body_b})
      if (body >= 0) jointed[body] = 1;
  const auto moves = [&](Index body) { return body >= 0 && ground.mobility[body].inverse_mass > 0; };
  stops.clear();
  for (std::size_t i = 0; i < ground.contacts.size(); ++i) {
    const Contact& c = ground.contacts[i];
    const bool first = moves(c.body_a);
    if (first == moves(c.body_b) || c.material.compliance > 0) continue;
    const Index body = first ? c.body_a : c.body_b;
    stops.push_back({i, body, first, jointed[body] != 0});
  }
}

// Sweeps until nothing changes; whether anything did.
bool sweep_stops(const Ground& ground, std::span<const Stop> stops, std::span<double> impulse,
                 BodyVelocities& v) {
  constexpr int sweeps = 20;               // of a body in a corner
  constexpr double many = 100, far = 1e4;  // errors
  bool any = false, changed = true;
  for (int sweep = 0; sweep < sweeps && changed; ++sweep) {
    changed = false;
    for (const auto& [i, body, first, jointed] : stops) {
      const Contact& c = ground.contacts[i];
      const double short_of = ground.least[i] - dot(c.normal, relative_motion(c, v).linear);
      if (!(short_of > 0)) continue;
      if (jointed && c.gap > -many * ground.error && !(ground.h * short_of > far * ground.error)) continue;
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
  return any;
}

}  // namespace

// What stops a body beside its centre spins it; without that spin the centre may go on.
std::span<const double> stop_at_ground(const Ground& ground, BodyVelocities& v) {
  constexpr int rounds = 20;
  static thread_local std::vector<Stop> stops;
  static thread_local std::vector<double> impulse;
  find_stops(ground, v.size(), stops);
  impulse.assign(ground.contacts.size(), 0);
  bool any = false;
  for (int round = 0; round < rounds && sweep_stops(ground, stops, impulse, v); ++round) {
    any = true;
    if (ground.start == nullptr) break;
    slow_spins(ground.model, *ground.start, ground.h, v);
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
