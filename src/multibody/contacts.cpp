// Contact points of a step, and the impulses that the last step found for them.
#include <algorithm>

#include "multibody/step.hpp"

namespace amontons {

namespace {

// A bound of the speed of the points of a geom.
double speed_of(const BodyFrame& body, const Transform& frame, double radius) {
  const double spin = norm(body.free_omega);
  return norm(body.free_velocity) + (spin > 0 ? spin * (norm(frame.position - body.centre) + radius) : 0);
}

Vec3 point_velocity(const std::vector<BodyFrame>& bodies, Index body, const Vec3& point) {
  if (body < 0) return {};
  const BodyFrame& b = bodies[body];
  return b.free_velocity + cross(b.free_omega, point - b.centre);
}

// The velocity of the geom's surface over its body, in the world.
Vec3 surface_velocity(const Geom& geom, const std::vector<BodyFrame>& bodies) {
  if (geom.surface_velocity == Vec3{}) return {};
  return geom.body < 0 ? geom.surface_velocity : rotate(bodies[geom.body].pose.rotation, geom.surface_velocity);
}

}  // namespace

void ContactFinder::find(const Model& model, const std::vector<BodyFrame>& bodies, double h, double margin,
                         std::vector<ContactSite>& sites) {
  const auto& geoms = model.description().geoms;
  frames.resize(geoms.size()), boxes.resize(geoms.size());
  fixed.resize(geoms.size()), speeds.resize(geoms.size());
  for (std::size_t g = 0; g < geoms.size(); ++g) {
    const Geom& geom = geoms[g];
    frames[g] = geom.body < 0 ? geom.frame : bodies[geom.body].pose * geom.frame;
    boxes[g] = bounds(geom.shape, frames[g]);
    fixed[g] = !model.is_dynamic(geom.body);
    speeds[g] = geom.body < 0 || model.body(geom.body).motion == Motion::fixed
                    ? 0
                    : speed_of(bodies[geom.body], frames[g], bounding_radius(geom.shape));
    const double grow = 0.5 * margin + h * speeds[g];
    boxes[g].lower -= {grow, grow, grow};
    boxes[g].upper += {grow, grow, grow};
  }
  broad_phase.find_pairs(boxes, fixed, pairs);
  sites.clear();
  for (auto [a, b] : pairs) {
    if (!model.may_touch(a, b)) continue;
    // A is the one that moves, so that normals point to a body that feels them.
    if (fixed[a] && !fixed[b]) std::swap(a, b);
    points.clear();
    collide(geoms[a].shape, frames[a], geoms[b].shape, frames[b], margin + h * (speeds[a] + speeds[b]), points);
    if (points.empty()) continue;
    const Material material = model.material(a, b);
    const Vec3 surface = surface_velocity(geoms[a], bodies) - surface_velocity(geoms[b], bodies);
    const Index body_a = geoms[a].body, body_b = geoms[b].body;
    for (const ContactPoint& p : points) {
      const Vec3 u = point_velocity(bodies, body_a, p.point) - point_velocity(bodies, body_b, p.point);
      if (p.gap > margin && p.gap + h * dot(p.normal, u) > margin) continue;
      ContactSite site{body_a, body_b, a, b, p.point, p.normal, {}, {}, p.gap, material, {}};
      site.r_a = p.point - bodies[body_a].centre;
      if (body_b >= 0) site.r_b = p.point - bodies[body_b].centre;
      site.surface = surface - dot(p.normal, surface) * p.normal;
      sites.push_back(site);
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
    // A point is the same one if it moved by less than a quarter of the smaller shape; a single point of a pair
    // (a rolling ball) is the same one wherever it went.
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
