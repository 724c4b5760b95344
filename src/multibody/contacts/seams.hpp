// Contacts that a body passes because it rests on the neighbour of what it would strike.
#pragma once
#include <vector>

#include "multibody/contacts/reach.hpp"

namespace amontons {

// A box that slides over the joint between two slabs must not strike the side of the second one: as long as
// it rests on the first it stays above both. Ahead of the joint, though, the nearest way to the second slab
// is sideways, and a contact that acts before it touches would stop the box there.
class Seams {
 public:
  // Forgets what bodies rest on: the contacts are others.
  void start(const std::vector<Contact>& contacts);
  // Whether `contact` is with the side of a geom on which A does not rest yet, level with the face on which,
  // by `contacts`, it does. frames: of the geoms.
  bool passes(const Reach& reach, const std::vector<Transform>& frames, const std::vector<Contact>& contacts,
              const Contact& contact);

 private:
  std::vector<std::size_t> by_body_;  // sorted for the first candidate only: most steps have none
  std::size_t known_ = 0;
};

}  // namespace amontons
