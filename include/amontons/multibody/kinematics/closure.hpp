#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/kinematics/motion.hpp"

// Loops: rigid joints outside the tree, and rigid couplings, as conditions on q and qd.
namespace amontons {

// Normalises the quaternions of q. Throws InputError naming the body or joint whose coordinates or rates are
// not finite or whose quaternion is zero.
void check_coordinates(const Tree& tree, std::span<double> q, std::span<const double> qd);

// Changes q as little as possible (angles times Model::length()) until every loop is closed, by Newton's
// method. Entries that `held` marks (one per entry of qd) do not change. If it does not converge it throws
// InputError naming the joint or coupling with the largest remaining gap, and q is unchanged.
void close_loops(const Tree& tree, const State& state, std::span<const unsigned char> held,
                 std::vector<double>& q);
// The same for qd at q; this problem is linear.
void close_velocities(const Tree& tree, const State& state, std::span<const double> q,
                      std::span<const unsigned char> held, std::vector<double>& qd);

}  // namespace amontons
