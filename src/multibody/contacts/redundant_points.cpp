#include "multibody/contacts/redundant_points.hpp"

#include <algorithm>

namespace amontons {

namespace {

// What leaving out a point may cost: far below what a margin is taken for, far above rounding.
double tolerance_of(const Reach& reach) { return 0.01 * reach.margin; }

// How deep a spare one may come to lie: a tenth of its way in the step, but no deeper than the tolerance.
// What moves fast is on its way past; but a body on a rough sole, which stands now on these points and now on
// those, would never come to rest.
double overlap_of(const Contact& c, double end, const Reach& reach) {
  return std::clamp(0.1 * (c.gap - end), 1e-4 * reach.margin, tolerance_of(reach));
}

// How near a point has to come to be looked at before the solve. It is as far as the choice among many looks.
double reach_of(const Reach& reach) { return 0.1 * reach.margin; }

// Groups of so few points keep them all.
constexpr std::size_t few = 4;
// About 8 degrees: less than the edges of a body or of the ground turn by, more than a fine mesh from one
// triangle to the next.
constexpr double parallel_normals = 0.99;  // cosine

// Shapes with any number of corners. The others have few, each of which is known by name.
bool has_many_corners(const Shape& shape) {
  return std::holds_alternative<Hull>(shape) || std::holds_alternative<Mesh>(shape) ||
         std::holds_alternative<HeightField>(shape);
}

bool is_reducible(const Model& model, const Contact& c) {
  return has_many_corners(model.geom(c.geom_a).shape) || has_many_corners(model.geom(c.geom_b).shape);
}

}  // namespace

void RedundantPoints::choose(const Reach& reach, std::span<const Contact> contacts) {
  needed_.assign(contacts.size(), 0);
  grouped_.assign(contacts.size(), 0);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (grouped_[i]) continue;
    points_.clear();
    group_.clear();
    for (std::size_t k = i; k < contacts.size(); ++k) {
      const Contact& c = contacts[k];
      if (grouped_[k] || dot(c.normal, contacts[i].normal) <= parallel_normals) continue;
      grouped_[k] = 1;
      group_.push_back(static_cast<std::uint32_t>(k));
      points_.push_back({c.point, c.gap, end_gap(c, reach)});
    }
    // Nothing of a group that stays out of reach is needed, wherever the free velocities lead.
    if (std::none_of(points_.begin(), points_.end(),
                     [&](const SupportPoint& p) { return std::min(p.gap, p.end) <= reach_of(reach); }))
      continue;
    kept_.assign(group_.size(), group_.size() <= few);
    if (group_.size() > few) support_.select(points_, contacts[i].normal, tolerance_of(reach), kept_);
    for (std::size_t k = 0; k < group_.size(); ++k) needed_[group_[k]] = kept_[k];
  }
}

// In place and in order.
void RedundantPoints::set_aside(const Reach& reach, std::vector<Contact>& contacts) {
  spare_.clear();
  std::size_t out = 0;
  for (std::size_t first = 0, end = 0; first < contacts.size(); first = end) {
    end = end_of_pair(contacts, first);
    const bool many = is_reducible(reach.model, contacts[first]);
    if (many) choose(reach, std::span(contacts).subspan(first, end - first));
    for (std::size_t i = first; i < end; ++i) {
      if (many && !needed_[i - first])
        spare_.push_back(contacts[i]);
      else if (out++ != i)
        contacts[out - 1] = contacts[i];
    }
  }
  contacts.resize(out);
}

double deepest(const std::vector<Contact>& contacts, std::span<const PairKey> keys, const Reach& reach) {
  double least = 0;
  for (const PairKey& key : keys) least = std::min(least, end_gap(contacts[key.contact], reach));
  return least;
}

// Overlaps of what has rows already are no news: the rows take them back as fast as they may. A spare one is
// missed where it comes to lie deeper than all of its pair that have rows.
void RedundantPoints::call_in(const Reach& reach, std::vector<Contact>& contacts) {
  const auto overlaps = [&](const Contact& c, double held) {
    const double end = end_gap(c, reach);
    return end < held - overlap_of(c, end, reach);
  };
  if (std::none_of(spare_.begin(), spare_.end(), [&](const Contact& c) { return overlaps(c, 0); })) return;
  sort_by_pair(contacts, by_pair_, [](std::size_t) { return true; });
  called_.clear();
  std::size_t out = 0;
  for (std::size_t first = 0, end = 0; first < spare_.size(); first = end) {
    end = end_of_pair(spare_, first);
    const auto [begin, after] = keys_of(by_pair_, pair_of(spare_[first]));
    const double held = deepest(contacts, {begin, after}, reach);
    for (std::size_t i = first; i < end; ++i) {
      if (overlaps(spare_[i], held))
        called_.push_back(spare_[i]);
      else if (out++ != i)
        spare_[out - 1] = spare_[i];
    }
  }
  spare_.resize(out);
  for (std::size_t first = 0, end = 0; first < called_.size(); first = end) {
    end = end_of_pair(called_, first);
    add(reach, std::span(called_).subspan(first, end - first), contacts);
  }
}

void RedundantPoints::add(const Reach& reach, std::span<const Contact> found,
                          std::vector<Contact>& contacts) {
  if (!found.empty() && !is_reducible(reach.model, found[0])) {
    contacts.insert(contacts.end(), found.begin(), found.end());
    return;
  }
  choose(reach, found);
  for (std::size_t i = 0; i < found.size(); ++i) (needed_[i] ? contacts : spare_).push_back(found[i]);
}

}  // namespace amontons
