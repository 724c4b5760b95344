// Private: an order of bodies in which neighbours in space are near each other in memory.
#pragma once
#include <cstdint>
#include <vector>

#include "amontons/base/threads.hpp"
#include "amontons/problem/contact_graph.hpp"

namespace amontons {

// Bodies that impulses move, in the order in which the passes visit them.
struct BodyOrder {
  std::vector<std::uint32_t> rank;    // per body; fixed bodies have the number of bodies as rank
  std::vector<std::uint32_t> moving;  // rank -> body
};

// Orders along a Morton curve through the centres of mass, known or recovered. Hubs, bodies with very many
// contacts, connect distant parts: they are excluded from the graph and come last.
// The pool is for sorting; the order does not depend on it.
BodyOrder order_bodies(const ContactSystem& A, const ContactGraph& graph, const std::vector<bool>& is_hub,
                       ThreadPool& pool);

}  // namespace amontons
