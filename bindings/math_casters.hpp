#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>

#include <array>
#include <utility>

#include "amontons/base/math.hpp"

// Vectors, quaternions, matrices and transforms as (nested) sequences of floats, in both directions.
namespace nanobind::detail {

template <class Value_, class Plain>
struct plain_caster {
  NB_TYPE_CASTER(Value_, make_caster<Plain>::Name)

  bool from_python(handle source, uint32_t flags, cleanup_list* cleanup) noexcept {
    make_caster<Plain> plain;
    if (!plain.from_python(source, flags, cleanup)) return false;
    from_plain(plain.operator cast_t<Plain>(), value);
    return true;
  }
  static handle from_cpp(const Value_& value, rv_policy policy, cleanup_list* cleanup) noexcept {
    return make_caster<Plain>::from_cpp(to_plain(value), policy, cleanup);
  }

 private:
  using Three = std::array<double, 3>;
  using Four = std::array<double, 4>;
  static void from_plain(const Three& p, amontons::Vec3& v) { v = amontons::to_vec3(p); }
  static void from_plain(const Four& p, amontons::Quat& q) { q = {p[0], p[1], p[2], p[3]}; }
  static void from_plain(const std::array<Three, 3>& p, amontons::Mat3& m) {
    for (int i = 0; i < 3; ++i) m.row[i] = amontons::to_vec3(p[i]);
  }
  static void from_plain(const std::pair<Three, Four>& p, amontons::Transform& t) {
    from_plain(p.first, t.position);
    from_plain(p.second, t.rotation);
  }
  static Three to_plain(const amontons::Vec3& v) { return v.array(); }
  static Four to_plain(const amontons::Quat& q) { return {q.w, q.x, q.y, q.z}; }
  static std::array<Three, 3> to_plain(const amontons::Mat3& m) {
    return {m.row[0].array(), m.row[1].array(), m.row[2].array()};
  }
  static std::pair<Three, Four> to_plain(const amontons::Transform& t) {
    return {to_plain(t.position), to_plain(t.rotation)};
  }
};

template <>
struct type_caster<amontons::Vec3> : plain_caster<amontons::Vec3, std::array<double, 3>> {};
template <>
struct type_caster<amontons::Quat> : plain_caster<amontons::Quat, std::array<double, 4>> {};
template <>
struct type_caster<amontons::Mat3> : plain_caster<amontons::Mat3, std::array<std::array<double, 3>, 3>> {};
template <>
struct type_caster<amontons::Transform>
    : plain_caster<amontons::Transform, std::pair<std::array<double, 3>, std::array<double, 4>>> {};

}  // namespace nanobind::detail
