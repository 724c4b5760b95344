#pragma once
#include <algorithm>
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

// The blocks of a problem, sorted by island, place and number, so that the bits depend on the problem only.
// place(link) sorts the blocks of an island. Returns the number of islands that have some: they are numbered
// in the order of their first blocks here.
template <class Place>
std::size_t sort_into_islands(const Problem& problem, bool with_bilateral, const Place& place,
                              std::vector<IslandBlock>& blocks) {
  static thread_local std::vector<Index> number;  // kept: a step allocates nothing
  number.assign(problem.graph.islands.count, -1);
  blocks.clear();
  Index count = 0;
  for (const SetRun& run : problem.K.runs()) {
    if (run.kind == kind_of<Bilateral> && !with_bilateral) continue;
    std::size_t dim = 0;
    visit_kind(run.kind, [&]<class S>() { dim = S::dim; });
    for (std::size_t i = 0; i < run.count; ++i) {
      const std::size_t block = run.block + i;
      Index& island = number[problem.graph.islands.of_block[block]];
      if (island < 0) island = count++;
      blocks.push_back({block, run.row + dim * i, dim, run.kind, run.first + i, island,
                        place(problem.graph.links[block])});
    }
  }
  std::sort(blocks.begin(), blocks.end(), [](const IslandBlock& a, const IslandBlock& b) {
    return std::tie(a.island, a.place, a.block) < std::tie(b.island, b.place, b.block);
  });
  return static_cast<std::size_t>(count);
}

}  // namespace amontons
