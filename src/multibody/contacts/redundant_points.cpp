#include "multibody/contacts/redundant_points.hpp"

#include <algorithm>

#include "multibody/contacts/policy.hpp"

namespace amontons {

namespace {

// Distance of points that support alike (m): far below the purpose of a margin, far above rounding.
double tolerance_of(const Reach& reach) { return contacts::policy.level * reach.margin; }

// Gap (m) up to which a point is considered before the solve; equal to the distance used in the choice among
// many.
double reach_of(const Reach& reach) { return contacts::policy.allowance * reach.margin; }

// Shapes without many corners have few points, each with a feature number.
bool is_reducible(const Model& model, const Contact& c) {
  return model.outline(c.geom_a).has_corners || model.outline(c.geom_b).has_corners;
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
      if (grouped_[k] || dot(c.normal, contacts[i].normal) <= contacts::policy.one_normal) continue;
      grouped_[k] = 1;
      group_.push_back(static_cast<std::uint32_t>(k));
      points_.push_back({c.point, c.gap, end_gap(c, reach)});
    }
    // A group that stays out of reach is not needed, whatever the free velocities.
    if (std::none_of(points_.begin(), points_.end(),
                     [&](const SupportPoint& p) { return std::min(p.gap, p.end) <= reach_of(reach); }))
      continue;
    kept_.assign(group_.size(), group_.size() <= contacts::policy.few);
    if (group_.size() > contacts::policy.few)
      support_.select(points_, contacts[i].normal, tolerance_of(reach), kept_);
    for (std::size_t k = 0; k < group_.size(); ++k) needed_[group_[k]] = kept_[k];
  }
}

// In place; the order is kept.
void RedundantPoints::set_aside(const Reach& reach, std::vector<Contact>& contacts) {
  redundant_.clear();
  if (!reach.model.has_corners()) return;
  std::size_t out = 0;
  for (std::size_t first = 0, end = 0; first < contacts.size(); first = end) {
    end = end_of_pair(contacts, first);
    const bool many = is_reducible(reach.model, contacts[first]);
    if (many) choose(reach, std::span(contacts).subspan(first, end - first));
    for (std::size_t i = first; i < end; ++i) {
      if (many && !needed_[i - first])
        redundant_.push_back(contacts[i]);
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

// Overlaps of points with rows are known: the rows remove them as fast as they may. A redundant point is
// added if it gets deeper than all points of its pair with rows. Three digits of the margin are neglected:
// without them a sole has more points than it needs (test_contact_points).
void RedundantPoints::call_in(const Reach& reach, std::vector<Contact>& contacts) {
  const double neglected = base::policy.three_digits * reach.margin;
  const auto overlaps = [&](const Contact& c, double held) { return end_gap(c, reach) < held - neglected; };
  if (std::none_of(redundant_.begin(), redundant_.end(), [&](const Contact& c) { return overlaps(c, 0); }))
    return;
  sort_by_pair(contacts, by_pair_, [](std::size_t) { return true; });
  called_.clear();
  std::size_t out = 0;
  for (std::size_t first = 0, end = 0; first < redundant_.size(); first = end) {
    end = end_of_pair(redundant_, first);
    const auto [begin, after] = keys_of(by_pair_, pair_of(redundant_[first]));
    const auto rows = std::span(by_pair_).subspan(static_cast<std::size_t>(begin - by_pair_.begin()),
                                                  static_cast<std::size_t>(after - begin));
    const double held = deepest(contacts, rows, reach);
    for (std::size_t i = first; i < end; ++i) {
      if (overlaps(redundant_[i], held))
        called_.push_back(redundant_[i]);
      else if (out++ != i)
        redundant_[out - 1] = redundant_[i];
    }
  }
  redundant_.resize(out);
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
  for (std::size_t i = 0; i < found.size(); ++i) (needed_[i] ? contacts : redundant_).push_back(found[i]);
}

}  // namespace amontons
