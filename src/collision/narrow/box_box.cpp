#include <algorithm>
#include <cmath>

#include "collision/narrow/gjk.hpp"
#include "collision/pairs/pairs.hpp"

// Two boxes by the separating axis theorem (Gottschalk, Lin, Manocha, OBBTree, 1996): of the six face normals
// and nine products of edges the one with the largest separation is the way out of an overlap, and bounds the
// distance from below. The manifold is the face of one box clipped by that of the other.
namespace amontons::collision {

namespace {

struct BoxPair {
  Vec3 a, b;    // half edges
  Mat3 axes_a;  // rows: the axes of a in the world
  Mat3 axes_b;
  Mat3 turn;    // turn(i, j) = <axis i of a, axis j of b>
  Vec3 from_a;  // centre of b from that of a, along a's axes
  Vec3 from_b;  // the same along b's axes
  Vec3 centre_a, centre_b;
  double size;  // of the smaller box
};

struct Axis {
  double separation;
  int box, index, other;  // box 0, 1: face `index` of a, b; box 2: edges `index` of a and `other` of b
};

bool separate_by_faces(const BoxPair& p, const Mat3& q, double margin, Axis& best) {
  // A face of b must win clearly: between parallel faces the choice must not hang on rounding.
  const double clearly = 1e-6 * p.size;
  best.separation = -1e300;
  for (int i = 0; i < 3; ++i) {
    const double s = std::abs(p.from_a[i]) - (p.a[i] + dot(q.row[i], p.b));
    if (s > margin) return false;
    if (s > best.separation + clearly) best = {s, 0, i, 0};
  }
  for (int j = 0; j < 3; ++j) {
    const double s = std::abs(p.from_b[j]) - (p.b[j] + q(0, j) * p.a.x + q(1, j) * p.a.y + q(2, j) * p.a.z);
    if (s > margin) return false;
    if (s > best.separation + clearly) best = {s, 1, j, 0};
  }
  return true;
}

bool separate_by_edges(const BoxPair& p, const Mat3& q, double margin, Axis& best) {
  for (int i = 0; i < 3; ++i) {
    const int i1 = i == 2 ? 0 : i + 1, i2 = i == 0 ? 2 : i - 1;
    for (int j = 0; j < 3; ++j) {
      const int j1 = j == 2 ? 0 : j + 1, j2 = j == 0 ? 2 : j - 1;
      const double squared = p.turn(i1, j) * p.turn(i1, j) + p.turn(i2, j) * p.turn(i2, j);
      const double s = std::abs(p.from_a[i2] * p.turn(i1, j) - p.from_a[i1] * p.turn(i2, j)) -
                       (p.a[i1] * q(i2, j) + p.a[i2] * q(i1, j) + p.b[j1] * q(i, j2) + p.b[j2] * q(i, j1));
      // s is the separation times the length of the product; parallel edges add nothing to the faces.
      if (squared < 1e-12) continue;
      if (s > 0 ? s * s > margin * margin * squared : false) return false;
      const double length = std::sqrt(squared);
      if (s > best.separation * length + 1e-6 * p.size * length) best = {s / length, 2, i, j};
    }
  }
  return true;
}

struct Corner {
  double u, v, height;
};

// Keeps what lies at sign * coordinate <= limit, up to rounding. Returns the number of corners.
template <double Corner::* coordinate>
int cut(const Corner* in, int n, double sign, double limit, double rounding, Corner* out) {
  int m = 0;
  for (int k = 0; k < n; ++k) {
    const Corner &p = in[k], &q = in[k + 1 < n ? k + 1 : 0];
    const double dp = limit - sign * (p.*coordinate), dq = limit - sign * (q.*coordinate);
    if (dp >= -rounding) out[m++] = p;
    if ((dp >= -rounding) != (dq >= -rounding)) {
      const double t = std::clamp(dp / (dp - dq), 0.0, 1.0);
      Corner& r = out[m++];
      r = {p.u + t * (q.u - p.u), p.v + t * (q.v - p.v), p.height + t * (q.height - p.height)};
      r.*coordinate = sign * limit;
    }
  }
  return m;
}

// Corners of the two faces that nearly fall together come twice, and edges that nearly fall together cross in
// a point that is no corner: such points say nothing, and come and go with the last bits of the poses.
int keep_corners(const Corner* in, int n, double merge, Corner* out) {
  int m = 0;
  for (int k = 0; k < n; ++k) {
    bool repeated = false;
    for (int i = 0; i < m; ++i)
      repeated |= std::abs(in[k].u - out[i].u) <= merge && std::abs(in[k].v - out[i].v) <= merge;
    if (!repeated) out[m++] = in[k];
  }
  for (int k = 0; k < m && m > 2;) {
    const Corner &p = out[k], &a = out[k > 0 ? k - 1 : m - 1], &b = out[k + 1 < m ? k + 1 : 0];
    const double du = b.u - a.u, dv = b.v - a.v, area = std::abs(du * (p.v - a.v) - dv * (p.u - a.u));
    const bool between = du * (p.u - a.u) + dv * (p.v - a.v) > 0 && du * (b.u - p.u) + dv * (b.v - p.v) > 0;
    if (!between || area > merge * std::sqrt(du * du + dv * dv)) {
      ++k;
      continue;
    }
    std::copy(out + k + 1, out + m, out + k);
    --m;
  }
  return m;
}

// Clips the face of the other box that is turned most against face `index` of a reference box, and appends
// the points within the margin. Returns the smallest gap.
double clip_box_faces(const BoxPair& p, int reference, int index, double margin,
                      std::vector<ContactPoint>& points) {
  const bool first = reference == 0;
  const Mat3& axes = first ? p.axes_a : p.axes_b;
  const Vec3 &half = first ? p.a : p.b, &other = first ? p.b : p.a;
  const Vec3 towards = first ? p.from_a : -p.from_b;  // the other centre, in the reference box
  const double side = towards[index] < 0 ? -1 : 1;
  const int iu = index == 2 ? 0 : index + 1, iv = index == 0 ? 2 : index - 1;
  const auto turn = [&](int i, int j) { return first ? p.turn(i, j) : p.turn(j, i); };

  int facing = 0;
  for (int j = 1; j < 3; ++j)
    if (std::abs(turn(index, j)) > std::abs(turn(index, facing)) + 1e-9) facing = j;
  const double sign = turn(index, facing) * side > 0 ? -1 : 1;
  const int j1 = facing == 2 ? 0 : facing + 1, j2 = facing == 0 ? 2 : facing - 1;
  const auto in_frame = [&](int i) {
    return std::array<double, 3>{towards[i] + sign * other[facing] * turn(i, facing), other[j1] * turn(i, j1),
                                 other[j2] * turn(i, j2)};
  };
  const auto u = in_frame(iu), v = in_frame(iv);
  auto h = in_frame(index);
  for (double& x : h) x *= side;
  h[0] -= half[index];
  Corner corner[12], clipped[12];
  constexpr int around[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
  for (int k = 0; k < 4; ++k) {
    const double s = around[k][0], t = around[k][1];
    corner[k] = {u[0] + s * u[1] + t * u[2], v[0] + s * v[1] + t * v[2], h[0] + s * h[1] + t * h[2]};
  }
  const double rounding = 1e-9 * p.size;
  int n = cut<&Corner::u>(corner, 4, 1, half[iu], rounding, clipped);
  n = cut<&Corner::u>(clipped, n, -1, half[iu], rounding, corner);
  n = cut<&Corner::v>(corner, n, 1, half[iv], rounding, clipped);
  n = cut<&Corner::v>(clipped, n, -1, half[iv], rounding, corner);

  const double merge = 2e-3 * std::min(std::min(half[iu], half[iv]), std::min(other[j1], other[j2]));
  const Vec3 outwards = side * axes.row[index], normal = first ? -outwards : outwards;
  const Vec3 origin = (first ? p.centre_a : p.centre_b) + half[index] * outwards;
  double least = 1e300;
  for (int k = 0; k < n; ++k) least = std::min(least, corner[k].height);
  n = keep_corners(corner, n, merge, clipped);
  for (int k = 0; k < n; ++k) {
    const Corner c = clipped[k];
    if (c.height > margin) continue;
    points.push_back(
        {origin + c.u * axes.row[iu] + c.v * axes.row[iv] + (0.5 * c.height) * outwards, normal, c.height});
  }
  return least;
}

// The nearest points of the two edges that a product of edges singles out.
Separation edge_contact(const BoxPair& p, const Axis& axis) {
  const Vec3 &e = p.axes_a.row[axis.index], &f = p.axes_b.row[axis.other];
  const Vec3 offset = p.centre_b - p.centre_a;
  Vec3 normal = normalised(cross(e, f));
  if (dot(normal, offset) > 0) normal = -normal;
  Vec3 on_a = p.centre_a, on_b = p.centre_b;  // the middles of the two edges
  for (int i = 0; i < 3; ++i) {
    const Vec3 &ea = p.axes_a.row[i], &eb = p.axes_b.row[i];
    if (i != axis.index) on_a -= std::copysign(p.a[i], dot(ea, normal)) * ea;
    if (i != axis.other) on_b += std::copysign(p.b[i], dot(eb, normal)) * eb;
  }
  const Vec3 t = on_b - on_a;
  const double ef = dot(e, f), det = 1 - ef * ef;
  const double half_a = p.a[axis.index], half_b = p.b[axis.other];
  const double s = std::clamp((dot(e, t) - ef * dot(f, t)) / det, -half_a, half_a);
  const double r = std::clamp((ef * dot(e, t) - dot(f, t)) / det, -half_b, half_b);
  Separation result;
  result.within = true;
  result.distance = axis.separation;
  result.normal = normal;
  result.on_a = on_a + s * e;
  result.on_b = on_b + r * f;
  return result;
}

}  // namespace

void collide_boxes(const Box& a, const Transform& frame_a, const Box& b, const Transform& frame_b,
                   double margin, std::vector<ContactPoint>& points) {
  BoxPair p;
  p.a = a.half, p.b = b.half;
  p.axes_a = transposed(to_matrix(frame_a.rotation));
  const Mat3 columns_b = to_matrix(frame_b.rotation);
  p.axes_b = transposed(columns_b);
  p.turn = p.axes_a * columns_b;
  const Vec3 offset = frame_b.position - frame_a.position;
  p.from_a = p.axes_a * offset;
  p.from_b = p.axes_b * offset;
  p.centre_a = frame_a.position, p.centre_b = frame_b.position;
  p.size = std::sqrt(std::min(norm_squared(p.a), norm_squared(p.b)));
  Mat3 q;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) q(i, j) = std::abs(p.turn(i, j));

  Axis face;
  if (!separate_by_faces(p, q, margin, face)) return;
  Axis best = face;
  if (!separate_by_edges(p, q, margin, best)) return;

  const std::size_t before = points.size();
  const double tolerance = 1e-5 * p.size + 0.02 * std::abs(best.separation);
  // The normal of a face in place of one within 0.1 rad that two nearly parallel edges define, if it sees the
  // same gap.
  bool flat = best.box != 2;
  if (!flat) {
    const Vec3 product = normalised(cross(p.axes_a.row[best.index], p.axes_b.row[best.other]));
    const Vec3& normal = (face.box == 0 ? p.axes_a : p.axes_b).row[face.index];
    flat = std::abs(dot(product, normal)) > 0.995;
  }
  if (flat) {
    const double least = clip_box_faces(p, face.box, face.index, margin, points);
    const bool exact = best.box != 2 && best.separation <= 0 && least < 1e300;
    if (exact || std::abs(least - best.separation) <= tolerance) return;
    points.resize(before);
  }
  // What no face decides: corners and edges side by side, where the separating axes miss the true distance.
  const Shape shape_a = a, shape_b = b;
  const Convex body_a = make_convex(shape_a, frame_a, frame_a.position),
               body_b = make_convex(shape_b, frame_b, frame_a.position);
  if (best.separation <= 0 && best.box == 2) {
    Separation deepest = edge_contact(p, best);
    deepest.on_a -= frame_a.position, deepest.on_b -= frame_a.position;
    manifold(body_a, body_b, deepest, margin, points);
  } else if (const Separation s = separation(body_a, body_b, margin); s.within) {
    manifold(body_a, body_b, s, margin, points);
  }
  for (std::size_t i = before; i < points.size(); ++i) points[i].point += frame_a.position;
}

}  // namespace amontons::collision
