#pragma once
#include <algorithm>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "amontons/problem/contact.hpp"

namespace amontons {

// The geoms of a contact of this step, or of one carried over from the last one.
inline std::pair<Index, Index> pair_of(const auto& c) { return {c.geom_a, c.geom_b}; }

// For contacts ordered by pairs: the end of the pair that begins at `first`.
inline std::size_t end_of_pair(const std::vector<Contact>& contacts, std::size_t first) {
  std::size_t end = first + 1;
  while (end < contacts.size() && pair_of(contacts[end]) == pair_of(contacts[first])) ++end;
  return end;
}

// Position of a contact in a list. Records of contacts are large, so their keys are sorted.
struct PairKey {
  std::pair<Index, Index> pair;
  std::uint32_t contact;
  bool operator<(const PairKey& o) const { return std::tie(pair, contact) < std::tie(o.pair, o.contact); }
};

// Sorts by pair in linear time and stably: by the second geom, then by the first. The least number of a geom
// is -1, that of contacts made without geoms. `sorted` and `start` are scratch.
inline void sort_stably(std::vector<PairKey>& keys, std::vector<PairKey>& sorted,
                        std::vector<std::uint32_t>& start) {
  Index last = 0;
  for (const PairKey& key : keys) last = std::max({last, key.pair.first, key.pair.second});
  sorted.resize(keys.size());
  const auto pass = [&](auto geom, const std::vector<PairKey>& from, std::vector<PairKey>& to) {
    start.assign(static_cast<std::size_t>(last + 3), 0);
    for (const PairKey& key : from) ++start[static_cast<std::size_t>(geom(key) + 2)];
    for (std::size_t g = 1; g < start.size(); ++g) start[g] += start[g - 1];
    for (const PairKey& key : from) to[start[static_cast<std::size_t>(geom(key) + 1)]++] = key;
  };
  pass([](const PairKey& key) { return key.pair.second; }, keys, sorted);
  pass([](const PairKey& key) { return key.pair.first; }, sorted, keys);
}

// Keys of the contacts that satisfy keep(i), sorted by pair. Within a pair they keep the order of discovery,
// so that results do not depend on the sort.
template <class Keep>
void sort_by_pair(const std::vector<Contact>& contacts, std::vector<PairKey>& keys, Keep&& keep) {
  static thread_local std::vector<PairKey> sorted;  // kept: a step allocates nothing
  static thread_local std::vector<std::uint32_t> start;
  keys.clear();
  for (std::uint32_t i = 0; i < contacts.size(); ++i)
    if (keep(i)) keys.push_back({pair_of(contacts[i]), i});
  if (!std::is_sorted(keys.begin(), keys.end())) sort_stably(keys, sorted, start);
}

// The keys of one pair, from the keys of all.
inline auto keys_of(const std::vector<PairKey>& keys, std::pair<Index, Index> pair) {
  return std::equal_range(keys.begin(), keys.end(), PairKey{pair, 0},
                          [](const PairKey& a, const PairKey& b) { return a.pair < b.pair; });
}

}  // namespace amontons
