// Contacts with the rim of a surface that goes on in its neighbour.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "multibody/contacts/pair_order.hpp"
#include "multibody/contacts/reach.hpp"

namespace amontons {

// Boxes side by side are one floor. Ahead of the joint, though, the nearest way from a ball to the second box
// is to its edge, and from a sliding box to its side: a contact there, which acts before it touches, lifts
// the one and stops the other. So the pairs of a body are judged together: where one of them holds it above a
// plane that another geom does not rise over, nothing but that plane can come between the body and that geom
// within the step.
class InternalEdges {
 public:
  // Contacts [first, end) of a pair of geoms, to be looked at along the normal of a neighbour instead of
  // their own; with a surface of triangles, to be left out.
  struct Passage {
    std::size_t first, end;
    Vec3 normal;    // from the ground to the body that passes
    bool a_passes;  // the body that passes is A, the ground B; or the other way round
  };

  // Of contacts that come pair by pair, in their order. frames: of the geoms.
  std::span<const Passage> find(const Reach& reach, const std::vector<Transform>& frames,
                                const std::vector<Contact>& contacts);
  // Appends the contacts of passages that the velocities reach.v, which were solved for, bring to overlap all
  // the same, because they part the neighbours: a wall that gives way brick by brick.
  void call_in(const Reach& reach, std::vector<Contact>& contacts);
  // Whether one more contact is with such a rim, by the pairs of the last find() and
  // the velocities of a solve.
  bool passes(const Reach& reach, const std::vector<Transform>& frames, const Contact& contact) const;

 private:
  // A contact seen from one of its geoms, the body that may pass over the other: the normal towards it, and
  // the points of both surfaces.
  struct Touch {
    Index body, ground;  // geoms
    Vec3 up, on_body, on_ground;
    std::uint32_t pair;
  };
  struct PairState {
    std::size_t first, end, deepest;  // contacts
    bool passed, holds;               // has given up its normal; must not, because another pair relies on it
  };

  struct Range {
    std::size_t first, end;
  };
  struct Passed {
    Contact contact;
    Index ground, level;  // geoms: what is passed, and the neighbour on whose account
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
  std::vector<Touch> found_, touches_;  // in the order of the pairs; of the geoms
  std::vector<std::size_t> start_, place_;
  std::vector<Passage> passages_;
  std::vector<Passed> passed_;  // of neighbours that move
};

}  // namespace amontons
