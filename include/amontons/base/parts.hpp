#pragma once
#include <algorithm>
#include <cstddef>

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

}  // namespace amontons
