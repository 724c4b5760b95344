#include "multibody/contacts/warm_start.hpp"

#include <algorithm>

#include "amontons/base/parts.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/contacts/pair_order.hpp"
#include "multibody/contacts/policy.hpp"
#include "multibody/model/stribeck.hpp"

namespace amontons {

namespace {

// Impulses are stored as world vectors: a contact of this step has another basis, and its rows use its own.
// Moments are divided by the length of the present contact. A normal impulse that the turn of the basis made
// negative is set to zero. The solve projects any rest outside the cone. Returns the rows of an impulse of
// the last step in the frame of a contact of this one.
void rows_of(const Contact& c, const CarriedContact& last, double scale, double* x) {
  to_rows(c, scale * last.impulse, scale * last.angular_impulse, 1 / c.moment_length, x);
  x[0] = std::max(0.0, x[0]);
}

}  // namespace

// Stores only contacts with an impulse, since others start from zero anyway. `local` identifies the point
// again, in the frame of the moving body (A), as features of a body move with it. Sorted by pair, so that the
// next step finds a pair by bisection.
//
// An impulse in the frame of its contact and back has other last bits, and those of a contact at rest would
// drift.
void keep_for_warm_start(const SolvedContacts& solved, const BodyFrames& bodies, unsigned threads,
                         std::vector<CarriedContact>& kept) {
  const auto rows_of_contact = [&](std::size_t i) { return &solved.x[solved.problem.graph.first_row[i]]; };
  static thread_local std::vector<PairKey> memory;
  std::vector<PairKey>& keys = memory;  // on another thread `memory` is that thread's
  static thread_local std::vector<CarriedContact> of_last_step;
  std::vector<CarriedContact>& last = of_last_step;
  last.swap(kept);
  sort_by_pair(solved.contacts, keys, [&](std::size_t i) { return rows_of_contact(i)[0] > 0; });
  kept.resize(keys.size());
  for_entries(threads, keys.size(), [&](std::size_t k) {
    const std::size_t i = keys[k].contact;
    const Contact& c = solved.contacts[i];
    const Index same = solved.same[i];
    const auto [linear, angular] = same >= 0 ? ContactImpulse{last[same].impulse, last[same].angular_impulse}
                                             : to_world(c, rows_of_contact(i));
    const double slip = c.state == ContactState::slip ? norm(c.slip) : 0;
    // A contact may be at its limit without slipping.
    kept[k] = {c.geom_a, c.geom_b, inverse(bodies[c.body_a].pose)(c.point),
               linear,   angular,  slip > solved.least ? slip : 0};
  });
}

namespace {

// A possible match of a contact of this step with one of the last, within their pair.
struct Match {
  double distance;  // squared
  std::size_t now;
  Index before;
  auto operator<=>(const Match&) const = default;
};

// Matches each contact of one pair with one of the last step: its number in `last`, or -1. The nearest two
// are matched first, and no point twice, because its impulse would count twice. Contacts without an impulse
// are not among the last, so the nearest of them may be that of a neighbour.
void match(const Model& model, std::span<const CarriedContact> last, const BodyFrames& bodies,
           std::span<const Contact> contacts, std::vector<Match>& matches, std::span<Index> was) {
  // A single point of a pair (a rolling ball) is always the same.
  if (contacts.size() == 1 && last.size() == 1) {
    was[0] = 0;
    return;
  }
  // One of several is the same if it moved by less than half of the smaller shape.
  const auto [a, b] = pair_of(contacts[0]);
  const double reach =
      0.5 * std::min(bounding_radius(model.geom(a).shape), bounding_radius(model.geom(b).shape));
  const Transform to_local = inverse(bodies[contacts[0].body_a].pose);
  matches.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Vec3 local = to_local(contacts[i].point);
    for (std::size_t k = 0; k < last.size(); ++k) {
      const double distance = norm_squared(last[k].local - local);
      if (distance < reach * reach) matches.push_back({distance, i, static_cast<Index>(k)});
    }
  }
  std::sort(matches.begin(), matches.end());
  static thread_local std::vector<unsigned char> used;
  used.assign(last.size(), 0);
  for (const Match& m : matches) {
    if (was[m.now] >= 0 || used[m.before]) continue;
    was[m.now] = m.before;
    used[m.before] = 1;
  }
}

// The first of the contacts from `from` on, ordered by pairs, whose pair is not before `pair`. Steps double
// until they pass the pair (Bentley and Yao, 1976), and a bisection of the last step follows.
//
// A bisection over all contacts of a pile misses the cache in nearly every step. Pairs of
// a search ascend, except where a fixed geom became the second one and where contacts were added later. So
// most pairs lie a few records behind the last one: k records take 2 log2(k) comparisons.
std::vector<CarriedContact>::const_iterator find_pair(std::vector<CarriedContact>::const_iterator from,
                                                      std::vector<CarriedContact>::const_iterator end,
                                                      const std::pair<Index, Index>& pair) {
  const auto before = [&](const CarriedContact& c) { return pair_of(c) < pair; };
  std::ptrdiff_t step = 1;
  while (step < end - from && before(from[step])) {
    from += step;
    step *= 2;
  }
  return std::partition_point(from, std::min(from + step, end), before);
}

}  // namespace

// Contacts are ordered by pairs, those of the last step ascending: the search goes on from the last pair
// where pairs ascend.
void find_known(const Model& model, const std::vector<CarriedContact>& last, const BodyFrames& bodies,
                const std::vector<Contact>& contacts, std::vector<Index>& known) {
  static thread_local std::vector<Match> matches;
  known.assign(contacts.size(), -1);
  auto first = last.begin();
  for (std::size_t i = 0; i < contacts.size();) {
    const std::pair pair = pair_of(contacts[i]);
    const std::size_t end = end_of_pair(contacts, i);
    const bool ascends = i > 0 && pair_of(contacts[i - 1]) < pair;
    first = find_pair(ascends ? first : last.begin(), last.end(), pair);
    auto after = first;
    while (after != last.end() && pair_of(*after) == pair) ++after;
    const std::span of_pair = std::span(known).subspan(i, end - i);
    if (first != after) {
      match(model, std::span(&*first, static_cast<std::size_t>(after - first)), bodies,
            std::span(contacts).subspan(i, end - i), matches, of_pair);
      for (Index& k : of_pair)
        if (k >= 0) k += static_cast<Index>(first - last.begin());
    }
    i = end;
  }
}

void warm_start_contacts(const std::vector<CarriedContact>& last, std::span<const Index> known, double scale,
                         const std::vector<Contact>& contacts, std::vector<double>& x0) {
  // x0 may hold rows already. Those of all contacts follow.
  std::size_t row = x0.size(), rows = 0;
  for (const Contact& c : contacts) rows += static_cast<std::size_t>(c.rows);
  x0.resize(row + rows, 0.0);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (known[i] >= 0) rows_of(contacts[i], last[static_cast<std::size_t>(known[i])], scale, &x0[row]);
    row += static_cast<std::size_t>(contacts[i].rows);
  }
}

void set_slipping_friction(const Model& model, const std::vector<CarriedContact>& last,
                           std::span<const Index> known, std::vector<Contact>& contacts) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    Contact& c = contacts[i];
    if (known[i] >= 0 && c.material.friction_static >= 0)
      set_friction(model.material(c.geom_a, c.geom_b), last[static_cast<std::size_t>(known[i])].slip, c);
  }
}

void hold_contacts(const std::vector<CarriedContact>& last, std::span<const Index> known, double scale,
                   std::vector<Contact>& contacts) {
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (known[i] >= 0 && contacts[i].material.compliance > 0)
      contacts[i].held = scale * last[static_cast<std::size_t>(known[i])].impulse;
}

}  // namespace amontons
