// Removes false contacts at internal edges: see InternalEdges. The decision is by geometry alone, at the
// start of the step, because the free velocities of resting bodies say little. If the solve separates the
// neighbours, the contacts are restored.
//
// Let X touch Z with the normal m, X above the plane of that contact and Z below it. If a geom Y does not
// rise above that plane either, the plane separates it from X, whatever the nearest direction from X to Y is.
// So m is a normal of the pair X, Y as well, and along it the pair has points where X is above a face of Y.
// The points in the nearest direction, at the rim of Y, correspond to those at inner edges of a triangle
// mesh.
#include "multibody/contacts/internal_edges.hpp"

#include <algorithm>

#include "amontons/base/policy.hpp"
#include "amontons/collision/narrow/extent.hpp"
#include "multibody/contacts/policy.hpp"

namespace amontons {

namespace {

// Faces whose heights differ by less are level (m).
double level_of(double margin) { return contacts::policy.level * margin; }

// Whether two normals of which this is the cosine are the same, to rounding.
bool are_same(double cosine) { return cosine > 1 - base::policy.rounding; }

// Whether a geom may pass an internal edge: a convex shape of a body that impulses move.
bool may_pass(const Model& model, Index body, Index geom) {
  return model.is_dynamic(body) && !is_static_only(model.geom(geom).shape);
}

// Whether one of two geoms has an edge, or may be flush with one. Round shapes touch each other anywhere
// along the nearest direction.
bool may_have_edge(const Model& model, const Contact& c) {
  return !(model.outline(c.geom_a).round && model.outline(c.geom_b).round);
}

// Height by which one geom rises beside another one within the step, at a point and along a direction.
double rise_of(const Reach& reach, Index geom, Index beside, const Vec3& point, const Vec3& up) {
  const auto speed = [&](Index g) {
    const Index body = reach.model.geom(g).body;
    if (body < 0) return 0.0;
    const BodyVelocity& v = reach.v[body];
    return dot(up, v.linear + cross(v.angular, point - reach.bodies[body].centre));
  };
  return reach.h * (speed(geom) - speed(beside));
}

}  // namespace

InternalEdges::Touch InternalEdges::touch_of(const Contact& c, bool of_a, std::uint32_t pair) {
  const Vec3 up = of_a ? c.normal : -c.normal;
  const Vec3 half = (0.5 * (c.gap + c.material.rest_offset)) * up;
  return {of_a ? c.geom_a : c.geom_b, of_a ? c.geom_b : c.geom_a, up, c.point + half, c.point - half, pair};
}

std::span<const InternalEdges::Touch> InternalEdges::touches_of(Index geom) const {
  const auto g = static_cast<std::size_t>(geom);
  return std::span(touches_).subspan(start_[g], start_[g + 1] - start_[g]);
}

// Finds the touch whose plane separates the two geoms of the given touch. rises(t): height by which the
// support of the given touch may rise beside that of t.
const InternalEdges::Touch* InternalEdges::find_level(const Reach& reach,
                                                      const std::vector<Transform>& frames,
                                                      const Touch& touch, auto&& rises) const {
  const Shape &x = reach.model.geom(touch.body).shape, &y = reach.model.geom(touch.support).shape;
  const double level = level_of(reach.margin);
  const Transform& support = frames[touch.support];
  for (const Touch& t : touches_of(touch.body)) {
    if (states_[t.pair].passed || t.support == touch.support || are_same(dot(touch.up, t.up))) continue;
    // A quick test: the support is usually far above the plane.
    if (dot(t.up, support.position - t.on_support) > level) continue;
    const double rise = extent_along(y, support, t.up, t.on_support);
    if (rise + rises(t) > level || extent_along(x, frames[t.body], -t.up, t.on_body) > level) continue;
    // If each support is a possible neighbour of the other, the lower one counts.
    const Shape& z = reach.model.geom(t.support).shape;
    if (!is_static_only(z) && extent_along(z, frames[t.support], touch.up, touch.on_support) < rise) continue;
    // A plane supports a ball everywhere. Other shapes may tip, so they need a face to rest on.
    if (std::holds_alternative<Sphere>(x) || has_face(y, support, t.up)) return &t;
  }
  return nullptr;
}

// The same for a contact with the rim of a triangle surface. Inner edges of such a surface only have normals
// of the surface. At its rim the neighbour decides. A normal that belongs to no triangle is rejected if the
// neighbour begins at the point and continues in the direction in which the normal leans.
const InternalEdges::Touch* InternalEdges::find_rim(const Reach& reach, const std::vector<Transform>& frames,
                                                    const Touch& touch) const {
  const double level = level_of(reach.margin);
  for (const Touch& t : touches_of(touch.body)) {
    const double cosine = dot(touch.up, t.up);
    if (states_[t.pair].passed || t.support == touch.support || are_same(cosine) ||
        cosine < -base::half_of_digits())
      continue;
    const Vec3 behind =
        touch.on_support + (contacts::policy.allowance * reach.margin) * normalised(touch.up - cosine * t.up);
    const Shape& z = reach.model.geom(t.support).shape;
    if (is_near(z, frames[t.support], touch.on_support, level) &&
        is_near(z, frames[t.support], behind, level) &&
        !has_triangle(reach.model.geom(touch.support).shape, frames[touch.support], touch.up,
                      touch.on_support, level))
      return &t;
  }
  return nullptr;
}

// If both geoms may pass, the one with fewer touches does, which keeps the search short.
const InternalEdges::Touch* InternalEdges::judge(const Reach& reach, const std::vector<Transform>& frames,
                                                 const Contact& contact, auto&& rises) const {
  if (!may_have_edge(reach.model, contact)) return nullptr;
  const bool a = may_pass(reach.model, contact.body_a, contact.geom_a);
  const bool b = may_pass(reach.model, contact.body_b, contact.geom_b);
  const Shape &of_geom_a = reach.model.geom(contact.geom_a).shape,
              &of_geom_b = reach.model.geom(contact.geom_b).shape;
  // A plane has only one normal.
  if (std::holds_alternative<Plane>(of_geom_a) || std::holds_alternative<Plane>(of_geom_b) || !(a || b))
    return nullptr;
  if (is_static_only(of_geom_a) || is_static_only(of_geom_b))
    return find_rim(reach, frames, touch_of(contact, a, 0));
  const std::size_t of_a = touches_of(contact.geom_a).size(), of_b = touches_of(contact.geom_b).size();
  const Touch* level = nullptr;
  if (a && (!b || of_a <= of_b)) level = find_level(reach, frames, touch_of(contact, true, 0), rises);
  if (!level && b && (!a || of_b <= of_a))
    level = find_level(reach, frames, touch_of(contact, false, 0), rises);
  return level;
}

// The touches of all geoms that may pass an edge, geom by geom, in the order of the pairs. In a pile of balls
// only those beside the walls may.
void InternalEdges::collect(const Model& model, const std::vector<Contact>& contacts) {
  found_.clear();
  states_.clear();
  at_edge_.assign(model.description().geoms.size(), 0);
  start_.assign(model.description().geoms.size() + 1, 0);
  // Pairs of geoms that have no edge in any pair need no touches.
  for (const Contact& c : contacts)
    if (may_have_edge(model, c)) at_edge_[c.geom_a] = at_edge_[c.geom_b] = 1;
  for (std::size_t first = 0, end = 0; first < contacts.size(); first = end) {
    end = end_of_pair(contacts, first);
    if (!at_edge_[contacts[first].geom_a] && !at_edge_[contacts[first].geom_b]) continue;
    // The deepest point represents the pair.
    std::size_t deepest = first;
    for (std::size_t i = first + 1; i < end; ++i)
      if (contacts[i].gap < contacts[deepest].gap) deepest = i;
    // A pair without an edge never passes: it is held from the beginning.
    states_.push_back({first, end, deepest, false, !may_have_edge(model, contacts[first])});
  }
  for (std::uint32_t pair = 0; pair < states_.size(); ++pair) {
    const Contact& c = contacts[states_[pair].deepest];
    if (at_edge_[c.geom_a] && may_pass(model, c.body_a, c.geom_a)) found_.push_back(touch_of(c, true, pair));
    if (at_edge_[c.geom_b] && may_pass(model, c.body_b, c.geom_b)) found_.push_back(touch_of(c, false, pair));
  }
  for (const Touch& t : found_) ++start_[static_cast<std::size_t>(t.body) + 1];
  for (std::size_t g = 1; g < start_.size(); ++g) start_[g] += start_[g - 1];
  touches_.resize(found_.size());
  place_.assign(start_.begin(), start_.end());
  for (const Touch& t : found_) touches_[place_[static_cast<std::size_t>(t.body)]++] = t;
}

std::span<const InternalEdges::Passage> InternalEdges::find(const Reach& reach,
                                                            const std::vector<Transform>& frames,
                                                            const std::vector<Contact>& contacts) {
  passages_.clear();
  passed_.clear();
  collect(reach.model, contacts);
  for (PairState& pair : states_) {
    const auto all = std::span(contacts).subspan(pair.first, pair.end - pair.first);
    // Contacts that do not close within the step have no effect. A contact that supports another passage
    // stays.
    const auto closes = [&](const Contact& c) { return end_gap(c, reach) < 0; };
    if (pair.holds || std::none_of(all.begin(), all.end(), closes)) continue;
    // Points of a triangle surface have individual normals. For other pairs one decision holds for all
    // points.
    const Model& model = reach.model;
    if (is_static_only(model.geom(all[0].geom_a).shape) || is_static_only(model.geom(all[0].geom_b).shape)) {
      for (std::size_t i = pair.first; i < pair.end; ++i)
        if (closes(contacts[i])) try_passage(reach, frames, contacts, i, {i, i + 1}, pair);
    } else {
      try_passage(reach, frames, contacts, pair.deepest, {pair.first, pair.end}, pair);
    }
  }
  return passages_;
}

// Tries a passage for the contacts of `part`, decided for one of them.
void InternalEdges::try_passage(const Reach& reach, const std::vector<Transform>& frames,
                                const std::vector<Contact>& contacts, std::size_t judged, const Range& part,
                                PairState& pair) {
  const Contact& c = contacts[judged];
  const Touch* level = judge(reach, frames, c, [](const Touch&) { return 0.0; });
  if (!level) return;
  pair.passed = pair.passed || judged == pair.deepest;
  states_[level->pair].holds = true;
  const bool a_passes = level->body == c.geom_a;
  const Index support = a_passes ? c.geom_b : c.geom_a;
  passages_.push_back({part.first, part.end, level->up, a_passes});
  if (reach.model.outline(support).still && reach.model.outline(level->support).still) return;
  for (std::size_t i = part.first; i < part.end; ++i)
    passed_.push_back({contacts[i], support, level->support, level->up});
}

void InternalEdges::call_in(const Reach& reach, std::vector<Contact>& contacts) {
  const double level = level_of(reach.margin);
  std::erase_if(passed_, [&](const Passed& p) {
    if (end_gap(p.contact, reach) >= -level ||
        !(rise_of(reach, p.support, p.level, p.contact.point, p.up) > level))
      return false;
    contacts.push_back(p.contact);
    return true;
  });
}

bool InternalEdges::passes(const Reach& reach, const std::vector<Transform>& frames,
                           const Contact& contact) const {
  return judge(reach, frames, contact, [&](const Touch& t) {
           const Index support = t.body == contact.geom_a ? contact.geom_b : contact.geom_a;
           return rise_of(reach, support, t.support, contact.point, t.up);
         }) != nullptr;
}

}  // namespace amontons
