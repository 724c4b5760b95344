#include "collision/narrow/manifold.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

// Contact manifolds: the supporting features of two bodies, projected along the normal onto the tangent plane
// and clipped there (Sutherland and Hodgman, Reentrant polygon clipping, 1974). The polygon of one feature is
// cut by the half planes inside the edges of the other, one after the other. The common projection of both
// remains. A corner of it has a height over the plane in either feature, and the difference of the two
// heights is the gap there.
//
// All corners of the common projection are kept: no choice of four is made that could change from step to
// step. Points that exist only by rounding would flicker, and each kind of them is removed where it arises:
//   - a corner on the clipping edge counts as inside, up to 1e-9 of the size: neither side loses it;
//   - a crossing is computed from the inside to the outside, in either direction of the polygon, so that both
//     bodies give the same one;
//   - corners of the two faces that nearly coincide are one point;
//   - crossings of edges that nearly coincide are between two corners and are redundant.
namespace amontons::collision {

namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();

// The plane across the contact normal, through a point of the contact; clipping uses its coordinates.
struct TangentFrame {
  Vec3 origin, u, v, normal;

  TangentFrame(const Vec3& at, const Vec3& n) : origin(at), normal(n) {
    const Quat q = rotation_to_z(n);
    u = rotate(q, {1, 0, 0});
    v = rotate(q, {0, 1, 0});
  }
  // Coordinates of a point in the plane and over it, and back.
  Lifted lift(const Vec3& p) const {
    const Vec3 d = p - origin;
    return {dot(u, d), dot(v, d), dot(normal, d)};
  }
  Vec3 point(double a, double b, double height) const { return origin + a * u + b * v + height * normal; }
};

// The scratch of one manifold; a face of `capacity` corners gains at most one per clipping edge. One per
// thread, so that pairs allocate nothing.
struct Clipper {
  static constexpr int capacity = 2 * Feature::capacity;
  Feature feature_a, feature_b;
  Lifted corner[Feature::capacity];  // of the clipping feature
  Lifted clipped[capacity], scratch[capacity];
  int count;
  double gap[capacity];
};

// The part of the polygon (or segment, for two points) on the inner, left side of the directed edge p -> q.
// Points outside by no more than the tolerance count as inside.
void clip_by_edge(Clipper& c, const Lifted& p, const Lifted& q, bool closed, double tolerance) {
  double nu = p.v - q.v, nv = q.u - p.u;  // the edge turned to the left
  const double length = std::sqrt(nu * nu + nv * nv);
  if (length == 0) return;
  nu /= length;
  nv /= length;
  const auto inner = [&](const Lifted& r) { return nu * (r.u - p.u) + nv * (r.v - p.v); };
  std::copy(c.clipped, c.clipped + c.count, c.scratch);
  const int n = c.count;
  c.count = 0;
  const auto keep = [&](const Lifted& r) {
    if (c.count < Clipper::capacity) c.clipped[c.count++] = r;
  };
  // From the inside, at d_from, to the outside, at d_to < 0: always in this order, so that the crossing does
  // not depend on the direction of the edge.
  const auto cross_edge = [&](const Lifted& from, double d_from, const Lifted& to, double d_to) {
    keep(lerp(from, to, std::max(0.0, d_from) / (std::max(0.0, d_from) - d_to)));
  };
  for (int i = 0; i < n; ++i) {
    const Lifted& r = c.scratch[i];
    const double d = inner(r);
    const bool inside = d >= -tolerance;
    if (inside) keep(r);
    if (i + 1 == n && !closed) break;
    const Lifted& next = c.scratch[i + 1 < n ? i + 1 : 0];
    const double d_next = inner(next);
    const bool next_inside = d_next >= -tolerance;
    if (inside && !next_inside) cross_edge(r, d, next, d_next);
    if (!inside && next_inside) cross_edge(next, d_next, r, d);
  }
}

// Whether p is between its neighbours a and b, within `merge` of the line through them. Its distance from the
// line is twice the area of the triangle over the length of its base.
bool is_on_line(const Lifted& p, const Lifted& a, const Lifted& b, double merge) {
  const double du = b.u - a.u, dv = b.v - a.v, area = std::abs(du * (p.v - a.v) - dv * (p.u - a.u));
  const bool between = du * (p.u - a.u) + dv * (p.v - a.v) > 0 && du * (b.u - p.u) + dv * (b.v - p.v) > 0;
  return between && !(area > merge * std::sqrt(du * du + dv * dv));
}

// The shortest edge of a face or an edge; points are merged relative to it. Squares are compared, and one
// root is taken at the end.
double shortest_edge(const Feature& f) {
  double least = unbounded;
  for (int i = 0; i < f.count; ++i)
    least = std::min(least, norm_squared(f.points[i] - f.points[i + 1 < f.count ? i + 1 : 0]));
  return std::sqrt(least);
}

// Emits the points of c.clipped with their gaps, each half-way between the two surfaces. The clipped feature
// has the point's height, and the other surface is above or below by the gap. Only one of the points closer
// together than a thousandth of the shortest edge stays, because nearly aligned corners would occur twice.
double emit(Clipper& c, const TangentFrame& frame, double merge, double margin, bool clipped_above,
            std::vector<ContactPoint>& points) {
  double least = unbounded;
  for (int i = 0; i < c.count; ++i) {
    const Lifted& p = c.clipped[i];
    bool repeated = false;
    for (int k = 0; k < i && !repeated; ++k) repeated = is_near(p, c.clipped[k], merge) && c.gap[k] <= margin;
    least = std::min(least, c.gap[i]);
    if (repeated) {
      c.gap[i] = unbounded;  // so that no chain of neighbours is lost behind it
      continue;
    }
    if (c.gap[i] > margin) continue;
    const double middle = clipped_above ? p.height - 0.5 * c.gap[i] : p.height + 0.5 * c.gap[i];
    points.push_back({frame.point(p.u, p.v, middle), frame.normal, c.gap[i]});
  }
  return least;
}

// A feature that a face clips. `above`: the feature belongs to body a, to which the normal points.
struct Clipping {
  const Feature &clipped, &face;
  bool above;
};

double clip_by_face(Clipper& c, const Clipping& of, const TangentFrame& frame, double size, double margin,
                    std::vector<ContactPoint>& points) {
  const auto& [clipped, face, above] = of;
  c.count = clipped.count;
  for (int i = 0; i < clipped.count; ++i) c.clipped[i] = frame.lift(clipped.points[i]);
  for (int i = 0; i < face.count; ++i) c.corner[i] = frame.lift(face.points[i]);
  // A point is inside an edge if it is to the left of it, for counter-clockwise polygons. Seen against the
  // normal the face of body b is counter-clockwise, that of a clockwise.
  for (int i = 0; i < face.count && c.count > 0; ++i) {
    const Lifted &p = c.corner[i], &q = c.corner[i + 1 < face.count ? i + 1 : 0];
    clip_by_edge(c, above ? p : q, above ? q : p, c.count > 2, 1e-9 * size);
  }
  double merge = 1e-3 * shortest_edge(face);
  if (clipped.count > 1) merge = std::min(merge, 1e-3 * shortest_edge(clipped));
  c.count = drop_between(c.clipped, c.count, merge);
  // The face's plane over the tangent plane: <face.normal, (u, v, height) - on> = 0, solved for the height.
  const double slope = dot(face.normal, frame.normal);
  const double su = dot(face.normal, frame.u) / slope, sv = dot(face.normal, frame.v) / slope;
  const Lifted& on = c.corner[0];
  for (int i = 0; i < c.count; ++i) {
    const Lifted& p = c.clipped[i];
    const double plane = on.height - su * (p.u - on.u) - sv * (p.v - on.v);
    c.gap[i] = above ? p.height - plane : plane - p.height;
  }
  return emit(c, frame, merge, margin, above, points);
}

// Two nearly parallel edges touch along their common part. Crossing ones (by more than 0.02 rad) touch in a
// point, which is not handled here. Both ends of the common part are points, half-way between the edges, with
// the gap there.
double clip_edges(Clipper& c, const TangentFrame& frame, double margin, std::vector<ContactPoint>& points) {
  // Angle (sine): edges that cross by more touch in a point.
  constexpr double parallel = 0.02;
  const Lifted a0 = frame.lift(c.feature_a.points[0]), a1 = frame.lift(c.feature_a.points[1]);
  Lifted b[2] = {frame.lift(c.feature_b.points[0]), frame.lift(c.feature_b.points[1])};
  const double du = a1.u - a0.u, dv = a1.v - a0.v, length = std::sqrt(du * du + dv * dv);
  const double eu = b[1].u - b[0].u, ev = b[1].v - b[0].v, other = std::sqrt(eu * eu + ev * ev);
  if (length == 0 || other == 0 || std::abs(du * ev - dv * eu) > parallel * length * other) return unbounded;
  const auto along = [&](const Lifted& p) { return ((p.u - a0.u) * du + (p.v - a0.v) * dv) / length; };
  double from = along(b[0]), to = along(b[1]);
  if (from > to) {
    std::swap(from, to);
    std::swap(b[0], b[1]);
  }
  const double begin = std::max(0.0, from), end = std::min(length, to);
  if (end <= begin) return unbounded;
  c.count = 0;
  for (double s : {begin, end}) {
    const Lifted p = lerp(a0, a1, s / length), q = lerp(b[0], b[1], (s - from) / (to - from));
    c.clipped[c.count] = {0.5 * (p.u + q.u), 0.5 * (p.v + q.v), p.height};
    c.gap[c.count++] = p.height - q.height;
  }
  return emit(c, frame, 1e-3 * std::min(length, other), margin, true, points);
}

}  // namespace

int drop_between(Lifted* corner, int count, double merge) {
  for (int k = 0; k < count && count > 2;) {
    if (!is_on_line(corner[k], corner[k > 0 ? k - 1 : count - 1], corner[k + 1 < count ? k + 1 : 0], merge)) {
      ++k;
      continue;
    }
    std::copy(corner + k + 1, corner + count, corner + k);
    --count;
  }
  return count;
}

// A face clips the feature of the other body; if both have faces, that of b clips that of a.
double clip_features(const Convex& a, const Convex& b, const Vec3& normal, const Separation* deepest,
                     double margin, std::vector<ContactPoint>& points) {
  // The features that face each other: that of a against the normal, that of b along it.
  thread_local Clipper c;
  const bool both_round = a.kind == Convex::Kind::cylinder && b.kind == Convex::Kind::cylinder;
  supporting_feature(a, -normal, deepest ? &deepest->on_a : nullptr, nullptr, c.feature_a);
  // Two caps as polygons with equal phase: coaxial ones then share their corners instead of crossing between
  // them.
  supporting_feature(b, normal, deepest ? &deepest->on_b : nullptr, both_round ? &a.axis[0] : nullptr,
                     c.feature_b);
  const TangentFrame frame(c.feature_a.points[0], normal);
  const double size = pair_scale(a, b).size;
  const Feature &fa = c.feature_a, &fb = c.feature_b;
  if (fb.count > 2) return clip_by_face(c, {fa, fb, true}, frame, size, margin, points);
  if (fa.count > 2) return clip_by_face(c, {fb, fa, false}, frame, size, margin, points);
  if (fa.count == 2 && fb.count == 2) return clip_edges(c, frame, margin, points);
  return unbounded;
}

void manifold(const Convex& a, const Convex& b, const Separation& deepest, double margin,
              std::vector<ContactPoint>& points) {
  // A face within 0.1 rad of the normal of least separation replaces that normal if it gives the same gap.
  // Between nearly flat faces the direction of least separation is rounding, the face normals are not. The
  // gap may differ by 2 %, four times the change of a depth by a turn of 0.1 rad (1 - cos 0.1). It may also
  // differ by 1e-5 of the size, for surfaces that just touch.
  constexpr double aligned = 0.995;
  thread_local Feature face;
  const double size = pair_scale(a, b).size;
  const double tolerance = 1e-5 * size + 0.02 * std::abs(deepest.distance);
  const std::size_t before = points.size();

  // 0: the face of b, along the normal; 1: that of a, against it.
  Vec3 candidate[2];
  double cosine[2] = {0, 0};
  for (int k : {0, 1}) {
    const double sign = k == 0 ? 1 : -1;
    supporting_feature(k == 0 ? b : a, sign * deepest.normal, k == 0 ? &deepest.on_b : &deepest.on_a, nullptr,
                       face);
    if (face.count < 3) continue;
    candidate[k] = sign * face.normal;
    cosine[k] = dot(candidate[k], deepest.normal);
  }
  // If both are equally aligned that of b is taken, so that the choice does not depend on rounding.
  const int first = cosine[1] > cosine[0] + 1e-4 ? 1 : 0;
  for (int k : {first, 1 - first}) {
    if (cosine[k] < aligned) continue;
    const double least = clip_features(a, b, candidate[k], &deepest, margin, points);
    if (std::abs(least - deepest.distance) <= tolerance) return;
    points.resize(before);
  }
  const double least = clip_features(a, b, deepest.normal, &deepest, margin, points);
  // Corners, crossing edges, round bodies: the point of the separation itself.
  if (least > deepest.distance + tolerance && deepest.distance <= margin)
    points.push_back({0.5 * (deepest.on_a + deepest.on_b), deepest.normal, deepest.distance});
}

}  // namespace amontons::collision
