#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "amontons/solvers/linear/block_cholesky.hpp"
#include "check.hpp"
#include "problems.hpp"
#include "solvers/linear/block_order.hpp"

using namespace amontons;

namespace {

struct Heap {
  std::vector<Vec3> positions;
  std::vector<std::pair<int, int>> edges;
  std::vector<int> sizes;
  BlockGraph graph;
};

// Points near the sites of a lattice, in a random order, coupled where they are near each other.
Heap heap(int nx, int ny, int nz, double reach, unsigned seed) {
  small::Random random(seed);
  Heap h;
  for (int i = 0; i < nx * ny * nz; ++i) {
    const Vec3 site{double(i % nx), double(i / nx % ny), double(i / (nx * ny))};
    h.positions.push_back(site + 0.1 * Vec3{random.normal(), random.normal(), random.normal()});
  }
  for (std::size_t i = h.positions.size(); i-- > 1;)
    std::swap(h.positions[i], h.positions[std::min<std::size_t>(i, std::abs(random.normal()) * i / 3)]);
  const int n = static_cast<int>(h.positions.size());
  h.graph.resize(n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      if (i != j && norm(h.positions[i] - h.positions[j]) < reach) {
        h.graph[i].push_back(j);
        if (i < j) h.edges.emplace_back(i, j);
      }
  h.sizes.assign(n, 1);
  return h;
}

double work(const Heap& h, std::span<const Vec3> positions) {
  return BlockCholesky(h.sizes, h.edges, positions).factor_work();
}

}  // namespace

// Breaks when a block is forgotten or taken twice: no separator, a hub, parts that fall apart, one place.
TEST(every_block_has_one_place) {
  for (double reach : {0.0, 1.2, 1.6}) {
    Heap h = heap(12, 10, 9, reach, 1);
    for (int hub : {-1, 5})
      for (int i = 0; hub >= 0 && i < 200; ++i)
        if (i != hub && !std::count(h.graph[hub].begin(), h.graph[hub].end(), i)) {
          h.graph[hub].push_back(i);
          h.graph[i].push_back(hub);
        }
    for (auto& neighbours : h.graph) std::sort(neighbours.begin(), neighbours.end());
    for (const std::vector<Vec3>& at : {h.positions, std::vector<Vec3>(h.positions.size()), {}}) {
      std::vector<int> order = order_blocks(h.graph, at);
      std::sort(order.begin(), order.end());
      std::vector<int> all(h.graph.size());
      std::iota(all.begin(), all.end(), 0);
      CHECK(order == all);
    }
  }
}

// Breaks when planes, borders or the smallest separator are wrong: the squares of columns fall by a quarter
// and more where a heap has thousands of blocks (George 1973), however it is turned.
TEST(dissection_saves_work_on_heaps) {
  Heap h = heap(16, 16, 16, 1.25, 2);
  const double greedy = work(h, {});
  CHECK(work(h, h.positions) < 0.8 * greedy);
  for (Vec3& p : h.positions) p = {p.x + p.y, p.y - p.x, p.z + 0.3 * p.x};
  CHECK(work(h, h.positions) < 0.85 * greedy);
}

// Breaks when dissection is taken where minimum degree does better, or positions that are no numbers are
// used.
TEST(never_more_work_than_minimum_degree) {
  for (const Heap& h : {heap(60, 1, 30, 1.3, 3), heap(900, 1, 1, 1.5, 4), heap(9, 9, 9, 1.8, 5)}) {
    const double greedy = work(h, {});
    CHECK(work(h, h.positions) <= greedy);
    std::vector<Vec3> broken = h.positions;
    broken[7].y = std::numeric_limits<double>::quiet_NaN();
    CHECK(work(h, broken) == greedy);
  }
}
