#include "solvers/first_order/link_order.hpp"

#include <algorithm>

#include "solvers/first_order/pass_data.hpp"

namespace amontons {

using Link = ContactGraph::Link;

// A batch contains a body at most once, so a body needs as many batches as it has contacts. The ground box of
// a pile would leave seven of eight lanes inert. If a body needs more batches than all contacts fill, it is a
// hub: it gets a line for each of the eight lanes, and causes no conflict. The limit is at least 8, the lines
// that a hub takes, and at most 64, two rings of batches.
std::vector<bool> find_hubs(std::size_t bodies, const std::vector<Link>& links, std::size_t contacts) {
  std::vector<std::uint32_t> degree(bodies);
  for (std::size_t k = 0; k < contacts; ++k) {
    if (links[k].a >= 0) ++degree[links[k].a];
    if (links[k].b >= 0) ++degree[links[k].b];
  }
  const std::size_t limit = std::clamp<std::size_t>(contacts / lanes, 8, 64);
  std::vector<bool> is_hub(bodies);
  for (std::size_t i = 0; i < bodies; ++i) is_hub[i] = degree[i] > limit;
  return is_hub;
}

std::uint32_t sort_rank(const Link& link, const BodyOrder& order, const std::vector<bool>& is_hub) {
  const auto none = static_cast<std::uint32_t>(order.moving.size());
  std::uint32_t best = none, hub = none;
  for (Index i : {link.a, link.b})
    if (i >= 0) (is_hub[i] ? hub : best) = std::min(is_hub[i] ? hub : best, order.rank[i]);
  return best != none ? best : hub;
}

Sorted sort_by_rank(const std::vector<std::uint32_t>& rank, std::size_t first, std::size_t last,
                    std::size_t ranks) {
  Sorted s;
  s.start.assign(ranks + 1, 0);
  for (std::size_t k = first; k < last; ++k) ++s.start[rank[k] + 1];
  for (std::size_t r = 0; r < ranks; ++r) s.start[r + 1] += s.start[r];
  s.index.resize(last - first);
  std::vector<std::uint32_t> place(s.start.begin(), s.start.end() - 1);
  for (std::size_t k = first; k < last; ++k) s.index[place[rank[k]]++] = static_cast<std::uint32_t>(k);
  return s;
}

}  // namespace amontons
