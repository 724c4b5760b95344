// Where the bodies of trees are: poses from coordinates, and the frames of joints there.
#pragma once
#include <span>

#include "multibody/trees/tree_step.hpp"

namespace amontons {

// Poses of all bodies of trees from coordinates: those of dofs in the state, those of balls and bases in its
// poses. If poses differ from these by more than rounding, because the user has moved bodies, coordinates are
// fitted to them first, and the state gets the poses that follow.
void place_trees(const TreeSetting& in, State& state, TreeStep& trees);

// The contexts of joints of trees there.
void place_tree_joints(const TreeSetting& in, const State& state, const TreeStep& trees,
                       JointContexts& joints);

// Poses, frames and columns in TreeStep from the coordinates in the state, its poses of bases, and balls.
// `still`, per TreeBody: its place holds; empty: none does.
void place_all(const Model& model, const Tree& tree, const State& state, std::span<const unsigned char> still,
               TreeStep& trees);

// The places in TreeStep are those that place_trees() would find for this state.
void note_placed(const TreeSetting& in, const State& state);

// The poses in TreeStep become those of the state, except of bodies that are still.
void write_poses(const Tree& tree, const TreeStep& trees, std::span<const unsigned char> still, State& state);

// The motion of one dof, after the motions of those before it: T := T exp(s q). A slide moves along its axis.
// A hinge turns about its anchor a, x -> R (x - a) + a.
inline void append_dof(const Dof& dof, double q, const Quat& turn, Transform& relative) {
  if (dof.kind == Dof::Kind::slide) {
    relative.position += q * rotate(relative.rotation, dof.axis);
    return;
  }
  if (!(dof.anchor == Vec3{}))
    relative.position += rotate(relative.rotation, dof.anchor - rotate(turn, dof.anchor));
  relative.rotation = relative.rotation * turn;
}

}  // namespace amontons
