// Which points of which geoms may touch within a step.
#pragma once
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

// The velocity of a geom's centre, and the most that its turning adds to the speed of its surface along
// normals.
struct GeomMotion {
  Vec3 centre;
  double spin = 0;
};

// Memory of the searches of a simulation. The searches of one step go together: those after a solve use where
// the first one found the geoms. Contacts come with everything but what a solve finds; body A is
// dynamic.
class ContactFinder {
 public:
  // All contact points within the margin, or that the velocities bring there within h, but for those that
  // pass a seam and those that others stand for.
  void find(const Reach& reach, std::vector<Contact>& contacts);
  // Appends what the velocities v of a solve lead to and those of the first search did not foresee: an impact
  // gives bodies velocities that nobody could foresee.
  void find_unforeseen(const Reach& reach, std::vector<Contact>& contacts);
  // Appends the points at which v, of a step that is not solved, leads through what is fixed: of all of it,
  // as nothing says that the contacts hold on which seams and spares rely.
  void find_fixed(const Reach& reach, std::vector<Contact>& contacts);
  // Of the contacts that are the only one of their pair, where the pair turns: index and contact in the
  // middle of the step that v leads through.
  using Middles = std::vector<std::pair<std::size_t, Contact>>;
  const Middles& find_middles(const Reach& reach, const std::vector<Contact>& contacts);

 private:
  // The points that v brings deeper than `allowance` and that are not among the contacts.
  void find_missed(const Reach& reach, double allowance, std::vector<Contact>& contacts);
  // The points of known pairs that overlap by more than `allowance` where v takes the bodies: a face that
  // turns while something slides along it is where its old normal does not tell. Arms, normal and gap of
  // these points are those of the end of the step, so that they ask for nothing that the motion does not.
  void find_overlaps(const Reach& reach, double allowance, std::vector<Contact>& contacts);
  // Gives pairs that pass a seam the points that they have along the neighbour's normal.
  void level(const Reach& reach, std::span<const InternalEdges::Passage> passages,
             std::vector<Contact>& contacts);
  // Whether a point is that of one of the contacts, whose keys by_pair_ has: the same features of the same
  // pair.
  bool is_known(const Reach& reach, const Contact& contact, const std::vector<Contact>& contacts) const;
  void place_geoms(const Reach& reach);
  double reach_of_pair(const Reach& reach, Index a, Index b) const;
  template <class Counts, class F>
  void visit(const Reach& reach, Counts&& counts, F&& f);

  BroadPhase broad_phase_;
  std::vector<Transform> frames_;
  std::vector<Aabb> boxes_;
  std::vector<unsigned char> fixed_;
  BodyVelocities foreseen_;  // those of the first search
  // Of the geoms: with the velocities of the search, and their change by a solve.
  std::vector<GeomMotion> motions_, changes_;
  std::vector<IndexPair> pairs_;
  std::vector<ContactPoint> points_;
  std::vector<PairKey> by_pair_;
  std::vector<Contact> found_;
  Middles middles_;
  InternalEdges edges_;
  RedundantPoints redundant_;
};

}  // namespace amontons
