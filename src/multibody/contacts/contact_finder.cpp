// Speculative contacts: a point becomes a contact before it touches if the velocities could close its gap
// within the step. The step then lets the gap close and no further (c = gap / h). No motion is interrupted,
// and fast bodies do not pass through thin ones.
#include "multibody/contacts/contact_finder.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <span>

#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/contacts/policy.hpp"

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
double approach(const GeomMotion& a, const GeomMotion& b) {
  return norm(a.centre - b.centre) + a.spin + b.spin;
}

// Directions of a geom, given in the frame of its body.
Vec3 in_world(const Vec3& v, const Geom& geom, const BodyFrames& bodies) {
  if (v == Vec3{}) return {};
  return geom.body < 0 ? v : rotate(bodies[geom.body].pose.rotation, v);
}

// The velocity of the surface of A over its body minus that of B: at the world's origin, and the spin.
struct SurfaceMotion {
  Vec3 linear, spin;
};

SurfaceMotion surface_motion(const Geom& a, const Transform& frame_a, const Geom& b, const Transform& frame_b,
                             const BodyFrames& bodies) {
  const auto of = [&](const Geom& geom, const Transform& frame) {
    const Vec3 spin = in_world(geom.surface_spin, geom, bodies);
    return SurfaceMotion{in_world(geom.surface_velocity, geom, bodies) - cross(spin, frame.position), spin};
  };
  const SurfaceMotion on_a = of(a, frame_a), on_b = of(b, frame_b);
  return {on_a.linear - on_b.linear, on_a.spin - on_b.spin};
}

// Arms on the world are measured from its origin.
Vec3 centre_of(const Reach& reach, Index body) { return body < 0 ? Vec3{} : reach.bodies[body].centre; }

// The data that all contacts of two geoms share.
Contact contact_of(const Model& model, Index a, Index b, const BodyFrames& bodies) {
  const Geom &geom_a = model.geom(a), &geom_b = model.geom(b);
  Contact c;
  c.body_a = geom_a.body;
  c.body_b = geom_b.body;
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
    const bool of_a = geom_a.material.friction_across >= 0, of_b = geom_b.material.friction_across >= 0;
    const bool first = of_a || (!of_b && !(geom_a.friction_direction == Vec3{}));
    c.direction = in_world((first ? geom_a : geom_b).friction_direction, first ? geom_a : geom_b, bodies);
  }
  return c;
}

// Sets the contact of a pair to one of its points, for bodies with these centres of mass. Only the tangential
// part of surface velocities counts: a conveyor does not lift its load.
void move_to(const ContactPoint& p, const Vec3& centre_a, const Vec3& centre_b, const SurfaceMotion& surface,
             Contact& c) {
  c.point = p.point;
  c.normal = p.normal;
  c.gap = p.gap - c.material.rest_offset;
  c.r_a = p.point - centre_a;
  if (c.body_b >= 0) c.r_b = p.point - centre_b;
  const Vec3 surface_velocity = surface.linear + cross(surface.spin, p.point);
  c.surface_velocity = surface_velocity - dot(p.normal, surface_velocity) * p.normal;
}

// Whether normals jump on the surface of a shape.
bool has_edges(const Shape& shape) {
  return !std::holds_alternative<Sphere>(shape) && !std::holds_alternative<Capsule>(shape) &&
         !std::holds_alternative<Ellipsoid>(shape) && !std::holds_alternative<Plane>(shape);
}

// Change of a normal that moves with a body, as a length; smaller changes are rounding.
constexpr double same_normal = 1e-6;  // not tuned: rounding

// A ball that is larger by this factor contains what arithmetic takes for its surface.
constexpr double with_rounding = 1 + 1e-12;  // not tuned: rounding
constexpr double unbounded = std::numeric_limits<double>::infinity();

// Poses of bodies after a time t with the velocities of a reach. A body of a pile belongs to many pairs: its
// pose is found once.
struct Later {
  const Reach& reach;
  double t;
  std::vector<std::optional<Transform>>& poses;
  Later(const Reach& r, double time, std::vector<std::optional<Transform>>& memory)
      : reach(r), t(time), poses(memory) {
    poses.assign(reach.bodies.size(), std::nullopt);
  }

  double turn(Index body) const { return body < 0 ? 0.0 : t * norm(reach.v[body].angular); }
  Vec3 centre(Index body) const {
    return body < 0 ? Vec3{} : reach.bodies[body].centre + t * reach.v[body].linear;
  }
  Transform frame(const Geom& geom) const {
    if (geom.body < 0) return geom.frame;
    std::optional<Transform>& pose = poses[static_cast<std::size_t>(geom.body)];
    if (!pose) pose = moved(reach.bodies[geom.body], reach.v[geom.body], t);
    return *pose * geom.frame;
  }
};

}  // namespace

// Poses and motions of the geoms, and the boxes that they may reach within the step. A box covers the travel
// of the centre and grows by half of the margin, by the effect of turning, and by the rest offset. So the
// boxes of all pairs that could touch overlap. So do the balls of spheres, which grow by the travel in every
// direction. A plane has no box, but a height up to which it may reach.
void ContactFinder::place_geoms(const Reach& reach) {
  const Model& model = reach.model;
  const auto& geoms = model.description().geoms;
  frames_.resize(geoms.size());
  boxes_.resize(geoms.size());
  balls_.resize(geoms.size());
  fixed_.resize(geoms.size());
  half_spaces_.resize(geoms.size());
  motions_.assign(geoms.size(), GeomMotion{});
  for (std::size_t g = 0; g < geoms.size(); ++g) {
    const Geom& geom = geoms[g];
    const Index body = geom.body;
    frames_[g] = body < 0 ? geom.frame : reach.bodies[body].pose * geom.frame;
    boxes_[g] = quick_bounds(geom.shape, frames_[g]);
    fixed_[g] = !model.is_dynamic(body);
    if (body >= 0 && model.body(body).motion != Motion::fixed)
      motions_[g] = motion_of(geom, frames_[g], reach.bodies[body], reach.v[body]);
    const Vec3 way = reach.h * motions_[g].centre;
    const double grow =
        0.5 * reach.margin + reach.h * motions_[g].spin + model.rest_offset(static_cast<Index>(g));
    const auto* sphere = std::get_if<Sphere>(&geom.shape);
    balls_[g] = {frames_[g].position,
                 sphere ? with_rounding * (sphere->radius + grow + norm(way)) : unbounded};
    for (int i = 0; i < 3; ++i) {
      boxes_[g].lower[i] += std::min(0.0, way[i]) - grow;
      boxes_[g].upper[i] += std::max(0.0, way[i]) + grow;
    }
    if (std::holds_alternative<Plane>(geom.shape)) {
      const Vec3 normal = rotate(frames_[g].rotation, {0, 0, 1});
      half_spaces_[g] = {normal, dot(normal, frames_[g].position) + std::max(0.0, dot(normal, way)) + grow};
    }
  }
}

bool ContactFinder::is_reached(Index a, Index b) const {
  const auto reaches = [&](Index plane, const Aabb& box) {
    const auto& [normal, top] = half_spaces_[plane];
    Vec3 lowest;
    for (int i = 0; i < 3; ++i) lowest[i] = normal[i] > 0 ? box.lower[i] : box.upper[i];
    return !(dot(normal, lowest) > top);
  };
  const auto is_plane = [&](Index g) { return boxes_[g].upper.x == std::numeric_limits<double>::infinity(); };
  return (!is_plane(a) || reaches(a, boxes_[b])) && (!is_plane(b) || reaches(b, boxes_[a]));
}

void ContactFinder::find_pairs(const Reach& reach) {
  const Model& model = reach.model;
  if (model.lists_pairs()) {
    pairs_.clear();
    for (const auto& [a, b] : model.listed_pairs())
      if (is_overlap(boxes_[a], boxes_[b]) && is_reached(a, b)) pairs_.emplace_back(a, b);
    return;
  }
  broad_phase_.find_pairs({boxes_, balls_, fixed_}, pairs_, reach.pairs);
  std::erase_if(pairs_, [&](const IndexPair& pair) {
    const auto& [a, b] = pair;
    return !is_reached(a, b) || !model.may_touch(a, b);
  });
}

// Largest distance of two geoms that can come into the margin within the step.
double ContactFinder::reach_of_pair(const Reach& reach, Index a, Index b) const {
  return reach.margin + reach.h * approach(motions_[a], motions_[b]);
}

// Calls f(contact, gap at the end of the step) for every point in reach of the velocities, of the pairs that
// counts() accepts.
template <class Counts, class F>
void ContactFinder::visit(const Reach& reach, Counts&& counts, F&& f) {
  const Model& model = reach.model;
  place_geoms(reach);
  find_pairs(reach);
  for (auto [a, b] : pairs_) {
    if (!counts(a, b)) continue;
    // A is the moving one, so that normals point to a body that responds.
    if (fixed_[a] && !fixed_[b]) std::swap(a, b);
    points_.clear();
    collide(model.geom(a).shape, frames_[a], model.geom(b).shape, frames_[b],
            reach_of_pair(reach, a, b) + (model.rest_offset(a) + model.rest_offset(b)), points_);
    // Materials and frames are looked up only for touching pairs; the broad phase finds many more.
    if (points_.empty()) continue;
    Contact c = contact_of(model, a, b, reach.bodies);
    const SurfaceMotion surface =
        surface_motion(model.geom(a), frames_[a], model.geom(b), frames_[b], reach.bodies);
    const Vec3 centre_a = centre_of(reach, c.body_a), centre_b = centre_of(reach, c.body_b);
    for (const ContactPoint& p : points_) {
      move_to(p, centre_a, centre_b, surface, c);
      f(c, c.gap + reach.h * opening(c, reach.v));
    }
  }
}

// A point counts if it is within the margin now, or at the end of the step with the free velocities. Both are
// needed: a body at rest has no velocity that shows the contact, a flying one no gap that does.
void ContactFinder::find(const Reach& reach, std::vector<Contact>& contacts) {
  contacts.clear();
  foreseen_ = reach.v;
  const auto all = [](Index, Index) { return true; };
  visit(reach, all, [&](const Contact& contact, double closing) {
    if (contact.gap <= reach.margin || closing <= reach.margin) contacts.push_back(contact);
  });
  // Support contacts of a body are only known now.
  level(reach, edges_.find(reach, frames_, contacts), contacts);
  redundant_.set_aside(reach, contacts);
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
    const SurfaceMotion surface = surface_motion(reach.model.geom(c.geom_a), frames_[c.geom_a],
                                                 reach.model.geom(c.geom_b), frames_[c.geom_b], reach.bodies);
    const Index x = p.a_passes ? c.geom_a : c.geom_b, y = p.a_passes ? c.geom_b : c.geom_a;
    next = p.end;
    if (is_static_only(reach.model.geom(y).shape)) continue;
    points_.clear();
    collide_along(p.normal, reach.model.geom(x).shape, frames_[x], reach.model.geom(y).shape, frames_[y],
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
  const double same = contacts::policy.same_point * reach.margin;
  const auto [first, last] = keys_of(by_pair_, pair_of(contact));
  return std::any_of(first, last, [&](const PairKey& key) {
    return norm(contacts[key.contact].point - contact.point) <= same;
  });
}

void ContactFinder::find_fixed(const Reach& reach, std::vector<Contact>& contacts) {
  sort_by_pair(contacts, by_pair_, [](std::size_t) { return true; });
  found_.clear();
  const auto one_moves = [&](Index a, Index b) { return fixed_[a] != fixed_[b]; };
  visit(reach, one_moves, [&](const Contact& contact, double closing) {
    if (closing < -contacts::policy.allowance * reach.margin && !is_known(reach, contact, contacts))
      found_.push_back(contact);
  });
  contacts.insert(contacts.end(), found_.begin(), found_.end());
}

void ContactFinder::find_missed(const Reach& reach, double allowance, std::vector<Contact>& contacts) {
  // No point deviates from its prediction by more than the change of the velocities since the first search,
  // including impacts. The points left out are those with a predicted gap above the margin at the end. If the
  // velocities of a pair change by less than (margin + allowance) / h, none of its points gets deeper than
  // the allowance. The search is then not needed; in most steps no pair needs it.
  const Model& model = reach.model;
  const auto& geoms = model.description().geoms;
  changes_.assign(geoms.size(), GeomMotion{});
  double most = 0;
  for (std::size_t g = 0; g < geoms.size(); ++g) {
    const Index body = geoms[g].body;
    if (!model.is_dynamic(body)) continue;
    const BodyVelocity difference{reach.v[body].linear - foreseen_[body].linear,
                                  reach.v[body].angular - foreseen_[body].angular};
    changes_[g] = motion_of(geoms[g], frames_[g], reach.bodies[body], difference);
    most = std::max(most, norm(changes_[g].centre) + changes_[g].spin);
  }
  if (2 * reach.h * most <= reach.margin + allowance) return;
  const auto changed = [&](Index a, Index b) {
    return reach.h * approach(changes_[a], changes_[b]) > reach.margin + allowance;
  };
  sort_by_pair(contacts, by_pair_, [](std::size_t) { return true; });
  found_.clear();
  visit(reach, changed, [&](const Contact& contact, double closing) {
    if (closing >= -allowance) return;
    if (edges_.passes(reach, frames_, contact)) return;
    if (!is_known(reach, contact, contacts)) found_.push_back(contact);
  });
  for (std::size_t first = 0, end = 0; first < found_.size(); first = end) {
    end = end_of_pair(found_, first);
    redundant_.add(reach, std::span(found_).subspan(first, end - first), contacts);
  }
}

namespace {

// Whether a shape rolls on an edge, along which its lowest point moves. Each of its edges has a point.
bool has_rim(const Shape& shape) { return std::holds_alternative<Cylinder>(shape); }

// The points in the middle of the step of contacts of a pair that travels by `way` and whose surface turns by
// `most`. A point on a rim keeps its place beside the centre while the rim moves through it; a corner moves
// with it. Each point is taken once.
void match_points(const Vec3& way, double most, std::span<const PairKey> keys,
                  const std::vector<Contact>& contacts, std::vector<ContactPoint>& points,
                  std::vector<std::optional<ContactPoint>>& found) {
  found.assign(keys.size(), std::nullopt);
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const Vec3 place = contacts[keys[k].contact].point + way;
    const auto away = [&](const ContactPoint& p) { return norm_squared(p.point - place); };
    const auto nearest = std::min_element(points.begin(), points.end(),
                                          [&](const auto& p, const auto& q) { return away(p) < away(q); });
    if (nearest == points.end() || away(*nearest) > most * most) continue;
    found[k] = *nearest;
    points.erase(nearest);
  }
}

}  // namespace

const ContactFinder::Middles& ContactFinder::find_middles(const Reach& reach,
                                                          const std::vector<Contact>& contacts) {
  middles_.clear();
  const Later half(reach, 0.5 * reach.h, later_);
  sort_by_pair(contacts, by_pair_, [](std::size_t) { return true; });
  for (std::size_t first = 0, end = 0; first < by_pair_.size(); first = end) {
    while (end < by_pair_.size() && by_pair_[end].pair == by_pair_[first].pair) ++end;
    const auto [geom_a, geom_b] = by_pair_[first].pair;
    const Geom &a = reach.model.geom(geom_a), &b = reach.model.geom(geom_b);
    const double turn = half.turn(a.body) + half.turn(b.body);
    const bool of_a = has_rim(a.shape), rolls = of_a || has_rim(b.shape);
    if ((end - first > 1 && !rolls) || turn < 0.5 * contacts::policy.least_turn) continue;
    Contact c = contacts[by_pair_[first].contact];
    points_.clear();
    const Transform frame_a = half.frame(a), frame_b = half.frame(b);
    collide(a.shape, frame_a, b.shape, frame_b, reach_of_pair(reach, geom_a, geom_b) + c.material.rest_offset,
            points_);
    if (rolls) {
      const Vec3 way =
          of_a ? frame_a.position - frames_[geom_a].position : frame_b.position - frames_[geom_b].position;
      match_points(way, turn * bounding_radius(of_a ? a.shape : b.shape),
                   std::span(by_pair_).subspan(first, end - first), contacts, points_, matched_);
    } else {
      if (points_.size() != 1) continue;
      matched_.assign(1, points_[0]);
    }
    const SurfaceMotion surface = surface_motion(a, frame_a, b, frame_b, reach.bodies);
    for (std::size_t k = first; k < end; ++k) {
      if (!matched_[k - first]) continue;
      c = contacts[by_pair_[k].contact];
      const Vec3 normal = c.normal;
      move_to(*matched_[k - first], half.centre(c.body_a), half.centre(c.body_b), surface, c);
      // A normal that turns with neither body belongs to an edge that came near. The neighbours decide
      // whether it is an internal edge.
      const auto stays = [&](const Transform& before, const Transform& then) {
        const Vec3 carried = rotate(then.rotation, rotate(conjugate(before.rotation), normal));
        return norm_squared(carried - c.normal) < same_normal * same_normal;
      };
      if ((!has_edges(a.shape) && !has_edges(b.shape)) || stays(frames_[geom_a], frame_a) ||
          stays(frames_[geom_b], frame_b))
        middles_.emplace_back(by_pair_[k].contact, c);
    }
  }
  return middles_;
}

// Contacts use the velocity of a point along a constant normal. If a body turns by the angle a, the error is
// of the order of a times the travel: a body that slides along a turning face ends inside it. So turning
// pairs are collided once more, in the poses at the end of the step. Overlaps no deeper than those of the
// pair's rows are known: the rows remove an overlap as fast as they may.
void ContactFinder::find_overlaps(const Reach& reach, double allowance, std::vector<Contact>& contacts) {
  const Later later(reach, reach.h, later_);
  sort_by_pair(contacts, by_pair_, [](std::size_t) { return true; });
  // One search per pair; the first of its contacts provides the data that all share.
  for (std::size_t first = 0, end = 0; first < by_pair_.size(); first = end) {
    while (end < by_pair_.size() && by_pair_[end].pair == by_pair_[first].pair) ++end;
    const auto [geom_a, geom_b] = by_pair_[first].pair;
    const Geom &a = reach.model.geom(geom_a), &b = reach.model.geom(geom_b);
    if (later.turn(a.body) + later.turn(b.body) < contacts::policy.least_turn) continue;
    Contact c = contacts[by_pair_[first].contact];
    c.impulse = c.angular_impulse = c.held = {};  // these were of the first contact
    const Transform frame_a = later.frame(a), frame_b = later.frame(b);
    const SurfaceMotion surface = surface_motion(a, frame_a, b, frame_b, reach.bodies);
    const double offset = c.material.rest_offset;
    points_.clear();
    collide(a.shape, frame_a, b.shape, frame_b, offset, points_);
    if (points_.empty()) continue;
    const double held = deepest(contacts, std::span(by_pair_).subspan(first, end - first), reach);
    found_.clear();
    for (const ContactPoint& p : points_) {
      if (p.gap - offset >= held - allowance) continue;
      move_to(p, later.centre(c.body_a), later.centre(c.body_b), surface, c);
      // The gap as it would be at the start with this point as a row: gap + h u of the rows closes it.
      c.gap -= reach.h * opening(c, reach.v);
      found_.push_back(c);
    }
    redundant_.add(reach, found_, contacts);
  }
}

}  // namespace amontons
