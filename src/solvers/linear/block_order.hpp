// Private: an order of the blocks of a matrix whose elimination causes little fill.
#pragma once
#include <span>
#include <vector>

#include "amontons/base/math.hpp"

namespace amontons {

// For each block its neighbours, each once, ascending; if i has j, j has i.
using BlockGraph = std::vector<std::vector<int>>;

// result[k]: the block that is eliminated as k-th, by approximate minimum degree. If positions are given (a
// point per block, m), nested dissection is tried too on graphs with much fill. The order with fewer
// multiplications is taken.
std::vector<int> order_blocks(const BlockGraph& graph, std::span<const Vec3> positions);

// The elimination tree in such an order: parent[k] > k, or -1 for a root.
std::vector<int> elimination_tree(const std::vector<int>& order, const BlockGraph& graph);

}  // namespace amontons
