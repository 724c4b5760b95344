// M of trees, factored.
#pragma once
#include <memory>

#include "multibody/trees/tree_step.hpp"

namespace amontons {

// M of the trees at the placed frames, with inertia, springs and dampers of dofs over a step of length h,
// with impulses over `kick`.
void make_tree_masses(const Model& model, const Forest& forest, const State& state, const BodyFrames& frames,
                      double h, double kick, TreeStep& trees);
// The same M once more, over another length of step; 0: without springs and dampers.
std::shared_ptr<ConstrainedBodies> tree_masses(const Model& model, const Forest& forest, double h,
                                               double kick, TreeStep& trees);

}  // namespace amontons
