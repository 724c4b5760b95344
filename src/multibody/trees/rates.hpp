// The motion of trees over a step: rates of joints, and the momenta that belong to them.
#pragma once
#include <span>
#include <vector>

#include "multibody/trees/tree_step.hpp"

namespace amontons {

// The rates of the joints that fit given velocities: relative ones along the dofs. Velocities in locked
// directions are left out.
void read_rates(const Tree& tree, const TreeStep& trees, const BodyFrames& frames, const BodyVelocities& v,
                std::vector<double>& rates);

// Velocities of the bodies of trees after a step without impulses, nearly: for the search for contacts.
// `loads`: impulses.
void make_free_tree_velocities(const TreeSetting& in, const std::vector<BodyImpulse>& loads, TreeStep& trees,
                               BodyVelocities& free);

// The same to rounding, if impulses w (six numbers per body of the model; empty: none) will act. M^-1 J'w is
// not included, but the motion that results with it.
void foresee_tree_velocities(const TreeSetting& in, std::span<const double> w, TreeStep& trees,
                             BodyVelocities& free);

// Moves the trees with the rates over h. Writes poses and coordinates in the state, and there the middle
// velocities for `rates_then`. Bodies outside of trees have moved already, with the velocities v.
void move_trees(const TreeSetting& in, const BodyVelocities& v, std::span<const double> rates,
                std::span<const double> rates_then, TreeStep& trees, State& state);
// The velocities in the state after the trees have moved with `after` over h. They are ahead by a share of
// the change of the rates: `ahead`, per body of the model.
void leave_tree_velocities(const TreeSetting& in, std::span<const double> ahead, const TreeStep& trees,
                           State& state);

// Stores the impulses of springs, dampers and inertias that M contains, for the rates `after`.
void store_drive_impulses(const TreeSetting& in, const TreeStep& trees, State& state);

}  // namespace amontons
