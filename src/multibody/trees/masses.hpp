// M of trees, factored.
#pragma once
#include <memory>

#include "multibody/trees/tree_step.hpp"

namespace amontons {

// M of the trees at the placed frames, with inertia, springs and dampers of dofs over the step.
void make_tree_masses(const TreeSetting& in, const State& state, TreeStep& trees);
// The same M once more, with or without springs and dampers.
std::shared_ptr<ConstrainedBodies> tree_masses(const TreeSetting& in, bool with_drives, TreeStep& trees);

}  // namespace amontons
