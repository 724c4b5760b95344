#include "collision/narrow/simplex.hpp"

// The nearest point of a simplex by the regions of Ericson, Real-Time Collision Detection, section 5.1, with
// the areas as triple products, which lose fewer digits.
namespace amontons::collision {

namespace {

Nearest nearest_on_point(const Simplex& s, int i) {
  return {{i, 0, 0}, {1, 0, 0}, 1, s.point[i].w, norm_squared(s.point[i].w)};
}

Nearest nearest_on_segment(const Simplex& s, int i, int j) {
  const Vec3 &p = s.point[i].w, &q = s.point[j].w;
  const Vec3 e = q - p;
  const double along = -dot(p, e), length = norm_squared(e);
  if (along <= 0 || length == 0) return nearest_on_point(s, i);
  if (along >= length) return nearest_on_point(s, j);
  const double t = along / length;
  const Vec3 v = p + t * e;
  return {{i, j, 0}, {1 - t, t, 0}, 2, v, norm_squared(v)};
}

Nearest nearer(const Nearest& a, const Nearest& b) { return b.squared < a.squared ? b : a; }

}  // namespace

Nearest nearest_on_triangle(const Simplex& s, int i, int j, int k) {
  const Vec3 &a = s.point[i].w, &b = s.point[j].w, &c = s.point[k].w;
  const Vec3 ab = b - a, ac = c - a, n = cross(ab, ac);
  const double area = norm_squared(n);
  // Twice the areas of the triangles that the origin's projection makes with the edges, times |n|: <n, b x c>
  // = <n, (b - o) x (c - o)> for any o along n. Their ratios are the weights of the corners.
  const double u = dot(n, cross(b, c)), v = dot(n, cross(c, a)), w = dot(n, cross(a, b));
  // A needle has no usable normal; its edges hold its nearest point as well as it can be told.
  const bool needle = area <= 1e-24 * norm_squared(ab) * norm_squared(ac);
  if (!needle && u > 0 && v > 0 && w > 0) {
    const double sum = u + v + w;
    const Vec3 p = (dot(n, a) / area) * n;
    return {{i, j, k}, {u / sum, v / sum, w / sum}, 3, p, norm_squared(p)};
  }
  return nearer(nearer(nearest_on_segment(s, i, j), nearest_on_segment(s, j, k)),
                nearest_on_segment(s, i, k));
}

namespace {

// The nearest point lies on a face that the origin is seen from, that is, on whose outer side it lies: where
// the apex d and the origin are on different sides of the plane of a, b, c. A flat tetrahedron has no inside;
// all its faces are candidates. False: the origin lies inside.
bool nearest_on_tetrahedron(const Simplex& s, Nearest& result) {
  constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
  bool outside = false;
  for (const auto& f : faces) {
    const Vec3 &a = s.point[f[0]].w, &d = s.point[f[3]].w;
    const Vec3 ab = s.point[f[1]].w - a, ac = s.point[f[2]].w - a, n = cross(ab, ac);
    const double apex = dot(n, d - a), origin = -dot(n, a);
    const bool flat = apex * apex <= 1e-26 * norm_squared(ab) * norm_squared(ac) * norm_squared(d - a);
    if (!flat && (apex > 0) == (origin > 0)) continue;
    const Nearest candidate = nearest_on_triangle(s, f[0], f[1], f[2]);
    result = outside ? nearer(result, candidate) : candidate;
    outside = true;
  }
  return outside;
}

}  // namespace

bool reduce(Simplex& s, Vec3& v) {
  Nearest nearest;
  if (s.count == 1)
    nearest = nearest_on_point(s, 0);
  else if (s.count == 2)
    nearest = nearest_on_segment(s, 0, 1);
  else if (s.count == 3)
    nearest = nearest_on_triangle(s, 0, 1, 2);
  else if (!nearest_on_tetrahedron(s, nearest))
    return false;
  DifferencePoint kept[3];
  for (int i = 0; i < nearest.count; ++i) kept[i] = s.point[nearest.index[i]];
  for (int i = 0; i < nearest.count; ++i) {
    s.point[i] = kept[i];
    s.weight[i] = nearest.weight[i];
  }
  s.count = nearest.count;
  v = nearest.point;
  return true;
}

}  // namespace amontons::collision
