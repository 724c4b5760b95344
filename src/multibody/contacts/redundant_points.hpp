// Contact points that need no rows of their own while the others carry the pair.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "amontons/collision/narrow/support_points.hpp"
#include "multibody/contacts/pair_order.hpp"
#include "multibody/contacts/reach.hpp"

namespace amontons {

// Deepest overlap at the end of the step among the contacts of the keys: the least gap, at most 0.
double deepest(const std::vector<Contact>& contacts, std::span<const PairKey> keys, const Reach& reach);

// A hull or a triangle surface gives one point per corner. Points that are redundant beside others of their
// pair, and points that the free velocities keep out of reach, are removed before the solve. After it, those
// that overlap with the solved velocities are added again. So an omitted point never has a visible effect.
class RedundantPoints {
 public:
  // Moves the redundant points of `contacts`, which are ordered by pairs, to the internal list.
  void set_aside(const Reach& reach, std::vector<Contact>& contacts);
  // Appends the redundant points that overlap at the end of the step; reach.v are the solved velocities.
  void call_in(const Reach& reach, std::vector<Contact>& contacts);
  // Appends the needed points of one pair and stores the others.
  void add(const Reach& reach, std::span<const Contact> found, std::vector<Contact>& contacts);

 private:
  // Marks in needed_ the needed ones of the contacts of one pair, by groups of about equal normal.
  void choose(const Reach& reach, std::span<const Contact> contacts);

  std::vector<Contact> redundant_, called_;
  SupportPoints support_;
  std::vector<PairKey> by_pair_;
  std::vector<SupportPoint> points_;
  std::vector<std::uint32_t> group_;
  std::vector<unsigned char> needed_, kept_, grouped_;
};

}  // namespace amontons
