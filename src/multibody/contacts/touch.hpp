// From a point of two geoms to their contact.
#pragma once
#include <vector>

#include "amontons/collision/pairs/collide.hpp"
#include "amontons/collision/pairs/spheres.hpp"
#include "multibody/contacts/reach.hpp"

namespace amontons {

// A geom, and the frame where it is.
struct PlacedGeom {
  Index geom;
  const Transform& frame;
};

// Appends the points of two geoms in these frames with a gap of at most the margin. Two balls, of which a
// pile has nearly all of its pairs, need neither their shapes nor the table of pairs.
inline void collide_geoms(const Model& model, const PlacedGeom& a, const PlacedGeom& b, double margin,
                          std::vector<ContactPoint>& points) {
  const double radius_a = model.outline(a.geom).radius, radius_b = model.outline(b.geom).radius;
  if (!(radius_a > 0 && radius_b > 0))
    return collide(model.geom(a.geom).shape, a.frame, model.geom(b.geom).shape, b.frame, margin, points);
  const ContactPoint p =
      touch_spheres(a.frame.position, radius_a, b.frame.position, radius_b, b.frame.rotation);
  if (p.gap <= margin) points.push_back(p);
}

// Directions of a geom, given in the frame of its body.
inline Vec3 in_world(const Vec3& v, const Geom& geom, const BodyFrames& bodies) {
  if (v == Vec3{}) return {};
  return geom.body < 0 ? v : rotate(bodies[geom.body].pose.rotation, v);
}

// The velocity of the surface of A over its body minus that of B: at the world's origin, and the spin. Few
// surfaces move.
struct SurfaceMotion {
  bool moves = false;
  Vec3 linear, spin;
};

SurfaceMotion motion_of_surfaces(const Model& model, Index a, const Transform& frame_a, Index b,
                                 const Transform& frame_b, const BodyFrames& bodies);

inline SurfaceMotion surface_motion(const Model& model, Index a, const Transform& frame_a, Index b,
                                    const Transform& frame_b, const BodyFrames& bodies) {
  if (!model.outline(a).conveys && !model.outline(b).conveys) return {};
  return motion_of_surfaces(model, a, frame_a, b, frame_b, bodies);
}

// Sets what the velocity at a contact needs to one of the points of its pair, for bodies with these centres
// of mass. Only the tangential part of surface velocities counts: a conveyor does not lift its load. A point
// without a velocity keeps the zero with which it was made.
template <class Point>
inline void touch_at(const ContactPoint& p, const Vec3& centre_a, const Vec3& centre_b,
                     const SurfaceMotion& surface, Point& c) {
  c.normal = p.normal;
  c.r_a = p.point - centre_a;
  if (c.body_b >= 0) c.r_b = p.point - centre_b;
  if (!surface.moves) return;
  const Vec3 surface_velocity = surface.linear + cross(surface.spin, p.point);
  c.surface_velocity = surface_velocity - dot(p.normal, surface_velocity) * p.normal;
}

// Sets the contact of a pair to one of its points.
inline void move_to(const ContactPoint& p, const Vec3& centre_a, const Vec3& centre_b,
                    const SurfaceMotion& surface, Contact& c) {
  c.point = p.point;
  c.gap = p.gap - c.material.rest_offset;
  touch_at(p, centre_a, centre_b, surface, c);
}

}  // namespace amontons
