// Contact points that need no rows of their own, as long as nobody comes near them.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "amontons/collision/narrow/support_points.hpp"
#include "multibody/contacts/pair_order.hpp"
#include "multibody/contacts/reach.hpp"

namespace amontons {

// How deep those of the contacts that the keys name overlap at the end of the step: the least gap, at most 0.
double deepest(const std::vector<Contact>& contacts, std::span<const PairKey> keys, const Reach& reach);

// A hull or a surface of triangles gives a point per corner. Those that say nothing beside the others of
// their pair, and those that the free velocities keep out of reach, are set aside before the solve, and
// looked at after it: whichever the velocities bring to overlap all the same comes back. What is left out can
// so never be felt.
class RedundantPoints {
 public:
  // Moves the spare ones of `contacts`, which come pair by pair, to this list.
  void set_aside(const Reach& reach, std::vector<Contact>& contacts);
  // Appends those that overlap at the end of the step, reach.v being the velocities that were solved for.
  void call_in(const Reach& reach, std::vector<Contact>& contacts);
  // Appends what is needed of points of one pair, and sets the others aside.
  void add(const Reach& reach, std::span<const Contact> found, std::vector<Contact>& contacts);

 private:
  // Marks in needed_ which of contacts[first, last) of one pair are, group by group of about one normal.
  void choose(const Reach& reach, std::span<const Contact> contacts);

  std::vector<Contact> spare_, called_;
  SupportPoints support_;
  std::vector<PairKey> by_pair_;
  std::vector<SupportPoint> points_;
  std::vector<std::uint32_t> group_;
  std::vector<unsigned char> needed_, kept_, grouped_;
};

}  // namespace amontons
