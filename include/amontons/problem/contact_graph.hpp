#pragma once
#include <cstddef>
#include <vector>

#include "amontons/problem/contact_system.hpp"
#include "amontons/sets/product.hpp"

namespace amontons {

// The moving bodies on which each block of a contact system acts. Built once per problem; it serves the
// islands, the order and batches of the fused passes, and the factorisation.
//
// Blocks of two islands share no moving body and no tree, so that the VI separates.
struct Islands {
  std::size_t count = 0;
  std::vector<Index> of_block;  // in the order of their first blocks; those without a moving body form one
  std::vector<Index> of_body;   // -1: no block moves it
};
// Nodes are bodies, edges the blocks of K between two of them. Several edges may join the same two bodies,
// and an edge may end at the world. Bodies keep their numbers; code that needs contiguous nodes numbers the
// moving ones.
struct ContactGraph {
  struct Link {
    Index a, b;  // -1: the world, or a body that impulses do not move
  };
  std::vector<Link> links;           // per block, in order
  std::vector<Index> first_row;      // per block, followed by the total number of rows
  std::vector<unsigned char> moves;  // per body: whether it moves and a block acts on it
  Islands islands;

  std::size_t bodies() const { return moves.size(); }
};
// Uses the memory of `graph`.
void make_contact_graph(const ContactSystem& A, const SetProduct& K, ContactGraph& graph);

}  // namespace amontons
