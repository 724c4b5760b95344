// Pairs of geoms that may meet within this step, and within later ones.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "amontons/collision/broad_phase.hpp"
#include "multibody/contacts/reach.hpp"

namespace amontons {

// A ball that is larger by this factor contains what arithmetic takes for its surface.
inline constexpr double with_rounding = 1 + 1e-12;  // not tuned: rounding

// The velocity of a geom's centre, and the largest speed that its turning adds to its surface along normals.
struct GeomMotion {
  Vec3 centre;
  double spin = 0;
};

// The room that geoms may reach within a step.
struct Extents {
  // A plane: its normal, and the height along it up to which it may reach.
  struct HalfSpace {
    Vec3 normal;
    double top;
  };
  std::vector<Aabb> boxes;  // infinite: of planes
  HostArray<Ball> balls;    // of spheres, with what they may gain at rest
  HostArray<Vec3> travels;  // of the centres within the step
  std::vector<HalfSpace> half_spaces;
  std::uint64_t placed = 0;  // number of the balls

  void resize(std::size_t geoms, const HostMemory& memory);
  Bounds bounds(std::span<const unsigned char> stay) const { return {boxes, balls, travels, stay, placed}; }
  // Whether two geoms may meet: their boxes and balls do, and one of a plane only below its top.
  bool meet(Index a, Index b) const { return is_overlap(boxes[a], boxes[b]) && meet_in_boxes(a, b); }
  // Whether a geom reaches no farther than in `other`, where nothing travels.
  bool is_within(const Extents& other, std::size_t geom) const;
  // Whether two geoms whose boxes overlap may meet.
  bool meet_in_boxes(Index a, Index b) const;
};

// A list of pairs, among which those that meet are found again and again (Verlet, "Computer experiments on
// classical fluids", Physical Review 159, 1967). For the list, extents are grown by a slack. It holds until
// one of them leaves its grown one. So it serves both searches of a step whose positions are corrected, the
// look ahead, and steps in which bodies move little. Which pairs meet does not depend on the age of the list.
class NearPairs {
 public:
  // Ascending pairs, among which are all that meet now, except those of two geoms that stay.
  // Extents of geoms outside of those visited are those of the last call.
  std::span<const IndexPair> find(const Reach& reach, const Subset& visited, const Extents& now,
                                  std::span<const GeomMotion> motions, std::span<const unsigned char> stay);
  // Whether the last list is one, too.
  bool hold(const Reach& reach, const Subset& visited, const Extents& now,
            std::span<const unsigned char> stay) const;
  std::span<const IndexPair> pairs() const { return pairs_; }

 private:
  void grow(const Reach& reach, const Extents& now, std::span<const GeomMotion> motions);

  BroadPhase broad_phase_;
  Extents grown_;
  std::vector<unsigned char> stay_;  // in the search; empty: no list
  std::vector<IndexPair> pairs_;
};

}  // namespace amontons
