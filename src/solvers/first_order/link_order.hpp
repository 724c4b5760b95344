// Private: contacts and rows in the order in which the passes visit the bodies.
#pragma once
#include <cstdint>
#include <vector>

#include "amontons/problem/contact_graph.hpp"
#include "solvers/first_order/body_order.hpp"

namespace amontons {

// Bodies with too many contacts for batches; the order of bodies has them last.
std::vector<bool> find_hubs(std::size_t bodies, const std::vector<ContactGraph::Link>& links,
                            std::size_t contacts);

// The rank by which a contact or row is sorted: that of its first body that is not a hub. Contacts of one
// body are then adjacent and its line is in the cache. A hub counts only if there is no other body. Links
// without a moving body have the number of moving bodies as rank.
std::uint32_t sort_rank(const ContactGraph::Link& link, const BodyOrder& order,
                        const std::vector<bool>& is_hub);

// Indices first .. last - 1 of `links` sorted by rank; start[r]: the begin of rank r. The counting sort takes
// linear time and keeps ties in the order of the problem.
struct Sorted {
  std::vector<std::uint32_t> index, start;
};
Sorted sort_by_rank(const std::vector<std::uint32_t>& rank, std::size_t first, std::size_t last,
                    std::size_t ranks);

}  // namespace amontons
