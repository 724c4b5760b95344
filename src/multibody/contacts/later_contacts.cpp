// Where known contacts touch later in the step.
#include <algorithm>
#include <limits>
#include <optional>
#include <span>

#include "amontons/base/elementary.hpp"
#include "amontons/base/policy.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/contacts/touch.hpp"

namespace amontons {

namespace {

// Whether normals jump on the surface of a geom.
bool has_edges(const Model::Outline& outline) { return !outline.round && !outline.plane; }
// Change of a normal that moves with a body, as a length; smaller changes are rounding.
constexpr double same_normal = 1e-6;  // not tuned: rounding

// Turn of a pair in a step (rad) below which it is neglected. A point at the distance r from the axis departs
// from its tangent by r a^2 / 2, half a millionth of r.
double least_turn() { return base::policy.three_digits; }

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

// Calls f(keys) for the pairs that begin at [first, last) of keys sorted by pair.
template <class F>
void for_each_pair(std::span<const PairKey> keys, std::size_t first, std::size_t last, F&& f) {
  while (first > 0 && first < last && keys[first].pair == keys[first - 1].pair) ++first;
  for (std::size_t end = first; first < last; first = end) {
    while (end < keys.size() && keys[end].pair == keys[first].pair) ++end;
    f(keys.subspan(first, end - first));
  }
}

// A contact where it touches in the middle of the step.
struct Middle {
  Index body_a, body_b;
  Vec3 normal, r_a, r_b, surface_velocity;
};

// The contact point of a rolling body does not stay the same material point. If a pair touches in one point,
// the condition is that of the point in the middle of the step, D_m v+ >= -gap / h. The rows keep D, as A is
// symmetric, and (D_m - D) v of velocities v near v+ is added to b. On a rim each point is followed. For
// other pairs with several points it is unknown which of them stay.
//
// If a normal turns far in half a step, the body only passes by.
//
// The formula below is Rodrigues', with sine and cosine from the two unit normals: the axis is a over its
// length |a| = sin, and (1 - cos) / sin^2 = 1 / (1 + cos). No angle is needed, and none of its small digits
// is lost.
inline Vec3 turn_of(const Contact& c, const Middle& middle, const BodyVelocities& v, double least) {
  // Tangents are transported by the rotation that takes one normal to the other: with a = m x n it is 1 +
  // [a]x + [a]x^2 / (1 + <m, n>).
  static const double most = elementary::sin(resolved_turn);
  const Vec3 axis = cross(middle.normal, c.normal);
  const double cosine = dot(middle.normal, c.normal);
  if (norm_squared(axis) > most * most || cosine < 0) return {};
  Vec3 u = relative_motion(middle, v).linear;
  const Vec3 across = cross(axis, u);
  u += across + (1 / (1 + cosine)) * cross(axis, across);
  double turn[3];
  ContactBasis(c).to_contact(u - relative_motion(c, v).linear, turn);
  const Vec3 found{turn[0], turn[1], turn[2]};
  return norm(found) >= least ? found : Vec3{};
}

}  // namespace

// Poses of bodies after a time t with the velocities of a reach. A body of a pile belongs to many pairs: its
// pose is found once. That of a ball about its centre of mass is known by its place.
struct ContactFinder::Later {
  const Reach& reach;
  double t;
  std::vector<std::optional<Transform>>& poses;
  // Where threads share the pairs, all poses are found first.
  Later(const Reach& r, double time, std::size_t pairs, std::vector<std::optional<Transform>>& memory)
      : reach(r), t(time), poses(memory) {
    poses.assign(reach.bodies.size(), std::nullopt);
    if (pairs <= part_size || reach.threads == 1) return;
    for_entries(reach.threads, poses.size(),
                [&](std::size_t i) { poses[i] = moved(reach.bodies[i], reach.v[i], t); });
  }

  double turn(Index body) const { return body < 0 ? 0.0 : t * norm(reach.v[body].angular); }
  Vec3 centre(Index body) const {
    return body < 0 ? Vec3{} : reach.bodies[body].centre + t * reach.v[body].linear;
  }
  // A ball, which no turn of its body moves, or a convex shape of the world: turns do not bend the way of one
  // past the other.
  bool moves_straight(Index g) const {
    const Model::Outline& outline = reach.model.outline(g);
    if (outline.radius > 0 || outline.body >= 0) return outline.radius > 0;
    return outline.plane || !is_static_only(reach.model.geom(g).shape);
  }
  Transform frame(Index g) const {
    const Model::Outline& outline = reach.model.outline(g);
    if (outline.radius > 0) return {centre(outline.body), reach.bodies[outline.body].pose.rotation};
    const Geom& geom = reach.model.geom(g);
    if (geom.body < 0) return geom.frame;
    const BodyFrame& body = reach.bodies[geom.body];
    std::optional<Transform>& pose = poses[static_cast<std::size_t>(geom.body)];
    if (!pose) pose = moved(body, reach.v[geom.body], t);
    return *pose * geom.frame;
  }
};

// Two balls touch in one point and have no edges. Neither their shapes, which lie far apart in memory, nor
// the turn of the normal are needed.
Vec3 ContactFinder::turn_of_balls(const Later& half, double least, const Contact& c) const {
  const Reach& reach = half.reach;
  const Model::Outline &a = reach.model.outline(c.geom_a), &b = reach.model.outline(c.geom_b);
  if (half.turn(a.body) + half.turn(b.body) < 0.5 * least_turn()) return {};
  const Vec3 centre_a = half.centre(a.body), centre_b = half.centre(b.body);
  const ContactPoint p =
      touch_spheres(centre_a, a.radius, centre_b, b.radius, reach.bodies[b.body].pose.rotation);
  if (p.gap > reach_of_pair(reach, c.geom_a, c.geom_b) + c.material.rest_offset) return {};
  SurfaceMotion surface;
  if (a.conveys || b.conveys)
    surface = surface_motion(reach.model, c.geom_a, half.frame(c.geom_a), c.geom_b, half.frame(c.geom_b),
                             reach.bodies);
  Middle middle{a.body, b.body, {}, {}, {}, {}};
  touch_at(p, centre_a, centre_b, surface, middle);
  return turn_of(c, middle, reach.v, least);
}

void ContactFinder::turn_pair(const Later& half, double least, std::span<const PairKey> keys,
                              const std::vector<Contact>& contacts, Part& part,
                              std::vector<Vec3>& turns) const {
  const Reach& reach = half.reach;
  const auto [geom_a, geom_b] = keys[0].pair;
  const Model::Outline &a = reach.model.outline(geom_a), &b = reach.model.outline(geom_b);
  const Shape &shape_a = reach.model.geom(geom_a).shape, &shape_b = reach.model.geom(geom_b).shape;
  const double turn = half.turn(a.body) + half.turn(b.body);
  const bool of_a = has_edges(a) && has_rim(shape_a), rolls = of_a || (has_edges(b) && has_rim(shape_b));
  if ((keys.size() > 1 && !rolls) || turn < 0.5 * least_turn()) return;
  const Contact& c = contacts[keys[0].contact];
  part.points.clear();
  const Transform frame_a = half.frame(geom_a), frame_b = half.frame(geom_b);
  collide_geoms(reach.model, {geom_a, frame_a}, {geom_b, frame_b},
                reach_of_pair(reach, geom_a, geom_b) + c.material.rest_offset, part.points);
  if (rolls) {
    const Vec3 way =
        of_a ? frame_a.position - frames_[geom_a].position : frame_b.position - frames_[geom_b].position;
    match_points(way, turn * bounding_radius(of_a ? shape_a : shape_b), keys, contacts, part.points,
                 part.matched);
  } else if (part.points.size() != 1) {
    return;
  }
  const SurfaceMotion surface = surface_motion(reach.model, geom_a, frame_a, geom_b, frame_b, reach.bodies);
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (rolls && !part.matched[k]) continue;
    const Contact& contact = contacts[keys[k].contact];
    Middle middle{c.body_a, c.body_b, {}, {}, {}, {}};
    touch_at(rolls ? *part.matched[k] : part.points[0], half.centre(c.body_a), half.centre(c.body_b), surface,
             middle);
    // A normal that turns with neither body belongs to an edge that came near. The neighbours decide whether
    // it is an internal edge.
    const auto stays = [&](const Transform& before, const Transform& then) {
      const Vec3 carried = rotate(then.rotation, rotate(conjugate(before.rotation), contact.normal));
      return norm_squared(carried - middle.normal) < same_normal * same_normal;
    };
    if ((has_edges(a) || has_edges(b)) && !stays(frames_[geom_a], frame_a) &&
        !stays(frames_[geom_b], frame_b))
      continue;
    turns[keys[k].contact] = turn_of(contact, middle, reach.v, least);
  }
}

// Parts begin and end with a pair, wherever the threads divide the sorted list (for_each_pair).
void ContactFinder::find_turns(const Reach& reach, const std::vector<Contact>& contacts, double least,
                               std::vector<Vec3>& turns) {
  sort_all(contacts);
  turns.assign(contacts.size(), {});
  const Later half(reach, 0.5 * reach.h, by_pair_.size(), later_);
  in_parts(reach, by_pair_.size(), [&](Part& part, std::size_t first, std::size_t last) {
    for_each_pair(by_pair_, first, last, [&](std::span<const PairKey> keys) {
      const auto [a, b] = keys[0].pair;
      if (reach.model.outline(a).radius > 0 && reach.model.outline(b).radius > 0)
        turns[keys[0].contact] = turn_of_balls(half, least, contacts[keys[0].contact]);
      else
        turn_pair(half, least, keys, contacts, part, turns);
    });
  });
}

// Whether a pair has a point deeper than the allowance in the later poses; its points there.
//
// Each threshold of find_overlaps() is at most minus the allowance, because overlaps of rows are not
// positive. So this test needs no row, and leaves few pairs to the careful one. The distance from a convex
// set is a convex function of the place. A ball on a line therefore stays at least as far as its row says.
bool ContactFinder::overlap(const Later& later, double allowance, std::span<const PairKey> keys,
                            const std::vector<Contact>& contacts, std::vector<ContactPoint>& points) const {
  const auto [geom_a, geom_b] = keys[0].pair;
  if (later.moves_straight(geom_a) && later.moves_straight(geom_b)) return false;
  const Geom &a = later.reach.model.geom(geom_a), &b = later.reach.model.geom(geom_b);
  if (later.turn(a.body) + later.turn(b.body) < least_turn()) return false;
  const double offset = contacts[keys[0].contact].material.rest_offset;
  points.clear();
  collide(a.shape, later.frame(geom_a), b.shape, later.frame(geom_b), offset, points);
  return std::any_of(points.begin(), points.end(),
                     [&](const ContactPoint& p) { return p.gap - offset < -allowance; });
}

// Contacts use the velocity of a point along a constant normal. If a body turns by the angle a, the error is
// of the order of a times the travel: a body that slides along a turning face ends inside it. So turning
// pairs are collided once more, in the poses at the end of the step. Overlaps no deeper than those of the
// pair's rows are known: the rows remove an overlap as fast as they may.
void ContactFinder::find_overlaps(const Reach& reach, double allowance, std::vector<Contact>& contacts) {
  sort_all(contacts);
  const std::span<const PairKey> sorted(by_pair_);
  const Later later(reach, reach.h, sorted.size(), later_);
  const auto parts = in_parts(reach, sorted.size(), [&](Part& part, std::size_t first, std::size_t last) {
    part.deep.clear();
    for_each_pair(sorted, first, last, [&](std::span<const PairKey> keys) {
      if (overlap(later, allowance, keys, contacts, part.points))
        part.deep.push_back(static_cast<std::size_t>(keys.data() - sorted.data()));
    });
  });
  // Few pairs are left. The first of the contacts of a pair has what all share.
  for (const Part& part : parts)
    for (const std::size_t first : part.deep)
      for_each_pair(sorted, first, first + 1, [&](std::span<const PairKey> keys) {
        overlap(later, allowance, keys, contacts, points_);
        const double held = deepest(contacts, keys, reach);
        const auto [a, b] = keys[0].pair;
        const SurfaceMotion surface =
            surface_motion(reach.model, a, later.frame(a), b, later.frame(b), reach.bodies);
        Contact c = contacts[keys[0].contact];
        c.impulse = c.angular_impulse = c.held = {};  // these were of the first contact
        found_.clear();
        for (const ContactPoint& p : points_) {
          if (p.gap - c.material.rest_offset >= held - allowance) continue;
          move_to(p, later.centre(c.body_a), later.centre(c.body_b), surface, c);
          // The gap as it would be at the start with this point as a row: gap + h u of the rows closes it.
          c.gap -= reach.h * opening(c, reach.v);
          found_.push_back(c);
        }
        redundant_.add(reach, found_, contacts);
      });
}

}  // namespace amontons
