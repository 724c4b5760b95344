// Private to mesh.cpp and height_field.cpp: contact of a convex body with a static surface of triangles, seen
// from the outside only. The two kinds of surface differ in how they find triangles and neighbours, so the
// algorithm is a template over that.
//
// Contact normals. A triangle alone would push a body that slides across it off its edges, although the
// surface goes on behind them. A normal is therefore only allowed if the surface, not the triangle, has it:
// the normal of the face, or one whose supporting point on the triangle supports the surface around it as
// well (the Voronoi region of an edge or corner: D. Eberly, "Game Physics", 2nd ed., section 8.4, for the
// regions; the rule for internal edges is that of C. Ericson, "Real-Time Collision Detection", section 5.1.6,
// turned into a test). Any other normal is replaced by that of the face.
//
// Contact points on a face: the supporting feature of the body along the face normal, clipped by the three
// planes that stand on the edges. Points made by clipping are kept only where the surface really has an edge:
// triangles of one flat face together give the corners of the body and the corners of the common area,
// nothing in between.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "collision/narrow/convex.hpp"

namespace amontons::collision {

// The dihedral angle (rad) below which two triangles are one flat face: more than single-precision corners of
// fine meshes scatter, less than what matters, as a body of length l sinks in by l / 40000 at most. The same
// angle is the tolerance of directions in general.
constexpr double flat_angle = 1e-4;

enum class EdgeKind : unsigned char { flat, convex, concave, border };

// A triangle with its neighbourhood. Edge k goes from corner k to corner k + 1.
struct Facet {
  Vec3 corner[3];
  Vec3 normal;
  EdgeKind edge[3];
  Vec3 opposite[3];        // the far corner of the triangle across edge k, unless it is a border
  std::int64_t vertex[3];  // names of the corners
};

// The kind of an edge from a to b of a triangle with unit normal n, whose neighbour has the normal m and a
// third corner c.
inline EdgeKind edge_kind(const Vec3& a, const Vec3& b, const Vec3& n, const Vec3& m, const Vec3& c) {
  const Vec3 across = cross(n, b - a), to = c - a;
  // Height of c above the plane over its distance from the edge: the sine of the dihedral angle.
  const Vec3 along = normalised(b - a);
  const double height = dot(n, to), distance = norm(to - dot(to, along) * along);
  if (dot(n, m) < 0 && std::abs(height) <= flat_angle * distance)  // folded back onto itself
    return dot(across, to) > 0 ? EdgeKind::convex : EdgeKind::flat;
  if (std::abs(height) <= flat_angle * distance) return EdgeKind::flat;
  return height < 0 ? EdgeKind::convex : EdgeKind::concave;
}

// The point of a triangle that is closest to p, and which of its three weights are not zero, as bits.
inline Vec3 closest_point(const Vec3* corner, const Vec3& p, unsigned& feature) {
  // C. Ericson, "Real-Time Collision Detection", section 5.1.5.
  const Vec3 ab = corner[1] - corner[0], ac = corner[2] - corner[0], ap = p - corner[0];
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return feature = 1, corner[0];
  const Vec3 bp = p - corner[1];
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return feature = 2, corner[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return feature = 3, corner[0] + (d1 / (d1 - d3)) * ab;
  const Vec3 cp = p - corner[2];
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return feature = 4, corner[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return feature = 5, corner[0] + (d2 / (d2 - d6)) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return feature = 6, corner[1] + ((d4 - d3) / (d4 - d3 + d5 - d6)) * (corner[2] - corner[1]);
  const double s = 1 / (va + vb + vc);
  return feature = 7, corner[0] + (vb * s) * ab + (vc * s) * ac;
}

// Removes points that lie together and, of many with about the same normal, all but the deepest and the
// outermost ones. The points from index `first` on.
void reduce_points(std::vector<ContactPoint>& points, std::size_t first, double length);

// A point of the body's feature while it is clipped by the planes that stand on the edges of a triangle.
struct ClipPoint {
  Vec3 at;
  bool keep;
  int edge;  // that the side to the next point lies on; -1: a side of the body's feature
};

// A Surface has, in coordinates of its own and with triangles named by integers:
//   template <class F> void for_each_near(const Aabb&, F) const   F(triangle) for all that may touch the box
//   Facet facet(triangle) const
//   template <class F> void for_each_neighbour(vertex, F) const   F(position) for all joined to it by an edge
//   bool is_active(vertex) const             whether an edge ends there that is not flat
//   bool is_outside(p, triangle, closest, feature) const   p, whose closest point on the surface is given
template <class Surface>
class SurfaceContact {
 public:
  // `local`: the box around the body along its own axes.
  SurfaceContact(const Surface& surface, const Convex& body, const Aabb& local, const Vec3& inside,
                 const Vec3& origin, double margin, std::vector<ContactPoint>& points)
      : surface_(surface),
        body_(body),
        local_(local),
        inside_(inside),
        origin_(origin),
        margin_(margin),
        points_(points) {}

  // `box`: that of the body and its margin, in the coordinates of the surface.
  void find(const Aabb& box) {
    const std::size_t first = points_.size();
    const bool any_behind = touch_all(box);
    // Where the body overlaps an edge or a corner, the shortest way out of one triangle may lead into the
    // next. Then directions are taken from the body moved out a little, where they are those of shortest
    // distances.
    for (int attempt = 0; attempt < 4 && blocked_ && norm_squared(outwards_) > 0; ++attempt) {
      points_.resize(first);
      lift_ = (2 * overlap_) * normalised(outwards_);
      touch_all(box);
    }
    if (any_behind) push_out(box, first);
    reduce_points(points_, first, body_.extent + body_.radius);
  }

 private:
  static constexpr double infinite = std::numeric_limits<double>::infinity();
  // Round caps count as polygons. The lowest point of their rim is added where it lies deeper than the
  // polygon by this part of the body's size; within a milliradian of flat it wanders without meaning.
  static constexpr double thinned_out = 3e-5;

  Facet shifted(auto triangle) const {
    Facet facet = surface_.facet(triangle);
    for (int k = 0; k < 3; ++k) facet.corner[k] -= origin_, facet.opposite[k] -= origin_;
    return facet;
  }

  // Returns whether some triangles are seen from behind.
  bool touch_all(const Aabb& box) {
    bool any_behind = false;
    blocked_ = false, overlap_ = norm(lift_), outwards_ = {};
    surface_.for_each_near(box, [&](auto triangle) {
      const Facet facet = shifted(triangle);
      if (dot(facet.normal, inside_ - facet.corner[0]) > 0)
        touch(facet);
      else
        any_behind = true;
    });
    return any_behind;
  }

  // Most triangles near a slanting body are out of its reach: a cheap test before the others.
  bool is_in_reach(const Facet& facet) const {
    const double reach = margin_ + norm(lift_);
    bool yes = true;
    for (int k = 0; k < 3; ++k) {
      const double a = dot(body_.axis[k], facet.corner[0]), b = dot(body_.axis[k], facet.corner[1]),
                   c = dot(body_.axis[k], facet.corner[2]);
      yes = yes && std::min({a, b, c}) <= local_.upper[k] + reach &&
            std::max({a, b, c}) >= local_.lower[k] - reach;
    }
    return yes;
  }

  void touch(const Facet& facet) {
    if (!is_in_reach(facet)) return;
    const Vec3 n = facet.normal, lowest = support(body_, -n) - body_.radius * n;
    if (dot(n, lowest - facet.corner[0]) > margin_) return;
    bool rounded = false;  // whether a normal other than the face's is possible
    for (EdgeKind kind : facet.edge)
      rounded = rounded || kind == EdgeKind::convex || kind == EdgeKind::border;
    if (!rounded) {
      touch_face(facet, lowest, false);
      return;
    }
    const Convex triangle =
        make_triangle(facet.corner[0] - lift_, facet.corner[1] - lift_, facet.corner[2] - lift_);
    const Separation s = separation(body_, triangle, margin_ + norm(lift_));
    if (!s.within) return;
    const bool allowed = is_allowed(facet, s.normal);
    if (s.distance <= -body_.radius) {  // the cores overlap
      blocked_ = blocked_ || !allowed, outwards_ += n;
      // Never less than what tells two bodies apart.
      overlap_ = std::max({overlap_, -s.distance - body_.radius, 1e-7 * (body_.extent + body_.radius)});
    }
    // Flat bodies prefer the face's normal to one that is almost the same: the manifold does not change then
    // when the body rocks.
    const bool is_round = body_.radius > 0 || body_.kind == Convex::Kind::ellipsoid;
    const double cosine = is_round ? 1 - 1e-14 : 1 - 2e-4;
    if (!allowed) {
      touch_face(facet, lowest, false);
      return;
    }
    const double least = dot(s.normal, n) > cosine ? touch_face(facet, lowest, true) : infinite;
    if (least == infinite)
      touch_edge(facet, triangle, s);
    else if (lift_ == Vec3{} && least > s.distance + thinned_out * body_.extent)
      points_.push_back({0.5 * (s.on_a + s.on_b), s.normal, s.distance});
  }

  // Contact along a normal that an edge or a corner of the surface has.
  void touch_edge(const Facet& facet, const Convex& triangle, const Separation& s) {
    if (lift_ == Vec3{}) {
      manifold(body_, triangle, s, margin_, points_);
      return;
    }
    const Convex in_place = make_triangle(facet.corner[0], facet.corner[1], facet.corner[2]);
    const double gap = clip_features(body_, in_place, s.normal, nullptr, margin_, points_);
    if (std::isfinite(gap)) return;
    const Vec3 d = s.normal, on_surface = s.on_b + lift_;
    const double depth = dot(d, support(body_, -d) - body_.radius * d - on_surface);
    if (depth <= margin_) points_.push_back({on_surface + (0.5 * depth) * d, d, depth});
  }

  // Whether the surface has the normal d where the triangle has: no corner around the supporting corner or
  // edge lies farther along d.
  bool is_allowed(const Facet& facet, const Vec3& d) const {
    double along[3], length = 0;
    for (int k = 0; k < 3; ++k) {
      along[k] = dot(d, facet.corner[k] - facet.corner[0]);
      length = std::max(length, norm(facet.corner[(k + 1) % 3] - facet.corner[k]));
    }
    const double top = std::max({along[0], along[1], along[2]});
    bool on_top[3];
    int count = 0, last = 0;
    for (int k = 0; k < 3; ++k)
      if ((on_top[k] = along[k] >= top - flat_angle * length)) ++count, last = k;
    if (count == 3) return dot(d, facet.normal) > 0;
    if (count == 2) {
      const int k = !on_top[2] ? 0 : !on_top[0] ? 1 : 2;
      if (facet.edge[k] == EdgeKind::border) return dot(d, facet.normal) >= 0;
      if (facet.edge[k] != EdgeKind::convex) return false;
      const Vec3 to = facet.opposite[k] - facet.corner[k];
      return dot(d, to) <= flat_angle * norm(to);
    }
    return surface_.is_active(facet.vertex[last]) && is_supporting(facet, last, d);
  }

  bool is_supporting(const Facet& facet, int k, const Vec3& d) const {
    bool yes = true;
    surface_.for_each_neighbour(facet.vertex[k], [&](const Vec3& position) {
      const Vec3 to = position - origin_ - facet.corner[k];
      yes = yes && dot(d, to) <= flat_angle * norm(to);
    });
    return yes;
  }

  // Contact along the normal of the face. Returns the least gap of the part of the body's feature that is
  // over the triangle. `sure`: that this is the way out is known.
  double touch_face(const Facet& facet, const Vec3& lowest, bool sure) {
    const Vec3 n = facet.normal;
    const Feature& feature = feature_along(n, lowest);
    int count = feature.count;
    double raised = infinite;
    for (int i = 0; i < count; ++i) {
      clip_[i] = {feature.points[i], true, -1};
      raised = std::min(raised, dot(n, feature.points[i] - lowest));
    }
    for (int k = 0; k < 3 && count > 0; ++k) count = clip(facet, k, count);
    // The polygon of a round cap may have lost the lowest point of its rim.
    if (raised > thinned_out * body_.extent && is_over(facet, lowest)) clip_[count++] = {lowest, true, -1};
    if (count == 0) return infinite;
    Vec3 middle;
    for (int i = 0; i < count; ++i) middle += clip_[i].at / count;
    if (!sure && is_behind_another(facet, middle)) return infinite;
    double least = infinite;
    for (int i = 0; i < count; ++i) {
      const double gap = dot(n, clip_[i].at - facet.corner[0]);
      least = std::min(least, gap);
      if (clip_[i].keep) add(n, clip_[i].at, gap);
    }
    return least;
  }

  // What the body turns to a face. Kept for the next face: on flat ground all have the same normal.
  const Feature& feature_along(const Vec3& n, const Vec3& lowest) {
    if (!(n == feature_normal_)) supporting_feature(body_, -n, &lowest, nullptr, feature_);
    feature_normal_ = n;
    return feature_;
  }

  void add(const Vec3& n, const Vec3& at, double gap) {
    if (gap <= margin_) points_.push_back({at - (0.5 * gap) * n, n, gap});
  }

  // How far a point lies inside the plane on edge k. Points as near as the tolerance belong to both
  // triangles.
  static Vec3 inward_of(const Facet& facet, int k) {
    return normalised(cross(facet.normal, facet.corner[(k + 1) % 3] - facet.corner[k]));
  }
  double tolerance() const { return 1e-9 * (body_.extent + body_.radius); }

  bool is_over(const Facet& facet, const Vec3& p) const {
    bool yes = true;
    for (int k = 0; k < 3; ++k) yes = yes && dot(inward_of(facet, k), p - facet.corner[k]) >= -tolerance();
    return yes;
  }

  // Sutherland and Hodgman's clipping of the points in clip_ by the plane on edge k.
  int clip(const Facet& facet, int k, int count) {
    const Vec3 from = facet.corner[k], inward = inward_of(facet, k);
    const double close = tolerance();
    const auto side = [&](const ClipPoint& p) { return dot(inward, p.at - from); };
    const auto crossing = [&](const ClipPoint& p, const ClipPoint& q, double side_p, double side_q,
                              int edge) {
      bool keep = facet.edge[k] != EdgeKind::flat;
      if (p.edge >= 0) {  // along an edge of the triangle: this is a corner of it
        const int corner = p.edge == (k + 2) % 3 ? k : (k + 1) % 3;
        keep = surface_.is_active(facet.vertex[corner]) && is_supporting(facet, corner, facet.normal);
      }
      return ClipPoint{p.at + (side_p / (side_p - side_q)) * (q.at - p.at), keep, edge};
    };
    int out = 0;
    for (int i = 0; i < count; ++i) {
      const ClipPoint &p = clip_[i], &q = clip_[i + 1 < count ? i + 1 : 0];
      const double side_p = side(p), side_q = side(q);
      const bool in_p = side_p >= -close, in_q = side_q >= -close;
      if (in_p) clipped_[out++] = p;
      if (in_p && !in_q && side_p > close) clipped_[out++] = crossing(p, q, side_p, side_q, k);
      if (in_p && !in_q && side_p <= close) clipped_[out - 1].edge = k;
      if (!in_p && in_q && side_q > close) clipped_[out++] = crossing(p, q, side_p, side_q, p.edge);
    }
    std::copy_n(clipped_, out, clip_);
    return out;
  }

  // A point of the body may lie deep behind the plane of one face and just below another one (a box on a step
  // lies deep behind the riser): contact is with the face that it went through, the closer one.
  bool is_behind_another(const Facet& facet, const Vec3& point) const {
    const double depth = -dot(facet.normal, point - facet.corner[0]), limit = 0.9 * depth;
    if (depth <= tolerance()) return false;
    const Vec3 centre = point + origin_, reach{limit, limit, limit};
    bool found = false;
    surface_.for_each_near({centre - reach, centre + reach}, [&](auto triangle) {
      if (found) return;
      const Facet other = shifted(triangle);
      if (std::abs(dot(other.normal, point - other.corner[0])) >= limit) return;
      if (dot(other.normal, inside_ - other.corner[0]) <= 0) return;
      unsigned feature;
      found = norm(point - closest_point(other.corner, point, feature)) < limit;
    });
    return found;
  }

  // A body whose centre has got behind the surface: out along the normal of the closest face.
  void push_out(const Aabb& box, std::size_t first) {
    double best = infinite;
    Facet face{};
    Vec3 closest;
    unsigned feature = 0;
    bool outside = true;
    const auto look = [&](const Aabb& where) {
      surface_.for_each_near(where, [&](auto triangle) {
        const Facet facet = shifted(triangle);
        unsigned f;
        const Vec3 p = closest_point(facet.corner, inside_, f);
        if (norm(p - inside_) >= best) return;
        best = norm(p - inside_), face = facet, closest = p, feature = f;
        outside = surface_.is_outside(inside_ + origin_, triangle, closest + origin_, feature);
      });
    };
    look(box);
    const Vec3 centre = inside_ + origin_, reach{best, best, best};
    look({centre - reach, centre + reach});  // the closest may lie beside the body
    if (outside) return;
    points_.resize(first);
    const Vec3 n = face.normal, lowest = support(body_, -n) - body_.radius * n;
    const Feature& side = feature_along(n, lowest);
    for (int i = 0; i < side.count; ++i) add(n, side.points[i], dot(n, side.points[i] - face.corner[0]));
  }

  const Surface& surface_;
  const Convex& body_;
  const Aabb local_;
  const Vec3 inside_;  // a point inside the body
  const Vec3 origin_;  // of the coordinates of the body in those of the surface
  const double margin_;
  std::vector<ContactPoint>& points_;
  bool blocked_ = false;  // whether an overlap has no allowed way out
  double overlap_ = 0;    // the deepest
  Vec3 outwards_;         // sum of the normals of triangles that overlap
  Vec3 lift_;             // how far the body is moved to find directions
  Feature feature_;
  Vec3 feature_normal_;  // that feature_ belongs to
  ClipPoint clip_[Feature::capacity + 8], clipped_[Feature::capacity + 8];
};

// The points are in world coordinates, the normals point from the surface to the body.
template <class Surface>
void collide_surface(const Surface& surface, const Transform& frame_surface, const Shape& shape,
                     const Transform& frame, double margin, std::vector<ContactPoint>& points) {
  if (is_static_only(shape)) return;
  // Coordinates: those of the surface with the origin moved to the body, where rounding is least.
  Transform relative = inverse(frame_surface) * frame;
  const Vec3 origin = relative.position;
  const Convex body = make_convex(shape, relative, origin);
  Vec3 inside;
  if (const auto* hull = std::get_if<Hull>(&shape)) {
    for (const Vec3& v : hull->data->vertices) inside += v / static_cast<double>(hull->data->vertices.size());
    inside = rotate(relative.rotation, inside);
  }
  Aabb box = bounds(shape, relative);
  const Vec3 reach{margin, margin, margin};
  box.lower -= reach, box.upper += reach;
  const std::size_t first = points.size();
  SurfaceContact<Surface>(surface, body, bounds(shape, {}), inside, origin, margin, points).find(box);
  for (std::size_t i = first; i < points.size(); ++i) {
    points[i].point = frame_surface(points[i].point + origin);
    points[i].normal = rotate(frame_surface.rotation, points[i].normal);
  }
}

}  // namespace amontons::collision
