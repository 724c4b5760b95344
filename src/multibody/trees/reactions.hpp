// Impulses of the locked directions of joints of trees.
#pragma once
#include "multibody/trees/tree_step.hpp"

namespace amontons {

// Stores the impulses of the locked directions of joints of trees, as rows would store them. The motion with
// the rates `after` needs them beside loads and the impulses w of rows (six numbers per body of the model).
// Before the trees move.
void store_tree_reactions(const TreeSetting& in, const JointContexts& joints, std::span<const double> w,
                          const TreeStep& trees, State& state);

// The same for impulses w of an impact, with the M of trees in it; added to the wrenches of joints.
void add_tree_impacts(const TreeSetting& in, const JointContexts& joints, std::span<const double> w,
                      const ConstrainedBodies& masses, const TreeStep& trees,
                      std::vector<JointWrench>& wrenches);

}  // namespace amontons
