#pragma once
#include <algorithm>
#include <numeric>
#include <tuple>
#include <vector>

#include "amontons/problem/problem.hpp"

namespace amontons {

// A block of an island: number `set` of its kind; its place among the blocks of its island.
struct IslandBlock {
  std::size_t block, row, dim, kind, set;
  Index island, place;
  bool bilateral() const { return kind == kind_of<Bilateral>; }
};

// Finds the blocks of a problem and their islands by union-find over nodes, and returns the number of
// islands. node(body) is the node of a body, -1 for the world and for bodies that impulses do not move.
// Blocks without a moving body share one more node. place(link) sorts the blocks of an island.
//
// Islands are numbered in the order of their first blocks. Blocks are sorted by island, place and number, so
// that the bits depend on the problem only.
template <class Node, class Place>
std::size_t sort_into_islands(const Problem& problem, bool with_bilateral, std::size_t nodes,
                              const Node& node, const Place& place, std::vector<IslandBlock>& blocks) {
  static thread_local std::vector<Index> leader, number;  // kept: a step allocates nothing
  leader.resize(nodes + 1);
  std::iota(leader.begin(), leader.end(), 0);
  const auto root = [nodes](Index i) {
    if (i < 0) i = static_cast<Index>(nodes);
    while (leader[i] != i) i = leader[i] = leader[leader[i]];
    return i;
  };
  blocks.clear();
  for (const SetRun& run : problem.K.runs()) {
    if (run.kind == kind_of<Bilateral> && !with_bilateral) continue;
    std::size_t dim = 0;
    visit_kind(run.kind, [&]<class S>() { dim = S::dim; });
    for (std::size_t i = 0; i < run.count; ++i) {
      const ContactGraph::Link& link = problem.graph.links[run.block + i];
      const Index a = node(link.a), b = node(link.b);
      blocks.push_back(
          {run.block + i, run.row + dim * i, dim, run.kind, run.first + i, a < 0 ? b : a, place(link)});
      if (a >= 0 && b >= 0) leader[root(a)] = root(b);
    }
  }
  number.assign(leader.size(), -1);
  Index count = 0;
  for (IslandBlock& b : blocks) {
    Index& mine = number[root(b.island)];
    if (mine < 0) mine = count++;
    b.island = mine;
  }
  std::sort(blocks.begin(), blocks.end(), [](const IslandBlock& a, const IslandBlock& b) {
    return std::tie(a.island, a.place, a.block) < std::tie(b.island, b.place, b.block);
  });
  return static_cast<std::size_t>(count);
}

}  // namespace amontons
