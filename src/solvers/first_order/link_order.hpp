// Private: contacts and rows in the order in which the passes meet the bodies.
#pragma once
#include <cstdint>
#include <vector>

#include "amontons/problem/contact_graph.hpp"
#include "solvers/first_order/body_order.hpp"

namespace amontons {

// Bodies with more contacts than batches would bear; the order of bodies comes with them last.
std::vector<bool> find_hubs(std::size_t bodies, const std::vector<ContactGraph::Link>& links,
                            std::size_t contacts);

// The rank by which a contact or row is sorted: of its first body that is not a hub. Sorted so, contacts of
// one body come in a row and its line is in the cache; a hub has a say only where there is no other body.
// The number of moving bodies for links without any.
std::uint32_t sort_rank(const ContactGraph::Link& link, const BodyOrder& order,
                        const std::vector<bool>& is_hub);

// Indices first .. last - 1 of `links` sorted by rank, stable; start[r]: the place where rank r begins. A
// counting sort: linear time, and ties stay in the order of the problem.
struct Sorted {
  std::vector<std::uint32_t> index, start;
};
Sorted sort_by_rank(const std::vector<std::uint32_t>& rank, std::size_t first, std::size_t last,
                    std::size_t ranks);

}  // namespace amontons
