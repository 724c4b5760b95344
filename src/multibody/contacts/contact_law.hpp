// From materials to the rows and sets of a contact, and from impulses to its state.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// Number of rows for a material: 3 without moments, 5 with rolling friction beside sliding, 4 and 6 if
// torsion or a second sliding coefficient makes the cone elliptic.
int rows_of(const Material& material);

// Sets the coefficients of a contact for a slip of the last step (m/s, 0: stuck). The one across a direction
// changes in proportion.
void set_friction(const Material& material, double slip, Contact& contact);

// The length by which the moments of a contact are divided. It makes the mean of diag(A) over the moments
// equal to that over the forces, so that one number per block preconditions both.
double moment_length(const ContactGeometry& contact, const BodyMobilities& mobility);

// Appends the set of a contact to K.
void append_set(const Contact& contact, SetProduct& K);

// u = v_A + w_A x r_A - v_B - w_B x r_B + surface velocity, and w_A - w_B, for the given velocities: A's
// point relative to B's, at the stored arms of the contact. It is linear in v as the rows are. `Point` is a
// Contact, or has those of its members.
template <class Point>
inline ContactImpulse relative_motion(const Point& c, const BodyVelocities& v) {
  ContactImpulse u{v[c.body_a].linear + cross(v[c.body_a].angular, c.r_a) + c.surface_velocity,
                   v[c.body_a].angular};
  if (c.body_b >= 0) {
    u.linear -= v[c.body_b].linear + cross(v[c.body_b].angular, c.r_b);
    u.angular -= v[c.body_b].angular;
  }
  return u;
}

// Adds the solution of a problem that starts with these contacts to them: impulses, and motion and state with
// the velocities v after it.
void store_impulses(const Problem& problem, Law law, const Solution& solution, const BodyVelocities& v,
                    std::vector<Contact>& contacts, unsigned threads = 1);

}  // namespace amontons
