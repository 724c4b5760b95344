// From materials to the rows and sets of a contact, and from impulses to what it does.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// The rows that a material asks for: 3 without moments, 5 with rolling friction beside sliding, 4 and 6 where
// torsion or a second sliding coefficient makes the cone elliptic.
int rows_of(const Material& material);

// The length by which the moments of a contact are divided: that makes the mean of diag(A) over its moments
// equal to that over its forces, so that one number per block preconditions both.
double moment_length(const Contact& contact, const BodyMobilities& mobility);

// Appends the set of a contact to K.
void append_set(const Contact& contact, SetProduct& K);

// u = v_A + w_A x r_A - v_B - w_B x r_B + surface velocity, and w_A - w_B, of the given velocities.
ContactImpulse relative_motion(const Contact& contact, const BodyVelocities& v);

// Adds the solution of a problem that starts with these contacts to them: impulses, and of the velocities v
// after it the motion and the state.
void store_impulses(const Problem& problem, Law law, const Solution& solution, const BodyVelocities& v,
                    std::vector<Contact>& contacts);

}  // namespace amontons
