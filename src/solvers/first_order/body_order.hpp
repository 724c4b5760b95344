// Private: bodies in an order in which those that touch are near each other.
#pragma once
#include <cstdint>
#include <vector>

#include "amontons/problem/contact_graph.hpp"

namespace amontons {

// Bodies that impulses move, in the order in which the passes shall touch them.
struct BodyOrder {
  std::vector<std::uint32_t> rank;    // per body; fixed bodies have the rank of no one, the number of bodies
  std::vector<std::uint32_t> moving;  // rank -> body
};

// Along a Morton curve through the centres of mass, known or recovered. Hubs, bodies with very many contacts,
// tie distant parts together: they are left out of the graph and come last.
BodyOrder order_bodies(const ContactSystem& A, const ContactGraph& graph, const std::vector<bool>& is_hub);

}  // namespace amontons
