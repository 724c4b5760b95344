#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#if defined(_WIN32)
#include <malloc.h>
#endif

namespace amontons {

// Memory at a multiple of `alignment`, a power of two; null if there is none. On Windows such memory has its
// own pair of functions: std::free() would not take it back.
inline void* aligned_allocate(std::size_t alignment, std::size_t size) {
  // A multiple of the alignment, as aligned_alloc() requires, and never zero.
  const std::size_t whole = std::max((size + alignment - 1) / alignment * alignment, alignment);
#if defined(_WIN32)
  return _aligned_malloc(whole, alignment);
#else
  return std::aligned_alloc(alignment, whole);
#endif
}

inline void aligned_free(void* memory) {
#if defined(_WIN32)
  _aligned_free(memory);
#else
  std::free(memory);
#endif
}

}  // namespace amontons
