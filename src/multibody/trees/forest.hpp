// Which bodies move in coordinates of their joints. Constant for a model.
#pragma once
#include <vector>

#include "amontons/multibody/kinematics/tree.hpp"

namespace amontons {

// A body of a tree: moved by a joint relative to its parent, or freely (the base of a floating tree). Its
// coordinates are the dofs of the joint in their order, then three of a ball. Those of a base are the
// displacement of its centre of mass and a turn about it, in world axes.
struct TreeBody {
  Index body = world, parent = world;          // parent: another body of a tree, a driven body, or the world
  Index above = -1;                            // number of the parent among the bodies of trees
  Index joint = -1;                            // -1: a base
  bool reversed = false;                       // the body is B of the joint
  std::size_t first = 0, dofs = 0, count = 0;  // its coordinates; `dofs` of them are dofs of the joint
  std::size_t first_dof = 0;                   // in State::coordinates
  Transform fore, aft;  // on the parent and on the body: frames of the joint, the latter inverted
  Index root = -1;      // number of the first TreeBody of its tree
  Index last = -1;      // the last coordinate that moves it; -1: none
};

// The trees of a model, parents before children and each branch in one piece. Bodies without a joint that
// belongs to a tree are not listed.
struct Forest {
  std::vector<TreeBody> bodies;
  std::vector<Index> number;             // per body of the model: its TreeBody, -1 outside of trees
  std::vector<unsigned char> has_joint;  // per joint: it belongs to a tree, and locks nothing by rows
  std::vector<Index> parent;             // per coordinate, as in Linkage

  bool empty() const { return bodies.empty(); }
  bool contains(std::size_t body) const { return !empty() && number[body] >= 0; }
};

// Takes the joints of the spanning tree whose locked directions are rigid. A mechanism in which more joints
// close loops than belong to the tree keeps its rows, because there the form with rows is the smaller one.
Forest make_forest(const Tree& tree);

}  // namespace amontons
