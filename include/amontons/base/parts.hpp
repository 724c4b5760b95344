#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "amontons/base/threads.hpp"

namespace amontons {

// Size (entries) of the parts that threads share in passes over bodies or contacts: 100 us, long beside the
// hand-over to a thread.
inline constexpr std::size_t pass_size = 2048;  // not tuned: see above

// Calls f(k, first, last) for the parts [first, last) of `count` entries, each of `size`, on up to `asked`
// threads (0: one per core). A single thread gets all entries as part 0. Returns the number of parts, at most
// count / size + 1. Results do not depend on the number of threads if f writes to its entries alone. That
// holds too if f writes to its part, and the caller joins the parts in their order.
template <class F>
std::size_t for_parts(unsigned asked, std::size_t count, std::size_t size, F&& f) {
  const std::size_t parts = (count + size - 1) / size;
  const unsigned threads = automatic_threads(asked, parts);
  if (threads == 1) {
    f(std::size_t{0}, std::size_t{0}, count);
    return 1;
  }
  PoolLease(threads)->run(parts, [&](std::size_t k) { f(k, k * size, std::min(count, (k + 1) * size)); });
  return parts;
}

// Calls f(i) for all entries of a pass, which write to their own data alone.
template <class F>
void for_entries(unsigned asked, std::size_t count, F&& f) {
  for_parts(asked, count, pass_size, [&](std::size_t, std::size_t i, std::size_t last) {
    for (; i < last; ++i) f(i);
  });
}

// The entries that passes visit: those of an ascending list, or all. Passes over a part of an array leave the
// other entries as they are, so that an array in which few entries change costs as much as these. A sum over
// a part is that over all, to the bit, if the others would add zeros: the order of the terms is the same.
struct Subset {
  const std::vector<std::int32_t>* only = nullptr;  // null: all

  // How many entries of `count` are visited, and the k-th of them.
  std::size_t size(std::size_t count) const { return only ? only->size() : count; }
  std::size_t at(std::size_t k) const { return only ? static_cast<std::size_t>((*only)[k]) : k; }
  // Calls f(i) for each.
  template <class F>
  void each(std::size_t count, F&& f) const {
    for (std::size_t k = 0, end = size(count); k < end; ++k) f(at(k));
  }
  template <class F>
  void each(std::size_t count, F&& f, unsigned threads) const {
    for_entries(threads, size(count), [&](std::size_t k) { f(at(k)); });
  }
};

}  // namespace amontons
