#include "multibody/contacts/contact_finder.hpp"

#include <algorithm>

#include "multibody/contacts/contact_law.hpp"

namespace amontons {

namespace {

// Turns of less in a step (rad) change no gap that matters.
constexpr double least_turn = 1e-3;

// A bound of the speed of the points of a geom that moves with its body.
double speed_bound(const BodyVelocity& v, const Vec3& arm, double radius) {
  const double spin = norm(v.angular);
  return norm(v.linear) + (spin > 0 ? spin * (norm(arm) + radius) : 0);
}

Vec3 point_velocity(const Reach& reach, Index body, const Vec3& point) {
  if (body < 0) return {};
  return reach.v[body].linear + cross(reach.v[body].angular, point - reach.bodies[body].centre);
}

// Directions of a geom, given in the frame of its body.
Vec3 in_world(const Vec3& v, const Geom& geom, const std::vector<BodyFrame>& bodies) {
  if (v == Vec3{}) return {};
  return geom.body < 0 ? v : rotate(bodies[geom.body].pose.rotation, v);
}

// Where the velocities v take a body over h.
Transform moved(const BodyFrame& body, const BodyVelocity& v, double h) {
  const Quat turn = exponential(h * v.angular);
  const Vec3 centre = body.centre + h * v.linear;
  return {centre + rotate(turn, body.pose.position - body.centre), turn * body.pose.rotation};
}

std::pair<Index, Index> pair_of(const Contact& contact) { return {contact.geom_a, contact.geom_b}; }

// What all contacts of two geoms have in common.
Contact contact_of(const Model& model, Index a, Index b, const std::vector<BodyFrame>& bodies) {
  const Geom &geom_a = model.geom(a), &geom_b = model.geom(b);
  Contact c;
  c.body_a = geom_a.body;
  c.body_b = geom_b.body;
  c.geom_a = a;
  c.geom_b = b;
  c.material = model.material(a, b);
  c.rows = rows_of(c.material);
  c.surface_velocity =
      in_world(geom_a.surface_velocity, geom_a, bodies) - in_world(geom_b.surface_velocity, geom_b, bodies);
  if (c.material.friction_across >= 0) {
    // The direction belongs to the geom that brings the second coefficient; A's counts where both do, or
    // where the pair has a material of its own.
    const bool of_a = geom_a.material.friction_across >= 0, of_b = geom_b.material.friction_across >= 0;
    const bool first = of_a || (!of_b && !(geom_a.friction_direction == Vec3{}));
    c.direction = in_world((first ? geom_a : geom_b).friction_direction, first ? geom_a : geom_b, bodies);
  }
  return c;
}

}  // namespace

void ContactFinder::sort_by_pair(const std::vector<Contact>& contacts) {
  by_pair_.resize(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) by_pair_[i] = i;
  std::stable_sort(by_pair_.begin(), by_pair_.end(),
                   [&](auto i, auto j) { return pair_of(contacts[i]) < pair_of(contacts[j]); });
}

// Where the geoms stand, how fast they are, and the boxes that they may reach.
void ContactFinder::place_geoms(const Model& model, const Reach& reach) {
  const auto& geoms = model.description().geoms;
  frames_.resize(geoms.size()), boxes_.resize(geoms.size());
  fixed_.resize(geoms.size()), speeds_.resize(geoms.size());
  for (std::size_t g = 0; g < geoms.size(); ++g) {
    const Geom& geom = geoms[g];
    const Index body = geom.body;
    frames_[g] = body < 0 ? geom.frame : reach.bodies[body].pose * geom.frame;
    boxes_[g] = bounds(geom.shape, frames_[g]);
    fixed_[g] = !model.is_dynamic(body);
    const bool stands = body < 0 || model.body(body).motion == Motion::fixed;
    speeds_[g] = stands ? 0
                        : speed_bound(reach.v[body], frames_[g].position - reach.bodies[body].centre,
                                      bounding_radius(geom.shape));
    const double grow = 0.5 * reach.margin + reach.h * speeds_[g];
    boxes_[g].lower -= {grow, grow, grow};
    boxes_[g].upper += {grow, grow, grow};
  }
}

void ContactFinder::collide_pair(const Model& model, Index a, Index b, double distance) {
  points_.clear();
  collide(model.geom(a).shape, frames_[a], model.geom(b).shape, frames_[b], distance, points_);
}

// f(contact, gap at the end of the step) for every point in reach of the velocities.
template <class F>
void ContactFinder::visit(const Model& model, const Reach& reach, F&& f) {
  place_geoms(model, reach);
  broad_phase_.find_pairs(boxes_, fixed_, pairs_);
  for (auto [a, b] : pairs_) {
    if (!model.may_touch(a, b)) continue;
    // A is the one that moves, so that normals point to a body that feels them.
    if (fixed_[a] && !fixed_[b]) std::swap(a, b);
    collide_pair(model, a, b, reach.margin + reach.h * (speeds_[a] + speeds_[b]));
    if (points_.empty()) continue;
    const Contact common = contact_of(model, a, b, reach.bodies);
    for (const ContactPoint& p : points_) {
      Contact c = common;
      c.point = p.point;
      c.normal = p.normal;
      c.gap = p.gap;
      c.r_a = p.point - reach.bodies[c.body_a].centre;
      if (c.body_b >= 0) c.r_b = p.point - reach.bodies[c.body_b].centre;
      c.surface_velocity -= dot(p.normal, c.surface_velocity) * p.normal;
      const Vec3 u = point_velocity(reach, c.body_a, p.point) - point_velocity(reach, c.body_b, p.point);
      f(c, p.gap + reach.h * dot(p.normal, u));
    }
  }
}

void ContactFinder::find(const Model& model, const Reach& reach, std::vector<Contact>& contacts) {
  contacts.clear();
  visit(model, reach, [&](const Contact& contact, double closing) {
    if (contact.gap <= reach.margin || closing <= reach.margin) contacts.push_back(contact);
  });
  // What a body rests on is known only now.
  seams_.start(contacts);
  passed_.assign(contacts.size(), 0);
  for (std::size_t i = 0; i < contacts.size(); ++i)
    passed_[i] = seams_.passes(model, frames_, contacts, contacts[i], reach.h, reach.v, reach.margin);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (!passed_[i]) contacts[kept++] = contacts[i];
  contacts.resize(kept);
}

std::size_t ContactFinder::find_missed(const Model& model, const Reach& reach,
                                       const std::vector<BodyVelocity>& free, double allowance,
                                       std::vector<Contact>& contacts) {
  // No point moves otherwise than foreseen by more than the change of the velocities.
  const auto& geoms = model.description().geoms;
  double change = 0;
  for (std::size_t g = 0; g < geoms.size(); ++g) {
    const Index body = geoms[g].body;
    if (!model.is_dynamic(body)) continue;
    const BodyVelocity difference{reach.v[body].linear - free[body].linear,
                                  reach.v[body].angular - free[body].angular};
    change = std::max(change, speed_bound(difference, frames_[g].position - reach.bodies[body].centre,
                                          bounding_radius(geoms[g].shape)));
  }
  if (2 * reach.h * change <= reach.margin + allowance) return 0;
  const std::size_t known = contacts.size();
  sort_by_pair(contacts);
  seams_.start(contacts);
  const auto key = [&](std::size_t i) { return pair_of(contacts[i]); };
  visit(model, reach, [&](const Contact& contact, double closing) {
    if (closing >= -allowance) return;
    if (seams_.passes(model, frames_, contacts, contact, reach.h, reach.v, reach.margin)) return;
    const std::pair pair = pair_of(contact);
    const double same = 1e-6 * reach.margin * reach.margin;
    auto i = std::partition_point(by_pair_.begin(), by_pair_.end(), [&](auto k) { return key(k) < pair; });
    for (; i != by_pair_.end() && key(*i) == pair; ++i)
      if (norm_squared(contacts[*i].point - contact.point) <= same) return;
    contacts.push_back(contact);
  });
  return contacts.size() - known;
}

std::size_t ContactFinder::find_overlaps(const Model& model, const Reach& reach, double allowance,
                                         std::vector<Contact>& contacts) {
  ends_.resize(reach.bodies.size());
  for (std::size_t i = 0; i < ends_.size(); ++i) ends_[i] = moved(reach.bodies[i], reach.v[i], reach.h);
  const auto end_frame = [&](const Geom& geom) {
    return geom.body < 0 ? geom.frame : ends_[geom.body] * geom.frame;
  };
  const auto turn = [&](Index body) { return body < 0 ? 0.0 : reach.h * norm(reach.v[body].angular); };
  const auto end_centre = [&](Index body) {
    return reach.bodies[body].centre + reach.h * reach.v[body].linear;
  };
  sort_by_pair(contacts);
  const std::size_t known = contacts.size();
  for (std::size_t i = 0; i < known; ++i) {
    const Contact first = contacts[by_pair_[i]];
    if (i > 0 && pair_of(contacts[by_pair_[i - 1]]) == pair_of(first)) continue;
    if (turn(first.body_a) + turn(first.body_b) < least_turn) continue;
    const Geom &a = model.geom(first.geom_a), &b = model.geom(first.geom_b);
    points_.clear();
    collide(a.shape, end_frame(a), b.shape, end_frame(b), 0, points_);
    for (const ContactPoint& p : points_) {
      if (p.gap >= -allowance) continue;
      Contact c = first;
      c.impulse = c.angular_impulse = {};  // an impact was that of the first
      c.point = p.point;
      c.normal = p.normal;
      c.r_a = p.point - end_centre(c.body_a);
      if (c.body_b >= 0) c.r_b = p.point - end_centre(c.body_b);
      c.surface_velocity -= dot(p.normal, c.surface_velocity) * p.normal;
      c.gap = p.gap - reach.h * dot(p.normal, relative_motion(c, reach.v).linear);
      contacts.push_back(c);
    }
  }
  return contacts.size() - known;
}

}  // namespace amontons
