// Private: an order in which the blocks of a matrix are eliminated with little fill.
#pragma once
#include <span>
#include <vector>

#include "amontons/base/math.hpp"

namespace amontons {

// For each block its neighbours, both ways, each once, ascending.
using BlockGraph = std::vector<std::vector<int>>;

// result[k]: the block that is eliminated as k-th. Approximate minimum degree; where positions are given (a
// point per block, m) nested dissection is tried beside it on graphs that fill much, and the order that needs
// fewer multiplications is taken.
std::vector<int> order_blocks(const BlockGraph& graph, std::span<const Vec3> positions);

// The elimination tree in such an order: parent[k] > k, or -1 for a root.
std::vector<int> elimination_tree(const std::vector<int>& order, const BlockGraph& graph);

}  // namespace amontons
