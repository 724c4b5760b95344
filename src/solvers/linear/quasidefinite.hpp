#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "amontons/problem/contact.hpp"

namespace amontons {

// A sparse symmetric quasidefinite matrix of 6 x 6 blocks. Some nodes are positive (groups of coordinates of
// motion in which the masses are 1), the others negative (joints, with minus their compliance), and
//
//   K = [ 1   Y' ]  = L S L',   L lower triangular, S = diag(+-1), the signs of the nodes.
//       [ Y  -E  ]
//
// exists for any order of the nodes if E is positive definite (Vanderbei 1995). With a tiny E, the pivot
// of a joint must be -(E + Y Y') of coordinates in which its rows are independent. Only then is it as stable
// as a Cholesky factorisation. So a joint comes after a body, or after all of its nodes if some are
// coordinates of trees: a light body beside a tree does not suffice. Otherwise the order is greedy minimum
// degree. On a tree of bodies this goes from the leaves to the root without fill: work and
// memory are linear in the bodies.
//
// Nodes of fewer than six rows are padded: the sign on the diagonal, zeros elsewhere.
class QuasidefiniteFactor {
 public:
  static constexpr int width = 6;
  static constexpr int area = width * width;
  struct Edge {
    Index a, b;
  };

  enum class Node : signed char { joint, coordinates, body };

  // Finds order and pattern from the nodes and their edges. At most one edge joins two nodes.
  void analyse(std::span<const Node> nodes, std::span<const Edge> edges);

  std::size_t nodes() const { return sign_.size(); }
  // Multiplications of a factorisation.
  double work() const { return work_; }
  // Place of a node in the order. Children come before parents, and a subtree of the elimination tree is
  // contiguous. -1 for the parent of a root.
  Index position(std::size_t node) const { return position_[node]; }
  Index parent(std::size_t position) const { return parent_[position]; }
  int sign(std::size_t position) const { return sign_[position]; }

  // Whether a node is the unit matrix in L, too: no node before it changes it.
  bool is_unit(std::size_t position) const { return unit_[position]; }

  // Assembly: clears all, then takes the blocks of joints and edges, row-major. The block of an edge has the
  // rows of the node that comes first: edge.a if a_first(). Signs stay on the diagonal.
  void clear();
  double* diagonal(std::size_t node) { return &diagonal_[area * static_cast<std::size_t>(position_[node])]; }
  // The least pivots of a joint, six numbers: rows that others imply have pivots of rounding, of either sign.
  double* least(std::size_t node) { return &least_[width * static_cast<std::size_t>(position_[node])]; }
  double* block(std::size_t edge) { return &blocks_[area * edge_block_[edge]]; }
  bool a_first(std::size_t edge) const { return edge_a_first_[edge]; }

  // Factors in place. False if a pivot times its sign is not positive: solves are then not allowed.
  bool factor();

  // The two halves of K z = r, in the order of the positions, six numbers each: w = L^-1 r, and
  // z = L^-T S w. r and w, w and z may be the same memory.
  void forward(double* r) const;
  void backward(double* w) const;

  // forward() of one node for `columns` right-hand sides side by side: rows of w lie `columns` apart.
  void forward_node(std::size_t position, double* w, std::size_t columns) const;
  // Subtracts the node's part from node `above` at the place `slot` of the pattern: r_above -= s L w. Rows of
  // r are `stride` apart.
  void forward_update(std::size_t slot, int sign, const double* w, std::size_t columns, double* r,
                      std::size_t stride) const;
  // The nodes above a position that it updates: above(slot) for the slots [first, last).
  std::size_t first_slot(std::size_t position) const { return first_slot_[position]; }
  std::size_t last_slot(std::size_t position) const { return first_slot_[position + 1]; }
  Index above(std::size_t slot) const { return above_[slot]; }

 private:
  void order(std::span<const Node> nodes, std::span<const Edge> edges);
  void place_edges(std::span<const Edge> edges);
  void plan_updates();

  // Per position: sign, whether it is the unit matrix, parent, slots. Per slot: the position above,
  // ascending.
  std::vector<signed char> sign_;
  std::vector<unsigned char> unit_;
  std::vector<Index> position_, parent_, above_;
  std::vector<std::size_t> first_slot_;
  // Per edge: the slot of its block, and whether its node a comes first.
  std::vector<std::size_t> edge_block_;
  std::vector<unsigned char> edge_a_first_;
  // Targets of the updates, in the order of factor(): the diagonal of a position (-1 - p) or a slot.
  std::vector<std::ptrdiff_t> target_;
  double work_ = 0;
  // Before factor(): K. After it: diagonal_ the factors that divide by the pivot roots (factor_six), blocks_
  // the transposed blocks of L.
  std::vector<double> diagonal_, blocks_, least_;
};

}  // namespace amontons
