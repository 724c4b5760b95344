// Contact of a convex body with a static surface of triangles, from the outside only. The two kinds of
// surface differ in how they find triangles and neighbours, so the algorithm is a template over that. It
// processes the triangles near the body one by one and independently; nothing is stored between calls.
//
// Contact normals. A triangle alone would push a sliding body off its edges, although the surface continues
// behind them. A normal is therefore only allowed if the surface, not the triangle, has it. That is the
// normal of the face, or one whose supporting point on the triangle also supports the surface around it.
// (Voronoi region of an edge or corner: D. Eberly, "Game Physics", 2nd ed., section 8.4; the rule for
// internal edges is that of C. Ericson, "Real-Time Collision Detection", section 5.1.6, turned into a test.)
// Any other normal is replaced by that of the face. Edges and corners without an allowed normal are inactive;
// on flat ground all are.
//
// Contact points on a face: the supporting feature of the body along the face normal, clipped by the three
// planes that stand on the edges. Points made by clipping are kept only where the surface has a real edge.
// The triangles of one flat face together give the corners of the body and those of the common area, nothing
// in between. The triangulation of a flat face therefore does not affect the contacts.
//
// Depth. A body whose centre is outside is pushed out of the faces that it penetrates. A body whose centre is
// behind the surface is pushed out along the normal of the closest face (push_out).
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "collision/narrow/manifold.hpp"
#include "collision/narrow/separation.hpp"
#include "collision/shapes/facet.hpp"

namespace amontons::collision {

// A convex body over a static surface, in the coordinates of the surface with the origin moved to the body,
// where rounding is least.
struct SurfaceBody {
  Convex convex;
  Aabb local;     // the box around it along its own axes
  Vec3 inside;    // a point inside it
  Vec3 origin;    // of these coordinates, in those of the surface
  Aabb box;       // around it and its margin, in the coordinates of the surface
  double margin;  // largest gap that counts

  // `frame`: of the shape, in the coordinates of the surface.
  SurfaceBody(const Shape& shape, const Transform& frame, double margin);

  double size() const { return convex.extent + convex.radius; }
  // Points within this distance of a plane are on both its sides, so that none is lost between two triangles.
  double tolerance() const { return 1e-9 * size(); }
  // The lowest point of the body over a plane with the normal n.
  Vec3 lowest_along(const Vec3& n) const { return support(convex, -n) - convex.radius * n; }

  // Most triangles near a slanting body are out of its reach. A cheap first test compares the triangle's box
  // along the axes of the body with the body's own box (three of the separating axes).
  bool is_in_reach(const Facet& facet, double reach) const {
    for (int k = 0; k < 3; ++k) {
      const double a = dot(convex.axis[k], facet.corner[0]), b = dot(convex.axis[k], facet.corner[1]),
                   c = dot(convex.axis[k], facet.corner[2]);
      if (std::min({a, b, c}) > local.upper[k] + reach || std::max({a, b, c}) < local.lower[k] - reach)
        return false;
    }
    return true;
  }

  // Whether a point is between the planes that stand on the edges of a facet. Over a flat mesh these planes
  // divide space without gaps: every point is over at least one triangle.
  bool is_over(const Facet& facet, const Vec3& p) const {
    bool yes = true;
    for (int k = 0; k < 3; ++k) yes = yes && dot(inward_of(facet, k), p - facet.corner[k]) >= -tolerance();
    return yes;
  }

  // The separation of a box from a triangle with the normal n over one of its faces. It applies if the
  // distance of the nearest corner from the face is the distance of the two. Most triangles under a box that
  // rests on many are such. False: unknown.
  bool separate_by_face(const Convex& triangle, const Vec3& n, double limit, Separation& s) const;

  // The feature of the body that faces a face. It is stored for the next face: on flat ground all have the
  // same normal. `lowest`: the lowest point of the body over the face, which the feature must contain.
  const Feature& feature_towards(const Vec3& n, const Vec3& lowest) {
    if (!(n == feature_normal_)) supporting_feature(convex, -n, &lowest, nullptr, feature_);
    feature_normal_ = n;
    return feature_;
  }

 private:
  Feature feature_;
  Vec3 feature_normal_;  // normal for which feature_ is valid
};

// Removes coincident points with about the same normal, from index `first` on; `length` is the size of the
// body.
void remove_doubles(std::vector<ContactPoint>& points, std::size_t first, double length);

// One call of the algorithm; the members are its intermediate results. All lengths are in m, all points in
// the coordinates of the body (SurfaceBody::origin) unless a function says otherwise.
//
// A Surface has, in coordinates of its own and with triangles identified by integers:
//   void for_each_near(const Aabb&, visit) const   visit(triangle) for all that may touch the box
//   Facet facet(triangle) const              corners and normal
//   void add_neighbours(triangle, facet) const   kinds of its edges and the corners across them
//   void for_each_neighbour(vertex, visit) const   visit(position) for all that edges join to it
//   bool is_active(vertex) const             whether an edge that is not flat ends there
//   bool is_outside(p, triangle, closest) const   p, with its closest point on the surface
template <class Surface>
class SurfaceContact {
 public:
  SurfaceContact(const Surface& surface, SurfaceBody& body, std::vector<ContactPoint>& points)
      : surface_(surface), body_(body), points_(points) {}

  // Appends the points, in the coordinates of the body: triangle by triangle. If an overlap had no allowed
  // direction, repeats this with directions from outside. Finally removes the points that several triangles
  // found.
  void find() {
    const std::size_t first = points_.size();
    const bool any_behind = touch_all();
    // If the body overlaps an edge or a corner, the shortest direction out of one triangle may lead into the
    // next. Then directions are taken from the body moved out a little, where they are those of shortest
    // distances. If an attempt still finds an overlap the next one moves it farther.
    for (int attempt = 0; attempt < 4 && blocked_ && norm_squared(outwards_) > 0; ++attempt) {
      points_.resize(first);
      lift_ = (2 * overlap_) * normalised(outwards_);
      touch_all();
    }
    if (any_behind) push_out(first);
    remove_doubles(points_, first, body_.size());
  }

 private:
  static constexpr double infinite = std::numeric_limits<double>::infinity();
  // Round caps count as polygons. The lowest point of their rim is added if it is deeper than the polygon by
  // this fraction of the body's size. Within a milliradian of flat its position is arbitrary.
  static constexpr double thinned_out = 3e-5;

  // A point of the body's feature during clipping by the planes on the edges of a triangle.
  struct ClipPoint {
    Vec3 at;
    bool keep;
    int edge;  // triangle edge that contains the side to the next point; -1: a side of the body's feature
  };

  // A triangle in the coordinates of the body, and its neighbourhood, which few triangles need.
  Facet shifted(auto triangle) const {
    Facet facet = surface_.facet(triangle);
    for (Vec3& corner : facet.corner) corner -= body_.origin;
    return facet;
  }
  void add_neighbours(auto triangle, Facet& facet) const {
    surface_.add_neighbours(triangle, facet);
    for (Vec3& corner : facet.opposite) corner -= body_.origin;
  }

  // All triangles near the body, lifted or not. Returns whether some of them face away.
  bool touch_all() {
    bool any_behind = false;
    blocked_ = false;
    overlap_ = norm(lift_);
    outwards_ = {};
    surface_.for_each_near(body_.box, [&](auto triangle) {
      Facet facet = shifted(triangle);
      if (dot(facet.normal, body_.inside - facet.corner[0]) > 0)
        touch(triangle, facet);
      else
        any_behind = true;
    });
    return any_behind;
  }

  // One triangle that faces the body. Cheap tests come first. Only a triangle with an edge that can have a
  // normal of its own needs the separation.
  void touch(auto index, Facet& facet) {
    const double reach = body_.margin + norm(lift_);
    if (!body_.is_in_reach(facet, reach)) return;
    const Vec3 n = facet.normal, lowest = body_.lowest_along(n);
    if (dot(n, lowest - facet.corner[0]) > body_.margin) return;
    add_neighbours(index, facet);
    // Flat and concave edges only have the face's normal.
    const bool rounded = std::any_of(facet.edge, facet.edge + 3, [](EdgeKind kind) {
      return kind == EdgeKind::convex || kind == EdgeKind::border;
    });
    if (!rounded) return static_cast<void>(touch_face(facet, lowest, false));
    if (is_apart(facet, reach)) return;
    const Convex triangle =
        make_triangle(facet.corner[0] - lift_, facet.corner[1] - lift_, facet.corner[2] - lift_);
    Separation s;
    if (!body_.separate_by_face(triangle, n, reach, s)) s = separation(body_.convex, triangle, reach);
    if (!s.within) return;
    const bool allowed = is_allowed(facet, s.normal);
    const double core_depth = -s.distance - body_.convex.radius;
    if (core_depth >= 0) {  // the cores of body and triangle overlap
      blocked_ = blocked_ || !allowed;
      outwards_ += n;  // no direction out of one face alone, but away from all of them
      // At least the smallest distance that separates two bodies.
      overlap_ = std::max({overlap_, core_depth, 1e-7 * body_.size()});
    }
    if (allowed)
      touch_along(facet, triangle, s, lowest);
    else
      touch_face(facet, lowest, false);
  }

  // The triangle lies behind the plane through its point nearest to the centre of the body, across the line
  // between the two. Whether this plane is farther from the body than `reach`. Most triangles beside a round
  // body are left out so, without a search for their distance.
  bool is_apart(const Facet& facet, double reach) const {
    const Vec3 nearest = closest_point(facet.corner, body_.convex.centre + lift_).at - lift_;
    const Vec3 out = body_.convex.centre - nearest, n = out / norm(out);
    return dot(n, body_.lowest_along(n) - nearest) > reach;
  }

  // Contact along the normal of the separation. Flat bodies prefer the face's normal to one that is almost
  // equal: the manifold then does not change when the body rocks.
  void touch_along(const Facet& facet, const Convex& triangle, const Separation& s, const Vec3& lowest) {
    const bool is_round = body_.convex.radius > 0 || body_.convex.kind == Convex::Kind::ellipsoid;
    const double cosine = is_round ? 1 - 1e-14 : 1 - 2e-4;
    const double least = dot(s.normal, facet.normal) > cosine ? touch_face(facet, lowest, true) : infinite;
    if (least == infinite)
      touch_edge(facet, triangle, s);
    else if (lift_ == Vec3{} && least > s.distance + thinned_out * body_.convex.extent)
      points_.push_back({0.5 * (s.on_a + s.on_b), s.normal, s.distance});
  }

  // Contact along a normal that an edge or a corner of the surface has. If the body was lifted to find the
  // normal, it is clipped in its real place. If its feature misses the triangle there, the surface point
  // nearest to the lifted body gets the gap of the lowest point.
  void touch_edge(const Facet& facet, const Convex& triangle, const Separation& s) {
    if (lift_ == Vec3{}) {
      manifold(body_.convex, triangle, s, body_.margin, points_);
      return;
    }
    const Convex in_place = make_triangle(facet.corner[0], facet.corner[1], facet.corner[2]);
    const double gap = clip_features(body_.convex, in_place, s.normal, nullptr, body_.margin, points_);
    if (std::isfinite(gap)) return;
    const Vec3 on_surface = s.on_b + lift_;
    add(s.normal, on_surface, dot(s.normal, body_.lowest_along(s.normal) - on_surface), 0.5);
  }

  // Whether the surface has the normal d at the triangle: no corner around the supporting corner or edge
  // extends farther along d. With n the normal of the face, d is supported by
  //   the face (d = n up to the tolerance),
  //   an edge: a border has all normals from the face outwards, a convex edge those that its other triangle
  //     does not rise above, a flat or concave edge has none of its own;
  //   or a corner: then its neighbours must not rise above it.
  bool is_allowed(const Facet& facet, const Vec3& d) const {
    double along[3], length = 0;
    for (int k = 0; k < 3; ++k) {
      along[k] = dot(d, facet.corner[k] - facet.corner[0]);
      length = std::max(length, norm(facet.corner[(k + 1) % 3] - facet.corner[k]));
    }
    const double top = std::max({along[0], along[1], along[2]});
    // The corners that support d, up to the flat angle.
    bool on_top[3];
    int count = 0, last = 0;
    for (int k = 0; k < 3; ++k) {
      on_top[k] = along[k] >= top - flat_angle * length;
      if (!on_top[k]) continue;
      ++count;
      last = k;
    }
    if (count == 3) return dot(d, facet.normal) > 0;
    if (count != 2) return surface_.is_active(facet.vertex[last]) && is_supporting(facet, last, d);
    const int k = !on_top[2] ? 0 : !on_top[0] ? 1 : 2;  // the edge between the two corners
    if (facet.edge[k] == EdgeKind::border) return dot(d, facet.normal) >= 0;
    if (facet.edge[k] != EdgeKind::convex) return false;
    const Vec3 to = facet.opposite[k] - facet.corner[k];
    return dot(d, to) <= flat_angle * norm(to);
  }

  // Whether no vertex around corner k extends farther along d than that corner. Then the corner supports the
  // surface along d, and d is a normal of it.
  bool is_supporting(const Facet& facet, int k, const Vec3& d) const {
    bool yes = true;
    surface_.for_each_neighbour(facet.vertex[k], [&](const Vec3& position) {
      const Vec3 to = position - body_.origin - facet.corner[k];
      yes = yes && dot(d, to) <= flat_angle * norm(to);
    });
    return yes;
  }

  // Contact along the normal of the face. Returns the least gap of the part of the body's feature over the
  // triangle. `sure`: this direction is known to be right.
  double touch_face(const Facet& facet, const Vec3& lowest, bool sure) {
    const Vec3 n = facet.normal;
    const Feature& feature = body_.feature_towards(n, lowest);
    int count = feature.count;
    double raised = infinite;
    for (int i = 0; i < count; ++i) {
      clip_[i] = {feature.points[i], true, -1};
      raised = std::min(raised, dot(n, feature.points[i] - lowest));
    }
    for (int k = 0; k < 3 && count > 0; ++k) count = clip(facet, k, count);
    // The polygon of a round cap may lack the lowest point of its rim.
    if (raised > thinned_out * body_.convex.extent && body_.is_over(facet, lowest))
      clip_[count++] = {lowest, true, -1};
    if (count == 0) return infinite;
    // For the whole part over the triangle: single corners would classify only some of them as a step or a
    // riser.
    Vec3 middle;
    for (int i = 0; i < count; ++i) middle += clip_[i].at / count;
    if (!sure && is_behind_another(facet, middle)) return infinite;
    double least = infinite;
    for (int i = 0; i < count; ++i) {
      const double gap = dot(n, clip_[i].at - facet.corner[0]);
      least = std::min(least, gap);
      if (clip_[i].keep) add(n, clip_[i].at, gap, -0.5);
    }
    return least;
  }

  // Adds a point at `part` of its gap from `at`, which is on the body (-0.5) or on the surface (0.5).
  void add(const Vec3& n, const Vec3& at, double gap, double part) {
    if (gap <= body_.margin) points_.push_back({at + (part * gap) * n, n, gap});
  }

  // Sutherland and Hodgman's clipping of the points in clip_ by the plane on edge k. Every side of the
  // polygon stores the triangle edge that contains it, if any: a crossing on such a side is a corner of the
  // triangle.
  int clip(const Facet& facet, int k, int count) {
    const Vec3 from = facet.corner[k], inward = inward_of(facet, k);
    const double close = body_.tolerance();
    const auto side = [&](const ClipPoint& p) { return dot(inward, p.at - from); };
    int out = 0;
    for (int i = 0; i < count; ++i) {
      const ClipPoint &p = clip_[i], &q = clip_[i + 1 < count ? i + 1 : 0];
      const double side_p = side(p), side_q = side(q);
      const bool in_p = side_p >= -close, in_q = side_q >= -close;
      const auto crossing = [&](int edge) {
        return ClipPoint{p.at + (side_p / (side_p - side_q)) * (q.at - p.at), is_kept(facet, k, p.edge),
                         edge};
      };
      if (in_p) clipped_[out++] = p;
      if (in_p && !in_q && side_p > close) clipped_[out++] = crossing(k);
      if (in_p && !in_q && side_p <= close) clipped_[out - 1].edge = k;
      if (!in_p && in_q && side_q > close) clipped_[out++] = crossing(p.edge);
    }
    std::copy_n(clipped_, out, clip_);
    return out;
  }

  // Whether the crossing of edge k with a side of the polygon is a contact. On a side of the body's feature
  // it is one if the edge is an edge of the surface. On another triangle edge it is one if the corner between
  // the two is a corner of it.
  bool is_kept(const Facet& facet, int k, int other_edge) const {
    if (other_edge < 0) return facet.edge[k] != EdgeKind::flat;
    const int corner = other_edge == (k + 2) % 3 ? k : (k + 1) % 3;
    return surface_.is_active(facet.vertex[corner]) && is_supporting(facet, corner, facet.normal);
  }

  // A point of the body may be deep behind the plane of one face and just below another one (a box on a step
  // is deep behind the riser). Contact is with the face that it penetrated, the closer one.
  bool is_behind_another(const Facet& facet, const Vec3& point) const {
    const double depth = -dot(facet.normal, point - facet.corner[0]), limit = 0.9 * depth;
    if (depth <= body_.tolerance()) return false;
    bool found = false;
    surface_.for_each_near(around(point, limit), [&](auto triangle) {
      if (found) return;
      const Facet other = shifted(triangle);
      if (std::abs(dot(other.normal, point - other.corner[0])) >= limit) return;
      if (dot(other.normal, body_.inside - other.corner[0]) <= 0) return;
      found = norm(point - closest_point(other.corner, point).at) < limit;
    });
    return found;
  }

  // In the coordinates of the surface.
  Aabb around(const Vec3& point, double distance) const {
    const Vec3 centre = point + body_.origin, reach{distance, distance, distance};
    return {centre - reach, centre + reach};
  }

  // Pushes a body whose centre is behind the surface out along the normal of the closest face. Its whole
  // feature there makes contacts, so that no single point takes the whole push.
  void push_out(std::size_t first) {
    double best = infinite;
    Facet face{};
    bool outside = true;
    const auto find_closest = [&](const Aabb& where) {
      surface_.for_each_near(where, [&](auto triangle) {
        const Facet facet = shifted(triangle);
        TrianglePoint closest = closest_point(facet.corner, body_.inside);
        const double distance = norm(closest.at - body_.inside);
        if (distance >= best) return;
        best = distance;
        face = facet;
        closest.at += body_.origin;
        outside = surface_.is_outside(body_.inside + body_.origin, triangle, closest);
      });
    };
    find_closest(body_.box);
    find_closest(around(body_.inside, best));  // the closest may be beside the body
    if (outside) return;
    points_.resize(first);
    const Vec3 n = face.normal, lowest = body_.lowest_along(n);
    const Feature& side = body_.feature_towards(n, lowest);
    for (int i = 0; i < side.count; ++i)
      add(n, side.points[i], dot(n, side.points[i] - face.corner[0]), -0.5);
  }

  // Scratch is part of the object, on the stack: a pair allocates only its points.
  const Surface& surface_;
  SurfaceBody& body_;
  std::vector<ContactPoint>& points_;
  bool blocked_ = false;  // whether an overlap has no allowed direction out
  double overlap_ = 0;    // the deepest
  Vec3 outwards_;         // sum of the normals of triangles that overlap
  // While lift_ is nonzero the triangles are moved against it instead of the body, whose features stay valid.
  Vec3 lift_;  // displacement of the body to find directions
  ClipPoint clip_[Feature::capacity + 8], clipped_[Feature::capacity + 8];
};

// Appends the contact points of a convex shape with a surface, in world coordinates; the normals point from
// the surface to the shape. The work is done in the coordinates of the surface.
template <class Surface>
void collide_surface(const Surface& surface, const Transform& frame_surface, const Shape& shape,
                     const Transform& frame, double margin, std::vector<ContactPoint>& points) {
  SurfaceBody body(shape, inverse(frame_surface) * frame, margin);
  const std::size_t first = points.size();
  SurfaceContact<Surface>(surface, body, points).find();
  for (std::size_t i = first; i < points.size(); ++i) {
    points[i].point = frame_surface(points[i].point + body.origin);
    points[i].normal = rotate(frame_surface.rotation, points[i].normal);
  }
}

}  // namespace amontons::collision
