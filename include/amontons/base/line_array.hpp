#pragma once
#include <cstddef>
#include <cstring>
#include <memory>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include "amontons/base/aligned_memory.hpp"

namespace amontons {

// Zeroed memory aligned to cache lines; large arrays use huge pages, without which a pass over many megabytes
// spends much of its time in address translation. Only for numbers and plain structs: nothing is constructed
// or destroyed. It cannot grow and stores no length; the owner does.
template <class T>
class LineArray {
 public:
  LineArray() = default;
  explicit LineArray(std::size_t count) {
    // 2 MiB. For arrays below two pages the padding would waste more than the pages save.
    constexpr std::size_t huge_page = std::size_t{1} << 21;
    const std::size_t bytes = count * sizeof(T), page = bytes >= 2 * huge_page ? huge_page : 64;
    const std::size_t size = (bytes + page - 1) / page * page;  // whole pages, also for madvise()
    void* memory = aligned_allocate(page, size);
    if (!memory) throw std::bad_alloc();
    data_.reset(static_cast<T*>(memory));
    // Before the first touch, which maps the pages. If the system has no free huge page it uses small ones.
#if defined(__linux__)
    if (page == huge_page) madvise(memory, size, MADV_HUGEPAGE);
#endif
    std::memset(memory, 0, size);
  }
  // As for a pointer, a constant array has elements that are not constant; null before it has a size.
  T* data() const { return data_.get(); }
  T& operator[](std::size_t i) const { return data_.get()[i]; }

 private:
  struct Free {
    void operator()(void* p) const { aligned_free(p); }
  };
  std::unique_ptr<T, Free> data_;
};

}  // namespace amontons
