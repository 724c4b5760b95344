#pragma once
#include <cstddef>
#include <vector>

#include "amontons/problem/contact_system.hpp"
#include "amontons/sets/product.hpp"

namespace amontons {

// Which moving bodies each block of a contact system acts on: built once per problem, it serves the islands,
// the order and batches of the fused passes, and the factorisation.
//
// Nodes are bodies, edges the blocks of K between two of them; several edges may join the same two, and an
// edge may end at nothing (the world). Bodies keep their numbers; whoever needs nodes without gaps numbers
// those that move.
struct ContactGraph {
  struct Link {
    Index a, b;  // -1: the world, or a body that impulses do not move
  };
  std::vector<Link> links;           // of each block, in order
  std::vector<Index> first_row;      // of each block, and the number of rows at the end
  std::vector<unsigned char> moves;  // of each body: whether it moves and some block acts on it

  std::size_t bodies() const { return moves.size(); }
};
ContactGraph contact_graph(const ContactSystem& A, const SetProduct& K);
// The same in the memory of `graph`.
void make_contact_graph(const ContactSystem& A, const SetProduct& K, ContactGraph& graph);

// The island of every block, numbered in the order of their first blocks; blocks without a moving body are
// one island. Blocks of two islands share no moving body, so that the VI falls apart. Returns how many there
// are.
std::size_t find_islands(const ContactGraph& graph, std::vector<Index>& island);

}  // namespace amontons
