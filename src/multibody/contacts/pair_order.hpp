#pragma once
#include <algorithm>
#include <compare>
#include <cstdint>
#include <utility>
#include <vector>

#include "amontons/problem/contact.hpp"

namespace amontons {

inline std::pair<Index, Index> pair_of(const Contact& c) { return {c.geom_a, c.geom_b}; }

// Of contacts that come pair by pair, the end of those of one pair that begin at `first`.
inline std::size_t end_of_pair(const std::vector<Contact>& contacts, std::size_t first) {
  std::size_t end = first + 1;
  while (end < contacts.size() && pair_of(contacts[end]) == pair_of(contacts[first])) ++end;
  return end;
}

// Where a contact stands among others. Records of contacts are large: what is sorted are their keys.
struct PairKey {
  std::pair<Index, Index> pair;
  std::uint32_t contact;
  auto operator<=>(const PairKey&) const = default;
};

// The keys of the contacts for which keep(i), pair by pair, those of one pair in the order of their
// discovery: results shall not depend on the sort.
template <class Keep>
void sort_by_pair(const std::vector<Contact>& contacts, std::vector<PairKey>& keys, Keep&& keep) {
  keys.clear();
  for (std::uint32_t i = 0; i < contacts.size(); ++i)
    if (keep(i)) keys.push_back({pair_of(contacts[i]), i});
  if (!std::is_sorted(keys.begin(), keys.end())) std::sort(keys.begin(), keys.end());
}

// The keys of one pair among those of many.
inline auto keys_of(const std::vector<PairKey>& keys, std::pair<Index, Index> pair) {
  return std::equal_range(keys.begin(), keys.end(), PairKey{pair, 0},
                          [](const PairKey& a, const PairKey& b) { return a.pair < b.pair; });
}

}  // namespace amontons
