// Differences of two states, by the bit and not by values: a zero of the other sign is a change.
//
// Sleep needs them twice. An island falls asleep if a step changed none of its entries, and it wakes if
// somebody changed one between two steps (sleep.cpp). A comparison of values would need a tolerance, and a
// body that moves by less than that in each step would stand still.
#pragma once
#include <algorithm>
#include <cstring>
#include <type_traits>
#include <vector>

#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/model/state.hpp"
#include "multibody/contacts/pair_order.hpp"

namespace amontons {

template <class T>
bool same_bits(const T* a, const T* b, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::memcmp(a, b, count * sizeof(T)) == 0;
}

// Calls f(a, b) for all arrays of two states with an entry per body.
template <class F>
bool all_of_bodies(const State& a, const State& b, F&& f) {
  return f(a.positions, b.positions) && f(a.orientations, b.orientations) &&
         f(a.linear_velocities, b.linear_velocities) && f(a.angular_velocities, b.angular_velocities) &&
         f(a.middle_velocities, b.middle_velocities) && f(a.forces, b.forces) && f(a.torques, b.torques) &&
         f(a.held_forces, b.held_forces) && f(a.held_torques, b.held_torques);
}

inline bool same_bodies(const State& a, const State& b, std::size_t first, std::size_t count) {
  return all_of_bodies(a, b, [&](const auto& x, const auto& y) {
    return x.size() >= first + count && y.size() >= first + count && same_bits(&x[first], &y[first], count);
  });
}

// Calls f(i) for every body with other bits in the two states. Most bodies have the same: runs of them are
// compared at once.
template <class F>
void for_each_changed(const State& a, const State& b, F&& f) {
  constexpr std::size_t run = 64;  // not tuned: some kB
  const std::size_t bodies = a.positions.size();
  for (std::size_t first = 0; first < bodies; first += run) {
    const std::size_t count = std::min(run, bodies - first);
    if (same_bodies(a, b, first, count)) continue;
    for (std::size_t i = first; i < first + count; ++i)
      if (!same_bodies(a, b, i, 1)) f(i);
  }
}

inline bool carried_before(const CarriedContact& a, const CarriedContact& b) {
  return pair_of(a) < pair_of(b);
}

inline std::size_t end_of(const std::vector<CarriedContact>& all, std::size_t first) {
  std::size_t end = first;
  while (end < all.size() && pair_of(all[end]) == pair_of(all[first])) ++end;
  return end;
}

// Calls f(body A) for pairs whose contacts differ in two lists that ascend.
template <class F>
void for_each_changed(const Model& model, const std::vector<CarriedContact>& a,
                      const std::vector<CarriedContact>& b, F&& f) {
  constexpr std::size_t run = 16;  // not tuned: 2 kB
  const auto body = [&](const CarriedContact& c) { return model.geom(c.geom_a).body; };
  for (std::size_t i = 0, k = 0; i < a.size() || k < b.size();) {
    if (i + run <= a.size() && k + run <= b.size() && same_bits(&a[i], &b[k], run)) {
      i += run;
      k += run;
    } else if (k == b.size() || (i < a.size() && carried_before(a[i], b[k]))) {
      f(body(a[i++]));
    } else if (i == a.size() || carried_before(b[k], a[i])) {
      f(body(b[k++]));
    } else {
      const std::size_t end_a = end_of(a, i), end_b = end_of(b, k);
      if (end_a - i != end_b - k || !same_bits(&a[i], &b[k], end_a - i)) f(body(a[i]));
      i = end_a;
      k = end_b;
    }
  }
}

// An array may be empty in a state: forces along coordinates are zero then, and no joint has static friction.
//
// Whether `count` entries of two arrays from `first` on are the same. An array that has them on one side only
// is a change.
template <class T>
bool same_part(const std::vector<T>& a, const std::vector<T>& b, std::size_t first, std::size_t count) {
  if (a.size() != b.size()) return false;
  return a.size() < first + count ? a.empty() : same_bits(a.data() + first, b.data() + first, count);
}

// An entry belongs to the joint along which it acts. Those of tendons and couplings belong to none, so that
// bodies under them do not sleep.
//
// Whether all that the state has of joint j is the same, with the controls of its motors and actuators.
inline bool same_joints(const Model& model, const State& a, const State& b, std::size_t j) {
  const std::size_t first = model.first_dof(j), count = model.first_dof(j + 1) - first;
  const auto same_control = [&](Index k) {
    const auto at = static_cast<std::size_t>(k);
    return k < 0 ||
           (same_part(a.controls, b.controls, at, 1) && same_part(a.held_controls, b.held_controls, at, 1));
  };
  const auto same_actuator = [&](Index k) {
    const auto at = static_cast<std::size_t>(k);
    return same_control(k) && same_part(a.activations, b.activations, at, 1) &&
           same_part(a.actuator_impulses, b.actuator_impulses, at, 1);
  };
  const auto same_drives = [&](std::size_t dof) {
    const std::vector<Index>& actuators = model.actuators_of_dof(dof);
    return same_control(model.control_of_dof(dof)) &&
           std::all_of(actuators.begin(), actuators.end(), same_actuator);
  };
  bool same = same_part(a.joint_wrenches, b.joint_wrenches, j, 1) &&
              same_part(a.joint_slips, b.joint_slips, j, 1) &&
              same_part(a.ball_impulses, b.ball_impulses, j, 1) &&
              same_part(a.coordinates, b.coordinates, first, count) &&
              same_part(a.dof_impulses, b.dof_impulses, first, count) &&
              same_part(a.dof_slips, b.dof_slips, first, count);
  for (std::size_t dof = first; same && dof < first + count; ++dof) same = same_drives(dof);
  return same;
}

// A force along a coordinate acts on the body that the coordinate moves, and the opposite one on the body
// relative to which it moves. Few users set such forces, so that the arrays are compared as a whole first.
//
// Calls f(body) for both.
template <class F>
void for_each_pushed(const Tree& tree, const State& a, const State& b, F&& f) {
  if (same_part(a.joint_forces, b.joint_forces, 0, tree.nv()) &&
      same_part(a.held_joint_forces, b.held_joint_forces, 0, tree.nv()))
    return;
  for (const Link& link : tree.links()) {
    if (same_part(a.joint_forces, b.joint_forces, link.first_v, link.v) &&
        same_part(a.held_joint_forces, b.held_joint_forces, link.first_v, link.v))
      continue;
    f(link.body);
    if (link.parent >= 0) f(link.parent);
  }
}

}  // namespace amontons
