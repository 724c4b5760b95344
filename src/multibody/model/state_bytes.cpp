#include "amontons/multibody/model/state_bytes.hpp"

#include <cstring>
#include <tuple>
#include <type_traits>

#include "amontons/base/error.hpp"

namespace amontons {
namespace {

// References to all fields. The list of names has as many entries as State has fields, or it does not
// compile: a new field cannot be forgotten.
template <class S>
auto fields_of(S& state) {
  auto& [time, steps, impulse_step, positions, orientations, linear, angular, forces, torques, coordinates,
         controls, joint_forces, activations, actuators, contacts, wrenches, slips, dofs, balls, couplings,
         tendons] = state;
  return std::tie(time, steps, impulse_step, positions, orientations, linear, angular, forces, torques,
                  coordinates, controls, joint_forces, activations, actuators, contacts, wrenches, slips,
                  dofs, balls, couplings, tendons);
}

constexpr std::uint64_t magic = 0x31657461746d61ULL;  // "amtate1", the version of this layout

// 64 bits of FNV-1a (Fowler, Noll, Vo), against damage.
std::uint64_t checksum(std::span<const std::byte> bytes) {
  std::uint64_t sum = 14695981039346656037ULL;
  for (const std::byte b : bytes) sum = (sum ^ std::to_integer<std::uint64_t>(b)) * 1099511628211ULL;
  return sum;
}

struct ByteWriter {
  std::vector<std::byte> bytes;

  void raw(const void* data, std::size_t size) {
    const auto* first = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), first, first + size);
  }
  template <class T>
  void operator()(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    raw(&value, sizeof value);
  }
  template <class T>
  void operator()(const std::vector<T>& list) {
    static_assert(std::is_trivially_copyable_v<T>);
    (*this)(std::uint64_t{sizeof(T)});
    (*this)(std::uint64_t{list.size()});
    if (!list.empty()) raw(list.data(), list.size() * sizeof(T));
  }
};

struct ByteReader {
  std::span<const std::byte> bytes;

  void raw(void* data, std::size_t size) {
    AMONTONS_REQUIRE(size <= bytes.size(), "state: the bytes are cut off");
    if (size > 0) std::memcpy(data, bytes.data(), size);
    bytes = bytes.subspan(size);
  }
  template <class T>
  void operator()(T& value) {
    raw(&value, sizeof value);
  }
  template <class T>
  void operator()(std::vector<T>& list) {
    std::uint64_t width = 0, count = 0;
    (*this)(width);
    (*this)(count);
    // Contacts alone vary in number.
    AMONTONS_REQUIRE(width == sizeof(T) && count <= bytes.size() / sizeof(T) &&
                         (std::is_same_v<T, Contact> || count == list.size()),
                     "state: the bytes are those of another model or version");
    list.resize(count);
    raw(list.data(), count * sizeof(T));
  }
};

}  // namespace

std::vector<std::byte> state_to_bytes(const State& state) {
  ByteWriter content, all;
  std::apply([&](const auto&... field) { (content(field), ...); }, fields_of(state));
  all(magic);
  all(checksum(content.bytes));
  all.raw(content.bytes.data(), content.bytes.size());
  return std::move(all.bytes);
}

void state_from_bytes(std::span<const std::byte> bytes, State& state) {
  ByteReader read{bytes};
  std::uint64_t begin = 0, sum = 0;
  read(begin);
  AMONTONS_REQUIRE(begin == magic, "state: these are no bytes of a state of this version");
  read(sum);
  AMONTONS_REQUIRE(sum == checksum(read.bytes), "state: the bytes are damaged");
  State found = state;
  std::apply([&](auto&... field) { (read(field), ...); }, fields_of(found));
  AMONTONS_REQUIRE(read.bytes.empty(), "state: the bytes are those of another model or version");
  state = std::move(found);
}

}  // namespace amontons
