#pragma once
#include <algorithm>
#include <array>
#include <vector>

#include "amontons/base/parts.hpp"
#include "amontons/multibody/joints/rows.hpp"
#include "amontons/multibody/model/state.hpp"
#include "amontons/problem/contact.hpp"

namespace amontons {

// Two geoms, with the bodies that carry them.
struct GeomPair {
  Index body_a, body_b, geom_a, geom_b;
  auto operator<=>(const GeomPair&) const = default;
};

// Squares of the natural maps of x and of zero impulses. Both sum over blocks, and so over islands: the sums
// over some islands give the residual of these together.
struct SquaredMaps {
  double map = 0, at_zero = 0;
  void add(const SquaredMaps& other) {
    map += other.map;
    at_zero += other.at_zero;
  }
  double residual() const;  // that of two zeros is zero
};

// Bodies, and the geoms on them, that the stages of a step visit: so its cost follows those awake. Those left
// out are asleep, and arrays of the stages hold their data. These have the bits of the last step, because all
// that they depend on has: poses, loads and velocities. Their velocities after a step are zero, as are those
// at its start, so that they add nothing to energies, errors and largest speeds.
struct Visited {
  Subset bodies, geoms;
};

// Islands that a step leaves out, because their result is that of the last step to the bit (step/sleep.hpp).
// No contact and no joint joins two of them.
struct Sleepers {
  struct Group {
    SquaredMaps maps;  // of their impulses
    bool sleeps = true;
  };
  // An impulse along a joint, and a body that the joint holds.
  struct Known {
    Index body;
    KnownImpulse impulse;
  };
  // The impulse of all contacts and rows on a body of a tree: force and torque, as ContactSystem sums it.
  struct Push {
    Index body;
    std::array<double, 6> impulse;
  };
  std::uint64_t number = 0;  // of this set of islands: no other one of the process has it
  // The bodies that a step visits, and the geoms on them: those awake, and those with joints. Loads along
  // joints and the rates of trees follow for all joints together.
  std::vector<Index> visited_bodies, visited_geoms;
  std::vector<Group> groups;
  std::vector<Index> group;          // per body, -1: awake; empty: nothing sleeps
  std::vector<unsigned char> stays;  // per body: asleep, or impulses do not move it and it did not move
  std::vector<unsigned char> bears;  // per body that impulses do not move: something asleep touches it
  std::vector<Contact> contacts;  // of the islands, ascending by pairs, with the results of their last step
  std::vector<CarriedContact> carried;  // the same in the state
  std::vector<unsigned char> joints;    // per joint: a body of it is asleep
  std::vector<Known> efforts, rows;     // impulses along them, without and with rows
  std::vector<Push> pushes;
  // The rule for closed contacts of the step that they fell asleep in (Assembly).
  double closing = 0, slack = 0;
  // Parts of the contacts in sums over the whole scene.
  double overlap = 0;      // m, the largest of rigid ones
  double penetration = 0;  // m, of all
  SquaredMaps maps;

  bool have(double closing_now, double slack_now) const {
    return !any() || (closing == closing_now && slack == slack_now);
  }
  bool any() const { return !group.empty(); }
  Visited visited() const { return any() ? Visited{{&visited_bodies}, {&visited_geoms}} : Visited{}; }
  std::size_t bodies() const {
    return static_cast<std::size_t>(
        std::count_if(group.begin(), group.end(), [](Index g) { return g >= 0; }));
  }
  bool contains(Index body) const { return body >= 0 && any() && group[static_cast<std::size_t>(body)] >= 0; }
  bool touches(const Contact& c) const { return contains(c.body_a) || contains(c.body_b); }
};

}  // namespace amontons
