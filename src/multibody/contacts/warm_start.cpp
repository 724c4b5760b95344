#include "multibody/contacts/warm_start.hpp"

#include <algorithm>

#include "multibody/contacts/pair_order.hpp"

namespace amontons {

namespace {

// Impulses are kept as world vectors: a contact of this step has another basis, and its rows follow from its
// own. Moments are divided by the length of the present contact. A normal impulse that the turn of the basis
// made negative is cut off; what is left outside the cone is projected by the solve. The rows of an impulse
// of the last step in the frame of a contact of this one.
void rows_of(const Contact& c, const Contact& last, double scale, double* x) {
  to_rows(c, scale * last.impulse, scale * last.angular_impulse, 1 / c.moment_length, x);
  x[0] = std::max(0.0, x[0]);
}

}  // namespace

// Only those that push: others start from zero anyway. `local` is how the point is known again, in the frame
// of the body that moves (A), as features of a body move with it. Sorted by pair, so that the next step finds
// a pair by bisection.
void keep_for_warm_start(const Problem& problem, std::span<const double> x, const BodyFrames& bodies,
                         std::vector<Contact>& kept) {
  const auto& contacts = std::get<ContactSystem>(problem.A).contacts;
  const auto rows_of_contact = [&](std::size_t i) { return &x[problem.graph.first_row[i]]; };
  static thread_local std::vector<PairKey> keys;
  sort_by_pair(contacts, keys, [&](std::size_t i) { return rows_of_contact(i)[0] > 0; });
  kept.resize(keys.size());
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const std::size_t i = keys[k].contact;
    const ContactImpulse impulse = to_world(contacts[i], rows_of_contact(i));
    Contact& c = kept[k] = contacts[i];
    c.impulse = impulse.linear;
    c.angular_impulse = impulse.angular;
    c.local = inverse(bodies[c.body_a].pose)(c.point);
  }
}

namespace {

// f(i, the contact of the last step that contacts[i] was), for those that were one. Contacts come pair by
// pair. Within one, each point takes the nearest of the last step that is not taken yet: two points shall not
// start from the same impulse, which would count it twice.
template <class F>
void for_each_known(const Model& model, const std::vector<Contact>& last, const BodyFrames& bodies,
                    const std::vector<Contact>& contacts, F&& f) {
  static thread_local std::vector<unsigned char> used;
  used.assign(last.size(), 0);
  for (std::size_t i = 0; i < contacts.size();) {
    const std::pair pair = pair_of(contacts[i]);
    std::size_t end = i;
    while (end < contacts.size() && pair_of(contacts[end]) == pair) ++end;
    const auto first =
        std::partition_point(last.begin(), last.end(), [&](const Contact& c) { return pair_of(c) < pair; });
    const auto after =
        std::partition_point(first, last.end(), [&](const Contact& c) { return pair_of(c) == pair; });
    // A point is the same one if it moved by less than a quarter of the smaller shape; a single point of a
    // pair (a rolling ball) is the same one wherever it went.
    const double reach = 0.25 * std::min(bounding_radius(model.geom(pair.first).shape),
                                         bounding_radius(model.geom(pair.second).shape));
    const bool single = end - i == 1 && after - first == 1;
    const Transform to_local = inverse(bodies[contacts[i].body_a].pose);
    for (; i < end; ++i) {
      const Vec3 local = to_local(contacts[i].point);
      double best = single ? infinity : reach * reach;
      auto nearest = after;
      for (auto c = first; c != after; ++c) {
        const double distance = norm_squared(c->local - local);
        if (!used[c - last.begin()] && (distance < best || (single && nearest == after))) {
          best = distance;
          nearest = c;
        }
      }
      if (nearest == after) continue;
      used[nearest - last.begin()] = 1;
      f(i, *nearest);
    }
  }
}

}  // namespace

void warm_start_contacts(const Model& model, const std::vector<Contact>& last, double scale,
                         const BodyFrames& bodies, const std::vector<Contact>& contacts,
                         std::vector<double>& x0) {
  // x0 may hold rows already; those of all contacts follow, zero until something is found for them.
  std::size_t first = x0.size(), rows = 0, row = first, at = 0;
  for (const Contact& c : contacts) rows += static_cast<std::size_t>(c.rows);
  x0.resize(first + rows, 0.0);
  for_each_known(model, last, bodies, contacts, [&](std::size_t i, const Contact& was) {
    for (; at < i; ++at) row += static_cast<std::size_t>(contacts[at].rows);  // i ascends
    rows_of(contacts[i], was, scale, &x0[row]);
  });
}

void hold_contacts(const Model& model, const std::vector<Contact>& last, double scale,
                   const BodyFrames& bodies, std::vector<Contact>& contacts) {
  if (std::none_of(contacts.begin(), contacts.end(),
                   [](const Contact& c) { return c.material.compliance > 0; }))
    return;
  for_each_known(model, last, bodies, contacts,
                 [&](std::size_t i, const Contact& was) { contacts[i].held = scale * was.impulse; });
}

}  // namespace amontons
