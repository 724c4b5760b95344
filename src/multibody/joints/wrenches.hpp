#pragma once
#include <array>

#include "multibody/joints/chain.hpp"

// The wrenches of a chain: those along its degrees of freedom and those that it locks. `length` makes angles
// comparable with displacements: twists are measured by <v, v> / length^2 + <w, w>, wrenches by
// <f, f> + <t, t> / length^2.
namespace amontons {

// Dual wrenches: rate of dof i = <dual_i, twist>, the least-squares solution of sum_i screws_i q'_i = twist.
// The generalised force tau of dof i is the wrench tau dual_i on A. Of a spherical joint, forces only.
std::array<Screw, 6> dual_wrenches(const ChainKinematics& chain, double length);

// Wrenches at the reference that do no work on the dofs, torques times `length`: an orthonormal basis w.r.t.
// <f, f> + <t, t> / length^2. Returns their number: 6 (or 3 if spherical) less the dofs.
std::size_t locked_wrenches(const ChainKinematics& chain, double length, std::array<Screw, 6>& wrenches);

}  // namespace amontons
