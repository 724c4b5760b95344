#pragma once
#include <vector>

#include "amontons/problem/contact_graph.hpp"

namespace amontons {

// The nodes of a factorisation in body space: groups of at most six coordinates of motion. They are those of
// a free body that moves, or coordinates of a tree that follow each other without a branch. M^-1 = C C' has a
// column of C per coordinate. A row of D C has entries at few nodes: one per free body, and those between a
// body of a tree and the root.
struct MotionNodes {
  std::vector<int> size;       // coordinates
  std::vector<Vec3> position;  // of one body of each (m); empty if positions are unknown
  std::vector<int> of_body;    // its node; -1: bodies of trees, and those that no block moves
  // Per coordinate of the trees: its node, -1 if no row reaches it, and its place among those of the node.
  std::vector<int> of_coordinate, place;

  MotionNodes(const ContactSystem& A, const ContactGraph& graph);

 private:
  void add_trees(const ContactSystem& A);
};

}  // namespace amontons
