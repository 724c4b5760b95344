// Finds the points of geoms that may touch within a step.
#pragma once
#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "amontons/base/parts.hpp"
#include "amontons/collision/broad_phase.hpp"
#include "amontons/collision/pairs/collide.hpp"
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/contact.hpp"
#include "multibody/contacts/internal_edges.hpp"
#include "multibody/contacts/near_pairs.hpp"
#include "multibody/contacts/pair_order.hpp"
#include "multibody/contacts/redundant_points.hpp"
#include "multibody/contacts/standing_pairs.hpp"

namespace amontons {

// Memory of the searches of a simulation. The searches of one step belong together: those after a solve use
// the geom poses of the first one. Contacts are complete except for the results of a solve; body A is
// dynamic.
class ContactFinder {
 public:
  // All contact points within the margin, or that the velocities bring there within h, except redundant ones
  // and those at internal edges.
  void find(const Reach& reach, std::vector<Contact>& contacts);
  // Appends contacts of the velocities v of a solve that the first search did not predict: an impact gives
  // bodies velocities that are not known before.
  void find_unforeseen(const Reach& reach, std::vector<Contact>& contacts);
  // Appends the points at which v, of an unsolved step, leads through fixed geometry. It considers all fixed
  // geometry, because the contacts on which redundant points and internal edges rely may not hold.
  void find_fixed(const Reach& reach, std::vector<Contact>& contacts);
  // Bodies asleep that the searches of this step found in reach of others.
  const std::vector<Index>& disturbed() const { return disturbed_; }
  // The terms of b (m/s, in the rows of each contact) of points that turn within the step that v leads
  // through; zero below `least`. The only contact of its pair has one, and each of a rim.
  void find_turns(const Reach& reach, const std::vector<Contact>& contacts, double least,
                  std::vector<Vec3>& turns);

 private:
  // Results of one part of a search, and the memory of the thread that makes them.
  struct Part {
    std::vector<ContactPoint> points;
    std::vector<Contact> contacts;
    StandingPairs::Kept kept;
    std::vector<std::size_t> deep;  // places in by_pair_ of pairs that overlap
    std::vector<std::optional<ContactPoint>> matched;
  };
  // Size (entries) of the parts that threads share.
  static constexpr std::size_t part_size = 1024;  // not tuned: 100 us, long beside the hand-over to a thread
  // Calls f(part, first, last) for all parts of `count` entries. Returns the parts, at least one.
  template <class F>
  std::span<Part> in_parts(const Reach& reach, std::size_t count, F&& f) {
    parts_.resize(std::max(parts_.size(), count / part_size + 1));
    const std::size_t parts =
        for_parts(reach.threads, count, part_size,
                  [&](std::size_t k, std::size_t first, std::size_t last) { f(parts_[k], first, last); });
    return std::span(parts_).first(parts);
  }
  // Poses of the bodies later in the step, in later_contacts.cpp.
  struct Later;

  // Appends the points that v brings deeper than `allowance` and that are not among the contacts.
  void find_missed(const Reach& reach, double allowance, std::vector<Contact>& contacts);
  // Appends the points of known pairs that overlap by more than `allowance` in the poses to which v leads. An
  // example is a face that turns while a body slides along it. Arms, normal and gap of these points are those
  // at the end of the step, so that they only constrain that motion.
  void find_overlaps(const Reach& reach, double allowance, std::vector<Contact>& contacts);
  // Replaces the points of pairs at internal edges by those along the neighbour's normal.
  void level(const Reach& reach, std::span<const InternalEdges::Passage> passages,
             std::vector<Contact>& contacts);
  // Whether a point equals one of the contacts, whose keys are in by_pair_: the same features of the same
  // pair.
  bool is_known(const Reach& reach, const Contact& contact, const std::vector<Contact>& contacts) const;
  // Sorts the keys of all contacts into by_pair_. The searches of a step after the first one only append
  // contacts, so that keys of as many hold.
  void sort_all(const std::vector<Contact>& contacts);
  // Poses of the geoms and boxes around them, for all searches of a step; then what they may reach with the
  // velocities of one search.
  void place_geoms(const Reach& reach);
  void reach_out(const Reach& reach, const Subset& geoms);
  // Contacts of those of the pairs that meet within the margin now or at the end of the step; and of those
  // that stand, for the next search. The pairs ascend.
  void collide_pairs(const Reach& reach, std::span<const IndexPair> pairs, Part& part) const;
  // Sets the turns of the contacts of one pair; tells whether the pair overlaps in later poses.
  void turn_pair(const Later& half, double least, std::span<const PairKey> keys,
                 const std::vector<Contact>& contacts, Part& part, std::vector<Vec3>& turns) const;
  Vec3 turn_of_balls(const Later& half, double least, const Contact& contact) const;
  bool overlap(const Later& later, double allowance, std::span<const PairKey> keys,
               const std::vector<Contact>& contacts, std::vector<ContactPoint>& points) const;
  // Ascending pairs, among which are all that may meet.
  std::span<const IndexPair> find_pairs(const Reach& reach);
  bool may_meet(Index a, Index b) const { return !(stay_[a] && stay_[b]) && extents_.meet(a, b); }
  void note_disturbed(const Reach& reach, const Contact& contact);
  double reach_of_pair(const Reach& reach, Index a, Index b) const;
  GeomMotion motion(const Reach& reach, std::size_t geom, const BodyVelocity& v) const;
  template <class Counts, class Keep>
  void visit(const Reach& reach, std::span<const IndexPair> pairs, std::vector<ContactPoint>& points,
             std::vector<Contact>& contacts, Counts&& counts, Keep&& keep) const;

  BroadPhase broad_phase_;
  std::vector<Transform> frames_;
  std::vector<std::optional<Transform>> later_;  // by body, of the last search in later poses
  std::vector<Aabb> bounds_;                     // of the shapes in their poses, not of spheres
  Extents extents_;
  NearPairs near_;
  std::vector<unsigned char> fixed_, stay_;
  std::vector<unsigned char> calm_;  // per geom: the solve changed its velocity too little for missed points
  BodyVelocities foreseen_;          // velocities of the first search
  bool reached_otherwise_ = true;    // motions, extents and stay_ are not those of a first search
  StandingPairs standing_;
  // Per geom: motion with the velocities of the search, and its change by a solve.
  std::vector<GeomMotion> motions_, changes_;
  std::vector<IndexPair> pairs_;
  std::vector<ContactPoint> points_;
  std::vector<Part> parts_;
  std::vector<PairKey> by_pair_;
  std::vector<Contact> found_;
  std::vector<Index> disturbed_;
  InternalEdges edges_;
  RedundantPoints redundant_;
};

}  // namespace amontons
