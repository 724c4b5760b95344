// Contact points of a step, and the impulses that the last step found for them.
#include <algorithm>

#include "amontons/collision/narrow/extent.hpp"
#include "multibody/step/step.hpp"

namespace amontons {

namespace {

// A bound of the speed of the points of a geom that moves with its body.
double speed_bound(const BodyVelocity& v, const Vec3& arm, double radius) {
  const double spin = norm(v.angular);
  return norm(v.linear) + (spin > 0 ? spin * (norm(arm) + radius) : 0);
}

Vec3 point_velocity(const std::vector<BodyFrame>& bodies, const std::vector<BodyVelocity>& v, Index body,
                    const Vec3& point) {
  if (body < 0) return {};
  return v[body].linear + cross(v[body].angular, point - bodies[body].centre);
}

// The velocity of the geom's surface over its body, in the world.
Vec3 surface_velocity(const Geom& geom, const std::vector<BodyFrame>& bodies) {
  if (geom.surface_velocity == Vec3{}) return {};
  return geom.body < 0 ? geom.surface_velocity
                       : rotate(bodies[geom.body].pose.rotation, geom.surface_velocity);
}

// Where the velocities v take a body over h.
Transform moved(const BodyFrame& body, const BodyVelocity& v, double h) {
  const Quat turn = exponential(h * v.angular);
  const Vec3 centre = body.centre + h * v.linear;
  return {centre + rotate(turn, body.pose.position - body.centre), turn * body.pose.rotation};
}

// Turns of less in a step (rad) change no gap that matters.
constexpr double least_turn = 1e-3;

// Faces whose heights differ by less are level.
double level_of(double margin) { return 0.01 * margin; }

bool is_solid(const Shape& shape) { return !is_static_only(shape) && !std::holds_alternative<Sphere>(shape); }

// Whether a contact that is still open would close within the step, between two solids of which B does not
// move: the only ones that a body may pass instead.
bool may_be_seam(const Model& model, const ContactSite& site, double h, const std::vector<BodyVelocity>& v,
                 double margin) {
  return site.gap >= -level_of(margin) && !model.is_dynamic(site.body_b) &&
         site.gap + h * dot(site.normal, relative_velocity(site, v)) < 0 &&
         is_solid(model.geom(site.geom_a).shape) && is_solid(model.geom(site.geom_b).shape);
}

std::pair<Index, Index> pair_of(const ContactSite& site) { return {site.geom_a, site.geom_b}; }

}  // namespace

void ContactFinder::sort_by_pair(const std::vector<ContactSite>& sites) {
  by_pair.resize(sites.size());
  for (std::size_t i = 0; i < sites.size(); ++i) by_pair[i] = i;
  std::stable_sort(by_pair.begin(), by_pair.end(),
                   [&](auto i, auto j) { return pair_of(sites[i]) < pair_of(sites[j]); });
}

void ContactFinder::find(const Model& model, const std::vector<BodyFrame>& bodies,
                         const std::vector<BodyVelocity>& v, double h, double margin,
                         std::vector<ContactSite>& sites) {
  sites.clear();
  visit(model, bodies, v, h, margin, [&](const ContactSite& site, double closing) {
    if (site.gap <= margin || closing <= margin) sites.push_back(site);
  });
  // What a body rests on is known only now.
  by_body.clear();
  passed.assign(sites.size(), 0);
  for (std::size_t i = 0; i < sites.size(); ++i)
    passed[i] = may_be_seam(model, sites[i], h, v, margin) && is_seam(model, sites[i], margin, sites);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sites.size(); ++i)
    if (!passed[i]) sites[kept++] = sites[i];
  sites.resize(kept);
  by_body.clear();
}

// A box that slides over the joint between two slabs must not strike the side of the second one: as long as
// it rests on the first it stays above both. Ahead of the joint, though, the nearest way to the second slab
// is sideways, and a contact that acts before it touches would stop the box there.
bool ContactFinder::is_seam(const Model& model, const ContactSite& site, double margin,
                            const std::vector<ContactSite>& sites) {
  const auto less = [&](std::size_t i, std::size_t j) { return sites[i].body_a < sites[j].body_a; };
  if (by_body.empty()) {  // sorted for the first candidate only: most steps have none
    by_body.resize(sites.size());
    for (std::size_t i = 0; i < sites.size(); ++i) by_body[i] = i;
    std::stable_sort(by_body.begin(), by_body.end(), less);
  }
  const Shape &a = model.geom(site.geom_a).shape, &b = model.geom(site.geom_b).shape;
  const double level = level_of(margin);
  auto k = std::partition_point(by_body.begin(), by_body.end(),
                                [&](std::size_t i) { return sites[i].body_a < site.body_a; });
  for (; k != by_body.end() && sites[*k].body_a == site.body_a; ++k) {
    const ContactSite& rest = sites[*k];
    if (rest.body_b != site.body_b || rest.geom_b == site.geom_b) continue;
    if (std::abs(rest.gap) > level || dot(rest.normal, site.normal) > 0.5) continue;
    const Vec3& up = rest.normal;
    const double lowest = -extent_along(a, frames[site.geom_a], -up, site.point),
                 highest = extent_along(b, frames[site.geom_b], up, site.point);
    if (lowest - highest >= -level) return true;
  }
  return false;
}

std::size_t ContactFinder::find_missed(const Model& model, const std::vector<BodyFrame>& bodies,
                                       const std::vector<BodyVelocity>& free,
                                       const std::vector<BodyVelocity>& v, double h, double margin,
                                       double allowance, std::vector<ContactSite>& sites) {
  // No point moves otherwise than foreseen by more than the change of the velocities.
  const auto& geoms = model.description().geoms;
  double change = 0;
  for (std::size_t g = 0; g < geoms.size(); ++g) {
    const Index body = geoms[g].body;
    if (!model.is_dynamic(body)) continue;
    const BodyVelocity difference{v[body].linear - free[body].linear, v[body].angular - free[body].angular};
    change = std::max(change, speed_bound(difference, frames[g].position - bodies[body].centre,
                                          bounding_radius(geoms[g].shape)));
  }
  if (2 * h * change <= margin + allowance) return 0;
  const std::size_t known = sites.size();
  sort_by_pair(sites);
  const auto key = [&](std::size_t i) { return pair_of(sites[i]); };
  visit(model, bodies, v, h, margin, [&](const ContactSite& site, double closing) {
    if (closing >= -allowance) return;
    if (may_be_seam(model, site, h, v, margin) && is_seam(model, site, margin, sites)) return;
    const std::pair pair(site.geom_a, site.geom_b);
    const double same = 1e-6 * margin * margin;
    auto i = std::partition_point(by_pair.begin(), by_pair.end(), [&](auto k) { return key(k) < pair; });
    for (; i != by_pair.end() && key(*i) == pair; ++i)
      if (norm_squared(sites[*i].point - site.point) <= same) return;
    sites.push_back(site);
  });
  return sites.size() - known;
}

std::size_t ContactFinder::find_overlaps(const Model& model, const std::vector<BodyFrame>& bodies,
                                         const std::vector<BodyVelocity>& v, double h, double allowance,
                                         std::vector<ContactSite>& sites) {
  ends.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) ends[i] = moved(bodies[i], v[i], h);
  const auto end_frame = [&](const Geom& geom) {
    return geom.body < 0 ? geom.frame : ends[geom.body] * geom.frame;
  };
  const auto turn = [&](Index body) { return body < 0 ? 0.0 : h * norm(v[body].angular); };
  sort_by_pair(sites);
  const std::size_t known = sites.size();
  for (std::size_t i = 0; i < known; ++i) {
    const ContactSite first = sites[by_pair[i]];
    if (i > 0 && pair_of(sites[by_pair[i - 1]]) == pair_of(first)) continue;
    if (turn(first.body_a) + turn(first.body_b) < least_turn) continue;
    const Geom &a = model.geom(first.geom_a), &b = model.geom(first.geom_b);
    points.clear();
    collide(a.shape, end_frame(a), b.shape, end_frame(b), 0, points);
    for (const ContactPoint& p : points) {
      if (p.gap >= -allowance) continue;
      ContactSite site = first;
      site.point = p.point, site.normal = p.normal;
      site.r_a = p.point - (bodies[first.body_a].centre + h * v[first.body_a].linear);
      if (first.body_b >= 0) site.r_b = p.point - (bodies[first.body_b].centre + h * v[first.body_b].linear);
      site.surface -= dot(p.normal, site.surface) * p.normal;
      site.gap = p.gap - h * dot(p.normal, relative_velocity(site, v));
      sites.push_back(site);
    }
  }
  return sites.size() - known;
}

template <class F>
void ContactFinder::visit(const Model& model, const std::vector<BodyFrame>& bodies,
                          const std::vector<BodyVelocity>& v, double h, double margin, F&& f) {
  const auto& geoms = model.description().geoms;
  frames.resize(geoms.size()), boxes.resize(geoms.size());
  fixed.resize(geoms.size()), speeds.resize(geoms.size());
  for (std::size_t g = 0; g < geoms.size(); ++g) {
    const Geom& geom = geoms[g];
    frames[g] = geom.body < 0 ? geom.frame : bodies[geom.body].pose * geom.frame;
    boxes[g] = bounds(geom.shape, frames[g]);
    fixed[g] = !model.is_dynamic(geom.body);
    speeds[g] = geom.body < 0 ? 0
                              : speed_bound(v[geom.body], frames[g].position - bodies[geom.body].centre,
                                            bounding_radius(geom.shape));
    const double grow = 0.5 * margin + h * speeds[g];
    boxes[g].lower -= {grow, grow, grow};
    boxes[g].upper += {grow, grow, grow};
  }
  broad_phase.find_pairs(boxes, fixed, pairs);
  for (auto [a, b] : pairs) {
    if (!model.may_touch(a, b)) continue;
    // A is the one that moves, so that normals point to a body that feels them.
    if (fixed[a] && !fixed[b]) std::swap(a, b);
    points.clear();
    collide(geoms[a].shape, frames[a], geoms[b].shape, frames[b], margin + h * (speeds[a] + speeds[b]),
            points);
    if (points.empty()) continue;
    const Material material = model.material(a, b);
    const Vec3 surface = surface_velocity(geoms[a], bodies) - surface_velocity(geoms[b], bodies);
    const Index body_a = geoms[a].body, body_b = geoms[b].body;
    for (const ContactPoint& p : points) {
      const Vec3 u = point_velocity(bodies, v, body_a, p.point) - point_velocity(bodies, v, body_b, p.point);
      ContactSite site{body_a, body_b, a, b, p.point, p.normal, {}, {}, p.gap, material, {}};
      site.r_a = p.point - bodies[body_a].centre;
      if (body_b >= 0) site.r_b = p.point - bodies[body_b].centre;
      site.surface = surface - dot(p.normal, surface) * p.normal;
      f(site, p.gap + h * dot(p.normal, u));
    }
  }
}

Vec3 relative_velocity(const ContactSite& site, const std::vector<BodyVelocity>& v) {
  Vec3 u = v[site.body_a].linear + cross(v[site.body_a].angular, site.r_a) + site.surface;
  if (site.body_b >= 0) u -= v[site.body_b].linear + cross(v[site.body_b].angular, site.r_b);
  return u;
}

void warm_start_contacts(const Model& model, const std::vector<CachedContact>& cache, double scale,
                         const std::vector<BodyFrame>& bodies, const std::vector<ContactSite>& sites,
                         std::vector<double>& x0) {
  const auto key = [](const auto& c) { return std::pair(c.geom_a, c.geom_b); };
  std::vector<unsigned char> used(cache.size(), 0);
  for (std::size_t i = 0; i < sites.size();) {
    std::size_t end = i;
    while (end < sites.size() && key(sites[end]) == key(sites[i])) ++end;
    const auto first = std::partition_point(cache.begin(), cache.end(),
                                            [&](const CachedContact& c) { return key(c) < key(sites[i]); });
    const auto last = std::partition_point(first, cache.end(),
                                           [&](const CachedContact& c) { return key(c) == key(sites[i]); });
    // A point is the same one if it moved by less than a quarter of the smaller shape; a single point of a
    // pair (a rolling ball) is the same one wherever it went.
    const double reach = 0.25 * std::min(bounding_radius(model.geom(sites[i].geom_a).shape),
                                         bounding_radius(model.geom(sites[i].geom_b).shape));
    const bool single = end - i == 1 && last - first == 1;
    const Transform to_local = inverse(bodies[sites[i].body_a].pose);
    for (; i < end; ++i) {
      const Vec3 local = to_local(sites[i].point);
      double best = single ? infinity : reach * reach;
      auto nearest = last;
      for (auto c = first; c != last; ++c) {
        const double distance = norm_squared(c->local - local);
        if (!used[c - cache.begin()] && (distance < best || (single && nearest == last)))
          best = distance, nearest = c;
      }
      if (nearest == last) continue;
      used[nearest - cache.begin()] = 1;
      std::array<double, 3> t1, t2;
      contact_tangents(sites[i].normal.array(), t1, t2);
      x0[3 * i] = std::max(0.0, scale * dot(sites[i].normal, nearest->impulse));
      x0[3 * i + 1] = scale * dot(to_vec3(t1), nearest->impulse);
      x0[3 * i + 2] = scale * dot(to_vec3(t2), nearest->impulse);
    }
  }
}

}  // namespace amontons
