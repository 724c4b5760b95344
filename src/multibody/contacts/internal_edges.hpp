// Contacts with the rim of a surface that continues in its neighbour.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "multibody/contacts/pair_order.hpp"
#include "multibody/contacts/reach.hpp"

namespace amontons {

// Boxes side by side form one floor. But the nearest direction from a ball to the second box is to its edge,
// and from a sliding box to its side. A contact there acts before it touches: it lifts the ball and stops the
// box. So all pairs of a body are judged together. If one of them holds the body above a plane that another
// geom does not exceed, only that plane can touch the body within the step, not that geom.
class InternalEdges {
 public:
  // Contacts [first, end) of a pair of geoms that take the normal of a neighbour instead of their own; for a
  // triangle surface they are removed.
  struct Passage {
    std::size_t first, end;
    Vec3 normal;    // from the support to the passing body
    bool a_passes;  // the passing body is A and the support B; otherwise reversed
  };

  // For contacts ordered by pairs. frames: poses of the geoms.
  std::span<const Passage> find(const Reach& reach, const std::vector<Transform>& frames,
                                const std::vector<Contact>& contacts);
  // Appends contacts of passages that overlap at the solved velocities reach.v after all, because these
  // separate the neighbours: for example in a wall that gives way brick by brick.
  void call_in(const Reach& reach, std::vector<Contact>& contacts);
  // Whether a further contact is at such an internal edge, by the pairs of the last find() and the velocities
  // of a solve.
  bool passes(const Reach& reach, const std::vector<Transform>& frames, const Contact& contact) const;

 private:
  // A contact seen from one of its geoms, the body that may pass over the other: the normal towards the body,
  // and the points of both surfaces.
  struct Touch {
    Index body, support;  // geoms
    Vec3 up, on_body, on_support;
    std::uint32_t pair;
  };
  struct PairState {
    std::size_t first, end, deepest;  // contacts
    bool passed, holds;               // its contact takes the neighbour's normal; its contact must stay,
                                      // because another passage relies on it, or there is no edge
  };

  struct Range {
    std::size_t first, end;
  };
  struct Passed {
    Contact contact;
    Index support, level;  // geoms: the passed one, and the neighbour that replaces it
    Vec3 up;
  };

  static Touch touch_of(const Contact& c, bool of_a, std::uint32_t pair);
  std::span<const Touch> touches_of(Index geom) const;
  const Touch* find_level(const Reach& reach, const std::vector<Transform>& frames, const Touch& touch,
                          auto&& rises) const;
  const Touch* judge(const Reach& reach, const std::vector<Transform>& frames, const Contact& contact,
                     auto&& rises) const;
  const Touch* find_rim(const Reach& reach, const std::vector<Transform>& frames, const Touch& touch) const;
  void try_passage(const Reach& reach, const std::vector<Transform>& frames,
                   const std::vector<Contact>& contacts, std::size_t judged, const Range& part,
                   PairState& pair);
  void collect(const Model& model, const std::vector<Contact>& contacts);

  std::vector<PairState> states_;
  std::vector<Touch> found_, touches_;  // by the order of pairs; by geoms
  std::vector<std::size_t> start_, place_;
  std::vector<unsigned char> at_edge_;  // per geom: one of its pairs may have an edge
  std::vector<Passage> passages_;
  std::vector<Passed> passed_;  // of moving neighbours
};

}  // namespace amontons
