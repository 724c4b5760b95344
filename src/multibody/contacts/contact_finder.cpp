// Speculative contacts: a point becomes a contact before it touches if the velocities could close its gap
// within the step. The step then lets the gap close and no further (c = gap / h). No motion is interrupted,
// and fast bodies do not pass through thin ones.
#include "multibody/contacts/contact_finder.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <span>

#include "multibody/contacts/contact_law.hpp"
#include "multibody/contacts/policy.hpp"
#include "multibody/contacts/touch.hpp"

namespace amontons {

namespace {

// The part of an angular velocity that moves the surface of a shape: a turn about an axis of revolution moves
// no point along its normal.
Vec3 effective_spin(const Shape& shape, const Transform& frame, const Vec3& spin) {
  if (std::holds_alternative<Sphere>(shape)) return {};
  if (!std::holds_alternative<Capsule>(shape) && !std::holds_alternative<Cylinder>(shape)) return spin;
  const Vec3 axis = rotate(frame.rotation, {0, 0, 1});
  return spin - dot(spin, axis) * axis;
}

GeomMotion motion_of(const Geom& geom, const Transform& frame, const BodyFrame& body, const BodyVelocity& v) {
  const double turning = norm(effective_spin(geom.shape, frame, v.angular));
  // A plane has an infinite radius, for which 0 times infinity must be 0.
  return {v.linear + cross(v.angular, frame.position - body.centre),
          turning > 0 ? turning * bounding_radius(geom.shape) : 0};
}

// Upper bound of the approach speed of two geoms.
inline double approach(const GeomMotion& a, const GeomMotion& b) {
  return norm(a.centre - b.centre) + a.spin + b.spin;
}

// Arms on the world are measured from its origin.
Vec3 centre_of(const Reach& reach, Index body) { return body < 0 ? Vec3{} : reach.bodies[body].centre; }

// The data that all contacts of two geoms share.
void set_pair(const Model& model, Index a, Index b, const BodyFrames& bodies, Contact& c) {
  c.body_a = model.outline(a).body;
  c.body_b = model.outline(b).body;
  c.geom_a = a;
  c.geom_b = b;
  c.material = model.material(a, b);
  c.rows = rows_of(c.material);
  // A new contact has not slipped yet.
  if (c.material.friction_static >= 0) set_friction(model.material(a, b), 0, c);
  // The friction direction of the surface that has one.
  if (c.material.friction_across >= 0) {
    // It belongs to the geom with the second coefficient. A's counts if both have one, or if the pair has a
    // material of its own.
    const Geom &geom_a = model.geom(a), &geom_b = model.geom(b);
    const bool of_a = geom_a.material.friction_across >= 0, of_b = geom_b.material.friction_across >= 0;
    const bool first = of_a || (!of_b && !(geom_a.friction_direction == Vec3{}));
    c.direction = in_world((first ? geom_a : geom_b).friction_direction, first ? geom_a : geom_b, bodies);
  }
}

// By how much the bounds of a geom that does not turn grow, so that those of two touch within the margin.
double least_growth(const Reach& reach, std::size_t geom) {
  return 0.5 * reach.margin + reach.model.rest_offset(static_cast<Index>(geom));
}

constexpr double unbounded = std::numeric_limits<double>::infinity();

}  // namespace

SurfaceMotion motion_of_surfaces(const Model& model, Index a, const Transform& frame_a, Index b,
                                 const Transform& frame_b, const BodyFrames& bodies) {
  const auto of = [&](Index g, const Transform& frame) {
    const Geom& geom = model.geom(g);
    const Vec3 spin = in_world(geom.surface_spin, geom, bodies);
    return SurfaceMotion{true, in_world(geom.surface_velocity, geom, bodies) - cross(spin, frame.position),
                         spin};
  };
  const SurfaceMotion on_a = of(a, frame_a), on_b = of(b, frame_b);
  return {true, on_a.linear - on_b.linear, on_a.spin - on_b.spin};
}

// The motion of a geom with the velocity of its body. A turn of a ball moves no point of its surface along
// the normal, nor its centre.
GeomMotion ContactFinder::motion(const Reach& reach, std::size_t geom, const BodyVelocity& v) const {
  const Model::Outline& outline = reach.model.outline(static_cast<Index>(geom));
  if (outline.radius > 0) return {v.linear, 0};
  return motion_of(reach.model.description().geoms[geom], frames_[geom], reach.bodies[outline.body], v);
}

// Poses do not change between the searches of a step. So the first search places the geoms, and the others
// only widen the boxes by their own velocities. Bodies that stand are where the last step placed them.
void ContactFinder::place_geoms(const Reach& reach) {
  const Model& model = reach.model;
  const auto& geoms = model.description().geoms;
  const bool placed = frames_.size() == geoms.size();
  frames_.resize(geoms.size());
  bounds_.resize(geoms.size());
  fixed_.resize(geoms.size());
  extents_.resize(geoms.size(), reach.memory());
  extents_.placed = next_number();
  HostArray<Ball>& balls = extents_.balls;
  const auto place = [&](std::size_t g) {
    const Model::Outline& outline = model.outline(static_cast<Index>(g));
    if (placed && standing_.stand(outline.body, world)) return;
    fixed_[g] = !outline.dynamic;
    if (outline.radius > 0) {
      frames_[g] = reach.bodies[outline.body].pose;  // how a ball turns in it does not matter
      balls[g] = {frames_[g].position, with_rounding * (outline.radius + least_growth(reach, g))};
      return;
    }
    const Geom& geom = geoms[g];
    frames_[g] = geom.body < 0 ? geom.frame : reach.bodies[geom.body].pose * geom.frame;
    balls[g] = {frames_[g].position, unbounded};
    if (const auto* sphere = std::get_if<Sphere>(&geom.shape))
      balls[g].radius = with_rounding * (sphere->radius + least_growth(reach, g));
    else
      bounds_[g] = quick_bounds(geom.shape, frames_[g]);
  };
  reach.visited.geoms.each(geoms.size(), place, reach.threads);
}

// Motions of the geoms, and the boxes that they may reach within the step. A box covers the travel of the
// centre and grows by half of the margin, by the effect of turning, and by the rest offset. So the boxes of
// all pairs that could touch overlap. The ball of a sphere, which no turn moves, has grown already. Two of
// them have a point within the margin, now or at the end of the step, only if they may touch. A plane has no
// box, but a height up to which it may reach.
void ContactFinder::reach_out(const Reach& reach, const Subset& visited) {
  const Model& model = reach.model;
  const auto& geoms = model.description().geoms;
  auto& [boxes, balls, travels, half_spaces, _] = extents_;
  motions_.resize(geoms.size());
  const auto reach_out = [&](std::size_t g) {
    const Model::Outline& outline = model.outline(static_cast<Index>(g));
    motions_[g] = outline.still ? GeomMotion{} : motion(reach, g, reach.v[outline.body]);
    const Vec3 travel = travels[g] = reach.h * motions_[g].centre;
    if (balls[g].radius < unbounded) {
      boxes[g] = box_around(balls[g], travel);
      return;
    }
    const double grow = least_growth(reach, g) + reach.h * motions_[g].spin;
    for (int i = 0; i < 3; ++i) {
      boxes[g].lower[i] = bounds_[g].lower[i] + (std::min(0.0, travel[i]) - grow);
      boxes[g].upper[i] = bounds_[g].upper[i] + (std::max(0.0, travel[i]) + grow);
    }
    if (outline.plane) {
      const Vec3 normal = rotate(frames_[g].rotation, {0, 0, 1});
      half_spaces[g] = {normal, dot(normal, frames_[g].position) + std::max(0.0, dot(normal, travel)) + grow};
    }
  };
  visited.each(geoms.size(), reach_out, reach.threads);
}

// Where solved velocities lead out of the list, most geoms stay, and a search of the others costs less than a
// new list.
std::span<const IndexPair> ContactFinder::find_pairs(const Reach& reach) {
  const Model& model = reach.model;
  if (model.lists_pairs()) return model.listed_pairs();
  if (near_.hold(reach, {}, extents_, stay_)) return near_.pairs();
  broad_phase_.find_pairs(extents_.bounds(stay_), pairs_, reach.pairs, reach.threads);
  std::erase_if(pairs_, [&](const IndexPair& pair) { return !model.may_touch(pair.first, pair.second); });
  return pairs_;
}

// Largest distance of two geoms that can come into the margin within the step.
double ContactFinder::reach_of_pair(const Reach& reach, Index a, Index b) const {
  return reach.margin + reach.h * approach(motions_[a], motions_[b]);
}

// Appends the points in reach of the velocities of those pairs that counts() accepts, if keep(contact, gap at
// the end of the step) does. A record is large: it is written where it stays, and is used again for the next
// point if it does not.
template <class Counts, class Keep>
void ContactFinder::visit(const Reach& reach, std::span<const IndexPair> pairs,
                          std::vector<ContactPoint>& points, std::vector<Contact>& contacts, Counts&& counts,
                          Keep&& keep) const {
  const Model& model = reach.model;
  for (auto [a, b] : pairs) {
    if (!counts(a, b)) continue;
    // A is the moving one, so that normals point to a body that responds.
    if (fixed_[a] && !fixed_[b]) std::swap(a, b);
    points.clear();
    collide_geoms(model, {a, frames_[a]}, {b, frames_[b]},
                  reach_of_pair(reach, a, b) + (model.rest_offset(a) + model.rest_offset(b)), points);
    // Materials and frames are looked up only for touching pairs; the list has many more.
    if (points.empty()) continue;
    set_pair(model, a, b, reach.bodies, contacts.emplace_back());
    const SurfaceMotion surface = surface_motion(model, a, frames_[a], b, frames_[b], reach.bodies);
    const Vec3 centre_a = centre_of(reach, contacts.back().body_a);
    const Vec3 centre_b = centre_of(reach, contacts.back().body_b);
    bool kept = false;
    for (const ContactPoint& p : points) {
      Contact& c = kept ? contacts.emplace_back(contacts.back()) : contacts.back();
      move_to(p, centre_a, centre_b, surface, c);
      kept = keep(c, c.gap + reach.h * opening(c, reach.v));
    }
    if (!kept) contacts.pop_back();
  }
}

// A point counts if it is within the margin now, or at the end of the step with the free velocities. Both are
// needed: a body at rest has no velocity that shows the contact, a flying one no gap that does.
void ContactFinder::collide_pairs(const Reach& reach, std::span<const IndexPair> pairs, Part& part) const {
  auto& [points, contacts, kept, _1, _2] = part;
  const auto all = [](Index, Index) { return true; };
  contacts.clear();
  kept.clear();
  StandingPairs::Cursor last = pairs.empty() ? 0 : standing_.at(pairs.front());
  for (const IndexPair& pair : pairs) {
    if (!may_meet(pair.first, pair.second)) continue;
    const std::size_t before = contacts.size();
    const bool stand =
        standing_.stand(reach.model.outline(pair.first).body, reach.model.outline(pair.second).body);
    const StandingPairs::Kept::Pair* known = stand ? standing_.find(pair, last) : nullptr;
    if (known) {
      const std::span<const Contact> found = standing_.contacts(*known);
      contacts.insert(contacts.end(), found.begin(), found.end());
    } else {
      visit(reach, {&pair, 1}, points, contacts, all, [&](const Contact& contact, double closing) {
        return contact.gap <= reach.margin || closing <= reach.margin;
      });
    }
    if (stand) kept.add(pair, std::span(contacts).subspan(before));
  }
}

// Pairs are independent of each other. Threads take parts of the list, and the parts are joined in its order:
// the contacts are those of one thread. The first part writes into `contacts` itself, so that one thread
// copies nothing.
void ContactFinder::find(const Reach& reach, std::vector<Contact>& contacts) {
  foreseen_.resize(reach.v.size());
  reach.visited.bodies.each(reach.v.size(), [&](std::size_t i) { foreseen_[i] = reach.v[i]; });
  by_pair_.clear();
  if (!reach.visited.geoms.only) calm_.clear();
  standing_.begin(reach);
  place_geoms(reach);
  const Subset visited = reached_otherwise_ ? Subset{} : reach.visited.geoms;
  reached_otherwise_ = false;
  reach_out(reach, visited);
  stay_.resize(fixed_.size());
  visited.each(stay_.size(), [&](std::size_t g) {
    const Index body = reach.model.outline(static_cast<Index>(g)).body;
    stay_[g] = !reach.has_sleepers() ? fixed_[g] : body < 0 || reach.asleep->stays[body];
  });
  const std::span<const IndexPair> near = reach.model.lists_pairs()
                                              ? std::span<const IndexPair>(reach.model.listed_pairs())
                                              : near_.find(reach, visited, extents_, motions_, stay_);
  if (parts_.empty()) parts_.emplace_back();
  contacts.swap(parts_[0].contacts);
  const std::span<Part> parts =
      in_parts(reach, near.size(), [&](Part& part, std::size_t first, std::size_t last) {
        collide_pairs(reach, near.subspan(first, last - first), part);
      });
  contacts.swap(parts[0].contacts);
  for (const Part& part : parts.subspan(1)) {
    contacts.insert(contacts.end(), part.contacts.begin(), part.contacts.end());
    parts[0].kept.append(part.kept);
  }
  standing_.keep(parts[0].kept);
  disturbed_.clear();
  for (const Contact& c : contacts) note_disturbed(reach, c);
  // Support contacts of a body are only known now.
  level(reach, edges_.find(reach, frames_, contacts), contacts);
  redundant_.set_aside(reach, contacts);
}

void ContactFinder::note_disturbed(const Reach& reach, const Contact& c) {
  if (!reach.has_sleepers()) return;
  for (const Index body : {c.body_a, c.body_b})
    if (reach.asleep->contains(body)) disturbed_.push_back(body);
}

// Pairs of the passages get the points along the neighbour's normal. The order by pairs is kept for the rest
// of the step. In most steps there is nothing to do.
void ContactFinder::level(const Reach& reach, std::span<const InternalEdges::Passage> passages,
                          std::vector<Contact>& contacts) {
  if (passages.empty()) return;
  found_.clear();
  std::size_t next = 0;
  const auto copy_to = [&](std::size_t end) {
    for (; next < end; ++next) found_.push_back(contacts[next]);
  };
  for (const InternalEdges::Passage& p : passages) {
    copy_to(p.first);
    Contact c = contacts[p.first];
    const SurfaceMotion surface =
        surface_motion(reach.model, c.geom_a, frames_[c.geom_a], c.geom_b, frames_[c.geom_b], reach.bodies);
    const Index x = p.a_passes ? c.geom_a : c.geom_b, y = p.a_passes ? c.geom_b : c.geom_a;
    next = p.end;
    if (is_static_only(reach.model.geom(y).shape)) continue;
    points_.clear();
    collide_along(p.normal, {reach.model.geom(x).shape, frames_[x]}, {reach.model.geom(y).shape, frames_[y]},
                  reach_of_pair(reach, x, y) + c.material.rest_offset, points_);
    for (ContactPoint& point : points_) {
      if (!p.a_passes) point.normal = -point.normal;
      move_to(point, centre_of(reach, c.body_a), centre_of(reach, c.body_b), surface, c);
      if (c.gap <= reach.margin || end_gap(c, reach) <= reach.margin) found_.push_back(c);
    }
  }
  copy_to(contacts.size());
  contacts.swap(found_);
}

// Both searches report overlaps above the allowance.
void ContactFinder::find_unforeseen(const Reach& reach, std::vector<Contact>& contacts) {
  const double allowance = contacts::policy.allowance * reach.margin;
  redundant_.call_in(reach, contacts);
  edges_.call_in(reach, contacts);
  find_missed(reach, allowance, contacts);
  find_overlaps(reach, allowance, contacts);
}

bool ContactFinder::is_known(const Reach& reach, const Contact& contact,
                             const std::vector<Contact>& contacts) const {
  const double same = contacts::policy.level * reach.margin;
  const auto [first, last] = keys_of(by_pair_, pair_of(contact));
  return std::any_of(first, last, [&](const PairKey& key) {
    return norm(contacts[key.contact].point - contact.point) <= same;
  });
}

void ContactFinder::sort_all(const std::vector<Contact>& contacts) {
  if (by_pair_.size() != contacts.size()) sort_by_pair(contacts, by_pair_, [](std::size_t) { return true; });
}

void ContactFinder::find_fixed(const Reach& reach, std::vector<Contact>& contacts) {
  sort_all(contacts);
  found_.clear();
  reach_out(reach, {});
  stay_ = fixed_;
  reached_otherwise_ = true;
  const auto one_moves = [&](Index a, Index b) { return fixed_[a] != fixed_[b] && may_meet(a, b); };
  visit(reach, find_pairs(reach), points_, found_, one_moves, [&](const Contact& contact, double closing) {
    return closing < -contacts::policy.allowance * reach.margin && !is_known(reach, contact, contacts);
  });
  contacts.insert(contacts.end(), found_.begin(), found_.end());
}

void ContactFinder::find_missed(const Reach& reach, double allowance, std::vector<Contact>& contacts) {
  // No point deviates from its prediction by more than the change of the velocities since the first search,
  // including impacts. The points left out are those with a predicted gap above the margin at the end. If the
  // velocities of a pair change by less than (margin + allowance) / h, none of its points gets deeper than
  // the allowance. The search is then not needed; in most steps no pair needs it. In a pile a few pairs do:
  // those of a geom whose velocity changes by half as much.
  const Model& model = reach.model;
  const auto& geoms = model.description().geoms;
  changes_.resize(geoms.size());
  const Subset visited = calm_.size() == geoms.size() ? reach.visited.geoms : Subset{};
  calm_.resize(geoms.size());
  visited.each(geoms.size(), [&](std::size_t g) {
    const Index body = model.outline(static_cast<Index>(g)).body;
    changes_[g] = {};
    calm_[g] = 1;
    if (fixed_[g]) return;
    const BodyVelocity difference{reach.v[body].linear - foreseen_[body].linear,
                                  reach.v[body].angular - foreseen_[body].angular};
    changes_[g] = motion(reach, g, difference);
    calm_[g] = 2 * reach.h * (norm(changes_[g].centre) + changes_[g].spin) <= reach.margin + allowance;
  });
  if (calm_.empty() || !std::memchr(calm_.data(), 0, calm_.size())) return;
  stay_ = calm_;
  // Two bodies asleep that lose the same free velocities find what they found in the step before: nothing.
  const auto sleeps = [&](Index g) {
    return reach.has_sleepers() && (fixed_[g] || reach.asleep->contains(geoms[g].body));
  };
  const auto changed = [&](Index a, Index b) {
    return may_meet(a, b) && !(sleeps(a) && sleeps(b)) &&
           reach.h * approach(changes_[a], changes_[b]) > reach.margin + allowance;
  };
  sort_all(contacts);
  found_.clear();
  reach_out(reach, {});
  reached_otherwise_ = true;
  visit(reach, find_pairs(reach), points_, found_, changed, [&](const Contact& contact, double closing) {
    if (closing >= -allowance) return false;
    note_disturbed(reach, contact);
    return !edges_.passes(reach, frames_, contact) && !is_known(reach, contact, contacts);
  });
  for (std::size_t first = 0, end = 0; first < found_.size(); first = end) {
    end = end_of_pair(found_, first);
    redundant_.add(reach, std::span(found_).subspan(first, end - first), contacts);
  }
}

}  // namespace amontons
