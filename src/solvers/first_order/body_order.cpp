// The order of bodies in memory: sorted along a Morton curve through their positions, which keeps the working
// set of any stretch of it small at every size of cache.
//
// Problems from files give no positions. There the arms of a contact relate the positions p of its bodies,
// p_a + r_a = p_b + r_b. A walk over the contact graph finds them up to one translation per connected part
// (and up to the gaps). If positions coincide the order of the walk remains, which is that of Cuthill and
// McKee without sorting by degree.
#include "solvers/first_order/body_order.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace amontons {

namespace {

using Link = ContactGraph::Link;

// The other end of an edge, and its block.
struct Edge {
  std::uint32_t body, link;
};

// Neighbours of body i: edges[first[i]] .. edges[first[i + 1] - 1].
struct Graph {
  std::vector<std::uint32_t> first;
  std::vector<Edge> edges;
};

// Compressed rows by counting. first is filled two places ahead: its prefix sums give the begin of row i at
// first[i + 1]. The second loop advances that to the begin of row i + 1, its final meaning.
Graph contact_graph(std::size_t bodies, const std::vector<Link>& links, const std::vector<bool>& is_hub) {
  const auto is_edge = [&](const Link& l) {
    return l.a >= 0 && l.b >= 0 && l.a != l.b && !is_hub[l.a] && !is_hub[l.b];
  };
  Graph g;
  g.first.assign(bodies + 2, 0);
  for (const Link& l : links)
    if (is_edge(l))
      for (Index i : {l.a, l.b}) ++g.first[i + 2];
  for (std::size_t i = 2; i < g.first.size(); ++i) g.first[i] += g.first[i - 1];
  g.edges.resize(g.first.back());
  for (std::size_t k = 0; k < links.size(); ++k) {
    const Link& l = links[k];
    if (!is_edge(l)) continue;
    const auto link = static_cast<std::uint32_t>(k);
    g.edges[g.first[l.a + 1]++] = {static_cast<std::uint32_t>(l.b), link};
    g.edges[g.first[l.b + 1]++] = {static_cast<std::uint32_t>(l.a), link};
  }
  return g;
}

// Breadth-first walk: bodies in the order of the walk, their connected part and their position in it (m,
// relative to the first body of the part, in world axes).
struct Walk {
  std::vector<std::uint32_t> body, part;
  std::vector<Vec3> position;
};

// Breadth first from the first body of every connected part, placed at the origin. Over a contact with arms
// r_a, r_b the position of the other body follows from p_a + r_a = p_b + r_b. The arms of a joint row are
// unknown, so both of its bodies get the same position.
Walk walk(const ContactSystem& A, const std::vector<Link>& links, const std::vector<bool>& include) {
  const std::size_t n = include.size();
  std::vector<bool> is_hub(n);
  for (std::size_t i = 0; i < n; ++i) is_hub[i] = !include[i];
  const Graph g = contact_graph(n, links, is_hub);
  Walk w;
  w.body.reserve(n);
  w.part.reserve(n);
  w.position.reserve(n);
  std::vector<bool> seen = is_hub;
  std::uint32_t part = 0;
  for (std::size_t root = 0; root < n; ++root) {
    if (seen[root]) continue;
    const auto visit = [&](std::uint32_t body, const Vec3& position) {
      seen[body] = true;
      w.body.push_back(body);
      w.part.push_back(part);
      w.position.push_back(position);
    };
    std::size_t next = w.body.size();
    visit(static_cast<std::uint32_t>(root), {0, 0, 0});
    for (; next < w.body.size(); ++next) {
      // w.body is both the queue of the search and its result.
      const std::uint32_t i = w.body[next];
      for (std::uint32_t e = g.first[i]; e < g.first[i + 1]; ++e) {
        const auto [j, link] = g.edges[e];
        if (seen[j]) continue;
        Vec3 position = w.position[next];
        if (link < A.contacts.size()) {
          const ContactGeometry& c = A.contacts[link];
          // p_b = p_a + r_a - r_b: to the point along one arm, and back along the other.
          const double sign = links[link].a == static_cast<Index>(i) ? 1 : -1;
          position += sign * (c.r_a - c.r_b);
        }
        visit(j, position);
      }
    }
    ++part;
  }
  return w;
}

// The same for known positions: one part, in the order of the bodies.
Walk known(const std::vector<Vec3>& centre, const std::vector<bool>& include) {
  Walk w;
  for (std::size_t i = 0; i < include.size(); ++i) {
    if (!include[i]) continue;
    w.body.push_back(static_cast<std::uint32_t>(i));
    w.part.push_back(0);
    w.position.push_back(centre[i]);
  }
  return w;
}

// 14 bits for each axis and 21 for the part fill the 63 of a key. A cell is 1/16384 of the extent, finer than
// the spacing of bodies. Ties are rare; the order of the walk breaks them.
constexpr int cell_bits = 14;
constexpr double last_cell = (1 << cell_bits) - 1;

// Inserts two zero bits between the bits of a cell number: shift and mask with doubled copies, five times.
std::uint64_t spread(std::uint64_t v) {
  v = (v | v << 32) & 0x001f00000000ffff;
  v = (v | v << 16) & 0x001f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f;
  v = (v | v << 4) & 0x10c30c30c30c30c3;
  return (v | v << 2) & 0x1249249249249249;
}

// A place along the curve; equal cells keep the order of the walk, so that sorting has one result.
struct Key {
  std::uint64_t cell;
  std::uint32_t step;
  bool operator<(const Key& other) const {
    return cell != other.cell ? cell < other.cell : step < other.step;
  }
};

// Connected part first, then the Morton code of the cell: bits of x, y and z in turn. Cells are cubes (one
// scale for the three axes); otherwise a flat pile would be cut as finely across as along. If positions
// coincide, or are not finite, all cells are 0 and the order of the walk remains.
std::vector<Key> morton_keys(const Walk& w) {
  Vec3 low, high;
  for (const Vec3& p : w.position)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  const double extent = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  const double scale = extent > 0 && std::isfinite(extent) ? last_cell / extent : 0;
  std::vector<Key> keys(w.body.size());
  for (std::size_t s = 0; s < keys.size(); ++s) {
    std::uint64_t cell = std::uint64_t{std::min(w.part[s], (1u << 21) - 1)} << 3 * cell_bits;
    for (int k = 0; k < 3; ++k) {
      // The comparison excludes NaN, whose conversion would be undefined.
      const double c = scale * (w.position[s][k] - low[k]);
      cell |= spread(c > 0 ? static_cast<std::uint64_t>(std::min(c, last_cell)) : 0) << k;
    }
    keys[s] = {cell, static_cast<std::uint32_t>(s)};
  }
  return keys;
}

// Sorts keys: by their leading bits into buckets first, which threads then sort. Keys differ, so that there
// is one order.
void sort_keys(std::vector<Key>& keys, ThreadPool& pool) {
  constexpr std::size_t buckets = 1024;
  if (keys.size() < 4 * buckets) return std::sort(keys.begin(), keys.end());
  std::uint64_t most = 0;
  for (const Key& key : keys) most = std::max(most, key.cell);
  const int shift = std::max(0, static_cast<int>(std::bit_width(most)) - 10);
  std::vector<std::size_t> first(buckets + 1);
  for (const Key& key : keys) ++first[(key.cell >> shift) + 1];
  for (std::size_t i = 0; i < buckets; ++i) first[i + 1] += first[i];
  std::vector<std::size_t> place(first.begin(), first.end() - 1);
  std::vector<Key> sorted(keys.size());
  for (const Key& key : keys) sorted[place[key.cell >> shift]++] = key;
  const auto at = [&](std::size_t i) { return sorted.begin() + static_cast<std::ptrdiff_t>(i); };
  pool.run(buckets, [&](std::size_t i) { std::sort(at(first[i]), at(first[i + 1])); });
  keys.swap(sorted);
}

}  // namespace

// Ranks along the curve, then the hubs. Immobile bodies get no rank.
BodyOrder order_bodies(const ContactSystem& A, const ContactGraph& graph, const std::vector<bool>& is_hub,
                       ThreadPool& pool) {
  const std::size_t n = is_hub.size();
  std::vector<bool> include(n);
  for (std::size_t i = 0; i < n; ++i) include[i] = graph.moves[i] && !is_hub[i];
  const Walk w = A.bodies.centre.empty() ? walk(A, graph.links, include) : known(A.bodies.centre, include);
  std::vector<Key> keys = morton_keys(w);
  sort_keys(keys, pool);
  BodyOrder order;
  order.rank.assign(n, static_cast<std::uint32_t>(n));
  for (const Key& key : keys) order.moving.push_back(w.body[key.step]);
  for (std::size_t i = 0; i < n; ++i)
    if (is_hub[i]) order.moving.push_back(static_cast<std::uint32_t>(i));
  for (std::size_t r = 0; r < order.moving.size(); ++r)
    order.rank[order.moving[r]] = static_cast<std::uint32_t>(r);
  return order;
}

}  // namespace amontons
