#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/kinematics/motion.hpp"

// Loops: rigid joints outside the tree, and rigid couplings, as conditions on q and qd.
namespace amontons {

// Turns the quaternions of q into unit quaternions. Throws InputError naming the body or joint whose
// coordinates are not finite or whose quaternion is zero, likewise for qd.
void check_coordinates(const Tree& tree, std::span<double> q, std::span<const double> qd);

// Moves q, as little as the loops allow (angles times Model::length()), until every loop is closed: Newton's
// method with the least change of all entries but those that `held` (one per entry of qd) names. Throws
// InputError naming the joint or coupling with the largest gap that is left if it does not get there; q is
// then unchanged.
void close_loops(const Tree& tree, const State& state, std::span<const unsigned char> held,
                 std::vector<double>& q);
// The same for qd at q, a linear problem.
void close_velocities(const Tree& tree, const State& state, std::span<const double> q,
                      std::span<const unsigned char> held, std::vector<double>& qd);

}  // namespace amontons
