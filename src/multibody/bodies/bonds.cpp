// A bond bears tension by the shift of a cone. Let x be the impulse of bond and contact together, and s the
// pull of the bond. Then y = x + s n is what the contact itself bears: y in K, u in K*, <u, y> = 0. So the
// pull is a load on both bodies, and the contact below is as any other. It opens (y = 0) under the tension s,
// and slides under a shear of mu (x_n + s): its cohesion is mu s. The pull stays the same up to the opening
// at which the bond breaks, as in the strip model of Dugdale (1960, J. Mech. Phys. Solids 8). So s times the
// opening is the energy that a break takes.
#include "multibody/bodies/bonds.hpp"

#include <algorithm>

namespace amontons {

void add_bond_loads(const Model& model, const BodyFrames& frames, const State& state, double kick,
                    std::vector<BodyImpulse>& loads) {
  const std::vector<Bond>& bonds = model.description().bonds;
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    const Bond& bond = bonds[k];
    if (state.bond_openings[k] > bond.opening) continue;
    const Transform a = pose_in(state, bond.body_a), b = pose_in(state, bond.body_b);
    // Both act at one place, so that they have no moment together.
    const Vec3 place = 0.5 * (a(bond.point_a) + b(bond.point_b));
    const Vec3 pull = -kick * bond.tension * rotate(b.rotation, bond.normal);
    const auto add = [&](Index body, const Vec3& impulse) {
      if (!model.is_dynamic(body)) return;
      loads[body].force += impulse;
      loads[body].torque += cross(place - frames[body].centre, impulse);
    };
    add(bond.body_a, pull);
    add(bond.body_b, -pull);
  }
}

void open_bonds(const Model& model, State& state) {
  const std::vector<Bond>& bonds = model.description().bonds;
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    const Bond& bond = bonds[k];
    const Vec3 apart = pose_in(state, bond.body_a)(bond.point_a) - pose_in(state, bond.body_b)(bond.point_b);
    state.bond_openings[k] = std::max(state.bond_openings[k], norm(apart));
  }
}

}  // namespace amontons
