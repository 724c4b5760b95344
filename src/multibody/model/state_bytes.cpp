#include "amontons/multibody/model/state_bytes.hpp"

#include <algorithm>
#include <cstring>
#include <tuple>
#include <type_traits>
#include <utility>

#include "amontons/base/error.hpp"

namespace amontons {
namespace {

// References to all fields. The list of names has as many entries as State has fields, or it does not
// compile: a new field cannot be forgotten.
template <class S>
auto fields_of(S& state) {
  auto& [time, steps, impulse_step, last_step, positions, orientations, linear, angular, middle, forces,
         torques, coordinates, controls, joint_forces, held_forces, held_torques, held_controls, held_joints,
         activations, actuators, contacts, wrenches, slips, dofs, balls, couplings, tendons, dof_slips, rubs,
         bonds] = state;
  return std::tie(time, steps, impulse_step, last_step, positions, orientations, linear, angular, middle,
                  forces, torques, coordinates, controls, joint_forces, held_forces, held_torques,
                  held_controls, held_joints, activations, actuators, contacts, wrenches, slips, dofs, balls,
                  couplings, tendons, dof_slips, rubs, bonds);
}

// The first number of the bytes. A processor that stores numbers in the reverse order reads another one.
constexpr std::uint64_t magic = 0x33657461746d61ULL;  // "amtate3", the version of this layout

// 64 bits of FNV-1a (Fowler, Noll, Vo), against damage. One changed byte is found for certain: each round is
// a bijection of the sum, because the prime is odd. So two sums that differ after one byte also differ after
// all equal bytes that follow. It protects against accidents and not against forgery, for which there is no
// key.
std::uint64_t checksum(std::span<const std::byte> bytes) {
  std::uint64_t sum = 14695981039346656037ULL;
  for (const std::byte b : bytes) sum = (sum ^ std::to_integer<std::uint64_t>(b)) * 1099511628211ULL;
  return sum;
}

// A number is its bytes. An array is the size of an entry, the number of entries, and the bytes of all
// entries. Entries keep the gaps that the compiler leaves between their members. Another compiler may leave
// others; most of these differences change the size of an entry, which the reader compares.
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

// The reverse. The bytes may come from anywhere. So each size that they state is compared with the number of
// bytes that are left, before memory is allocated or anything is copied. A wrong size can then cost no more
// memory than the bytes themselves, and no read passes their end.
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
    // Contacts alone vary in number. All other arrays have an entry per body, joint, dof and so on, and the
    // step reads them by indices of the model without a check.
    AMONTONS_REQUIRE(width == sizeof(T) && count <= bytes.size() / sizeof(T) &&
                         (std::is_same_v<T, CarriedContact> || count == list.size()),
                     "state: the bytes are those of another model or version");
    list.resize(count);
    raw(list.data(), count * sizeof(T));
  }
};

template <class T>
bool same_bits(const T& a, const T& b) {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}
template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  static_assert(std::is_trivially_copyable_v<T>);
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

template <class T>
void copy_field(const T& from, T& to) {
  to = from;
}
template <class T>
void copy_field(const std::vector<T>& from, std::vector<T>& to) {
  constexpr std::size_t run = std::max<std::size_t>(1, 1024 / sizeof(T));  // not tuned: about 1 kB
  if (from.size() <= run || from.size() != to.size()) return void(to = from);
  for (std::size_t first = 0; first < from.size(); first += run) {
    const std::size_t bytes = std::min(run, from.size() - first) * sizeof(T);
    if (std::memcmp(&from[first], &to[first], bytes) != 0) std::memcpy(&to[first], &from[first], bytes);
  }
}

template <std::size_t... Fields>
void copy_fields(const State& from, State& to, std::index_sequence<Fields...>) {
  (copy_field(std::get<Fields>(fields_of(from)), std::get<Fields>(fields_of(to))), ...);
}

// Time and the number of steps are the first two fields.
template <std::size_t... Fields>
bool same_after_time(const State& a, const State& b, std::index_sequence<Fields...>) {
  return (same_bits(std::get<Fields + 2>(fields_of(a)), std::get<Fields + 2>(fields_of(b))) && ...);
}

}  // namespace

// Bits and not values are compared: a zero of the other sign, or a number that is not one, is a change. The
// order is that of the fields, so that the pose of the first body ends the comparison of a scene in motion.
bool differ_in_time_alone(const State& a, const State& b) {
  return same_after_time(a, b, std::make_index_sequence<std::tuple_size_v<decltype(fields_of(a))> - 2>());
}

void copy_changes(const State& from, State& to) {
  copy_fields(from, to, std::make_index_sequence<std::tuple_size_v<decltype(fields_of(from))>>());
}

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
  // The bytes go into a copy, so that a state that is refused in the middle of them has changed nothing.
  State found = state;
  std::apply([&](auto&... field) { (read(field), ...); }, fields_of(found));
  AMONTONS_REQUIRE(read.bytes.empty(), "state: the bytes are those of another model or version");
  state = std::move(found);
}

}  // namespace amontons
