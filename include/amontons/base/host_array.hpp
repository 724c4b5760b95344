#pragma once
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>

namespace amontons {

// Memory of the host from which a device reads: so many bytes, uninitialised. A driver may pin it, so that
// the device copies it by itself. Empty: ordinary memory.
using HostMemory = std::function<std::shared_ptr<void>(std::size_t bytes)>;

// An array in such memory. It keeps the memory where the next size fits, because the first touch of new pages
// costs more than to fill them. `changed` says whether the array differs from what it held before, so that a
// device is sent no more.
template <class T>
class HostArray {
  using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;

 public:
  std::atomic<bool> changed{false};

  // n entries. They are undefined, and the array has changed, if it had another size.
  void resize(std::size_t n, const HostMemory& memory) {
    if (n > capacity_) {
      // A quarter more where it grows: contacts come and go.
      const std::size_t room = capacity_ == 0 ? n : n + n / 4;
      held_ = memory ? memory(room * sizeof(T)) : std::shared_ptr<void>(new T[room], Delete{});
      capacity_ = room;
    }
    changed = n != size_;
    size_ = n;
  }
  std::size_t size() const { return size_; }
  T* data() { return static_cast<T*>(held_.get()); }
  const T* data() const { return static_cast<const T*>(held_.get()); }
  T& operator[](std::size_t i) { return data()[i]; }
  const T& operator[](std::size_t i) const { return data()[i]; }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size_; }
  // Keeps the memory alive.
  const std::shared_ptr<void>& held() const { return held_; }

  // Writes entries, and notes at its end whether one of them differs in a bit. Each thread has its own.
  class Writer {
   public:
    explicit Writer(HostArray& array) : array_(array), at_(array.data()) {}
    ~Writer() {
      if (differs_) array_.changed.store(true, std::memory_order_relaxed);
    }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;
    void operator()(std::size_t i, T value) {
      differs_ |= std::bit_cast<Bits>(at_[i]) != std::bit_cast<Bits>(value);
      at_[i] = value;
    }

   private:
    HostArray& array_;
    T* at_;
    bool differs_ = false;
  };

 private:
  struct Delete {
    void operator()(T* p) const { delete[] p; }
  };
  std::shared_ptr<void> held_;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace amontons
