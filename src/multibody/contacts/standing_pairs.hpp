// Contacts of pairs that stand: found once, and kept while nothing about them changes.
#pragma once
#include <span>
#include <vector>

#include "amontons/collision/broad_phase.hpp"
#include "multibody/contacts/reach.hpp"

namespace amontons {

// The contacts of a pair are a function of the poses and velocities of its bodies, of the step and of the
// margin. If all of these have the bits of the last search, so have the contacts. So no list of what moves a
// body is needed. Bodies at rest have equal bits in each step (step/rest).
class StandingPairs {
 public:
  // Pairs in ascending order, each with its contacts, which may be none.
  struct Kept {
    struct Pair {
      IndexPair geoms;
      std::size_t first, end;
    };
    std::vector<Pair> pairs;
    std::vector<Contact> contacts;

    void clear();
    void add(const IndexPair& geoms, std::span<const Contact> found);
    void append(const Kept& later);
  };
  // A place in what the last search kept, for pairs that ascend.
  using Cursor = std::size_t;

  // Compares with the last search, whose poses and velocities those of this one replace.
  void begin(const Reach& reach);
  // Whether neither body has changed; the world never does.
  bool stand(Index body_a, Index body_b) const { return stands(body_a) && stands(body_b); }
  Cursor at(const IndexPair& geoms) const;
  // The contacts of a pair that the last search kept, from the cursor on; null if it kept none.
  const Kept::Pair* find(const IndexPair& geoms, Cursor& from) const;
  std::span<const Contact> contacts(const Kept::Pair& pair) const;
  // Gives the next search the pairs of this one; `kept` receives the memory of the last one.
  void keep(Kept& kept) { std::swap(kept_, kept); }

 private:
  bool stands(Index body) const { return body < 0 || stands_[static_cast<std::size_t>(body)]; }

  std::vector<Transform> poses_;
  BodyVelocities velocities_;
  double h_ = 0, margin_ = 0;
  std::vector<unsigned char> stands_;
  Kept kept_;
};

}  // namespace amontons
