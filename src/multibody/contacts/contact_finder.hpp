// Finds the points of geoms that may touch within a step.
#pragma once
#include <optional>
#include <utility>
#include <vector>

#include "amontons/collision/broad_phase.hpp"
#include "amontons/collision/pairs/collide.hpp"
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/contact.hpp"
#include "multibody/contacts/internal_edges.hpp"
#include "multibody/contacts/pair_order.hpp"
#include "multibody/contacts/redundant_points.hpp"

namespace amontons {

// The velocity of a geom's centre, and the largest speed that its turning adds to its surface along normals.
struct GeomMotion {
  Vec3 centre;
  double spin = 0;
};

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
  // Index and contact in the middle of the step that v leads through, of pairs that turn. The contact is the
  // only one of its pair, or one of a rim.
  using Middles = std::vector<std::pair<std::size_t, Contact>>;
  const Middles& find_middles(const Reach& reach, const std::vector<Contact>& contacts);

 private:
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
  void place_geoms(const Reach& reach);
  // The pairs that may touch within the step, ascending, to pairs_.
  void find_pairs(const Reach& reach);
  // Whether two geoms whose boxes overlap may meet: a plane, whose box is infinite, only below its top.
  bool is_reached(Index a, Index b) const;
  double reach_of_pair(const Reach& reach, Index a, Index b) const;
  template <class Counts, class F>
  void visit(const Reach& reach, Counts&& counts, F&& f);

  BroadPhase broad_phase_;
  std::vector<Transform> frames_;
  std::vector<std::optional<Transform>> later_;  // by body, of the last search in later poses
  std::vector<Aabb> boxes_;
  std::vector<Ball> balls_;
  // A plane: its normal, and the height along it up to which it may reach within the step.
  struct HalfSpace {
    Vec3 normal;
    double top;
  };
  std::vector<HalfSpace> half_spaces_;  // by geom
  std::vector<unsigned char> fixed_;
  BodyVelocities foreseen_;  // velocities of the first search
  // Per geom: motion with the velocities of the search, and its change by a solve.
  std::vector<GeomMotion> motions_, changes_;
  std::vector<IndexPair> pairs_;
  std::vector<ContactPoint> points_;
  std::vector<PairKey> by_pair_;
  std::vector<Contact> found_;
  Middles middles_;
  std::vector<std::optional<ContactPoint>> matched_;
  InternalEdges edges_;
  RedundantPoints redundant_;
};

}  // namespace amontons
