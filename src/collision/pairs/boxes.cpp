#include "collision/pairs/boxes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/narrow/manifold.hpp"
#include "collision/pairs/general.hpp"

// Two boxes by the separating axis theorem (Gottschalk, Lin, Manocha, OBBTree, 1996, section 5). Two convex
// polyhedra are disjoint if and only if their projections onto some axis are. It suffices to try the normals
// of the faces of either and the products of an edge of one with an edge of the other. These are the normals
// of the faces of the difference of the two. For boxes these are 3 + 3 + 9 axes.
//
// The separation along a unit axis n is |<n, offset>| minus the reaches of both boxes. The largest of the 15
// is the depth of an overlap (exactly: the difference of the boxes has no other faces), and bounds the
// distance from below. If it belongs to a face, or to edges that are nearly parallel to one, the manifold is
// the face of one box clipped by that of the other. Otherwise two edges cross in one point, or the nearest
// features are corners, which separating axes do not find: then GJK is used.
//
// Walls and piles consist of such pairs. This is faster than the general algorithm, and the depth of a box
// that lies flat is one dot product, without iteration.
namespace amontons::collision {

namespace {

// The boxes a = 0 and b = 1, and their relative pose. In coordinates along the axes of a box its own part of
// every test below is a sum over its half edges.
struct BoxPair {
  Vec3 half[2];       // half edges, m
  Mat3 axes[2];       // rows: the axes of the box in the world
  Vec3 centre[2];     // in the world
  Vec3 from[2];       // centre of b from that of a, along a's axes and along b's
  Mat3 turn;          // turn(i, j) = <axis i of a, axis j of b>
  Mat3 size_of_turn;  // its absolute values
  double size;        // of the smaller box: half its diagonal
};

// The best separating axis so far, with the separation along it (m, negative: overlap).
struct Axis {
  double separation;
  int box, index, other;  // box 0, 1: face `index` of a, b; box 2: edges `index` of a and `other` of b
};

// The other two axes: (i, next, last) is right-handed. By comparison, because a remainder is slow.
int next_axis(int i) { return i == 2 ? 0 : i + 1; }
int last_axis(int i) { return i == 0 ? 2 : i - 1; }

// The six faces, all at once for either box, since the coordinates of one box along the axes of the other are
// known. Along the normal of a face the centres are |<normal, offset>| apart, and a box of half edges h
// reaches sum_i h_i |<axis i, normal>| to either side. False: the distance exceeds the margin.
bool separate_by_faces(const BoxPair& p, double margin, Axis& best) {
  const Mat3& q = p.size_of_turn;
  const auto& [a, b] = p.half;
  // A face of b must be clearly better: between parallel faces the choice must not depend on rounding.
  const double clearly = 1e-6 * p.size;
  best.separation = -1e300;
  for (int i = 0; i < 3; ++i) {
    const double s = std::abs(p.from[0][i]) - (a[i] + dot(q.row[i], b));
    if (s > margin) return false;
    if (s > best.separation + clearly) best = {s, 0, i, 0};
  }
  for (int j = 0; j < 3; ++j) {
    const double s = std::abs(p.from[1][j]) - (b[j] + q(0, j) * a.x + q(1, j) * a.y + q(2, j) * a.z);
    if (s > margin) return false;
    if (s > best.separation + clearly) best = {s, 1, j, 0};
  }
  return true;
}

// Along the product of edge i of a and edge j of b, e x f, in the coordinates of a. Its components are (0,
// -turn(i2, j), turn(i1, j)) for (i, i1, i2), so that only the other two edges of either box contribute.
bool separate_by_edges(const BoxPair& p, double margin, Axis& best) {
  const Mat3& q = p.size_of_turn;
  const auto& [a, b] = p.half;
  const Vec3& offset = p.from[0];
  for (int i = 0; i < 3; ++i) {
    const int i1 = next_axis(i), i2 = last_axis(i);
    for (int j = 0; j < 3; ++j) {
      const int j1 = next_axis(j), j2 = last_axis(j);
      const double squared = p.turn(i1, j) * p.turn(i1, j) + p.turn(i2, j) * p.turn(i2, j);
      const double s = std::abs(offset[i2] * p.turn(i1, j) - offset[i1] * p.turn(i2, j)) -
                       (a[i1] * q(i2, j) + a[i2] * q(i1, j) + b[j1] * q(i, j2) + b[j2] * q(i, j1));
      // s is the separation times the length of the product; parallel edges (within 1e-6 rad) add nothing to
      // the faces.
      if (squared < 1e-12) continue;
      if (s > 0 && s * s > margin * margin * squared) return false;
      const double length = std::sqrt(squared);
      if (s > best.separation * length + 1e-6 * p.size * length) best = {s / length, 2, i, j};
    }
  }
  return true;
}

// Clipping in the coordinates of the reference face, where every clipping edge is parallel to an axis: one
// comparison per corner instead of a dot product (Sutherland and Hodgman). Keeps points with sign *
// coordinate <= limit, up to rounding. Returns the number of corners.
template <double Lifted::* coordinate>
int cut(const Lifted* in, int n, double sign, double limit, double rounding, Lifted* out) {
  int m = 0;
  for (int k = 0; k < n; ++k) {
    const Lifted &p = in[k], &q = in[k + 1 < n ? k + 1 : 0];
    const double dp = limit - sign * (p.*coordinate), dq = limit - sign * (q.*coordinate);
    if (dp >= -rounding) out[m++] = p;
    if ((dp >= -rounding) != (dq >= -rounding)) {
      out[m] = lerp(p, q, std::clamp(dp / (dp - dq), 0.0, 1.0));
      out[m++].*coordinate = sign * limit;
    }
  }
  return m;
}

// Corners of the two faces that nearly coincide occur twice, and edges that nearly coincide cross in a point
// that is no corner. Such points are redundant and depend on the last bits of the poses.
int keep_corners(const Lifted* in, int n, double merge, Lifted* out) {
  int m = 0;
  for (int k = 0; k < n; ++k) {
    bool repeated = false;
    for (int i = 0; i < m; ++i) repeated |= is_near(in[k], out[i], merge);
    if (!repeated) out[m++] = in[k];
  }
  return drop_between(out, m, merge);
}

// One box of a pair as the reference: its face clips the other box, in the coordinates of its own axes.
struct Reference {
  const BoxPair& p;
  int box, index;                                            // the box, and the axis that its face belongs to
  const Vec3 &half = p.half[box], &other = p.half[1 - box];  // half edges of this box and of the other one
  Vec3 towards = box == 0 ? p.from[0] : -p.from[1];          // the other centre
  Mat3 turn = box == 0 ? p.turn : transposed(p.turn);        // turn(i, j) = <own axis i, other axis j>
  int iu = next_axis(index), iv = last_axis(index);          // the two axes along the face
  double side = towards[index] < 0 ? -1 : 1;                 // of the face that faces the other box

  // The axis of the other box that is most parallel to the face's normal; the first of nearly equal ones.
  int facing_axis() const {
    int facing = 0;
    for (int j = 1; j < 3; ++j)
      if (std::abs(turn(index, j)) > std::abs(turn(index, facing)) + 1e-9) facing = j;
    return facing;
  }

  // The corners of the other box's face about axis `facing` that faces the reference face, as heights over
  // that face.
  void lift_facing(int facing, Lifted* corner) const {
    const double sign = turn(index, facing) * side > 0 ? -1 : 1;
    const int j1 = next_axis(facing), j2 = last_axis(facing);
    // For the face, along own axis i: its centre and its two half edges.
    const auto along = [&](int i) {
      return std::array<double, 3>{towards[i] + sign * other[facing] * turn(i, facing),
                                   other[j1] * turn(i, j1), other[j2] * turn(i, j2)};
    };
    const auto u = along(iu), v = along(iv);
    auto h = along(index);
    for (double& x : h) x *= side;
    h[0] -= half[index];
    constexpr int around[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
    for (int k = 0; k < 4; ++k) {
      const double s = around[k][0], t = around[k][1];
      corner[k] = {u[0] + s * u[1] + t * u[2], v[0] + s * v[1] + t * v[2], h[0] + s * h[1] + t * h[2]};
    }
  }
};

// Clips the most opposed face of the other box by face `index` of a reference box, and appends the points
// within the margin. Returns the smallest gap.
double clip_box_faces(const BoxPair& p, int box, int index, double margin,
                      std::vector<ContactPoint>& points) {
  const Reference r{p, box, index};
  const Mat3& axes = p.axes[box];
  const int facing = r.facing_axis();
  const double width = r.half[r.iu], depth = r.half[r.iv];
  Lifted corner[12], clipped[12];
  r.lift_facing(facing, corner);
  const double rounding = 1e-9 * p.size;
  int n = cut<&Lifted::u>(corner, 4, 1, width, rounding, clipped);
  n = cut<&Lifted::u>(clipped, n, -1, width, rounding, corner);
  n = cut<&Lifted::v>(corner, n, 1, depth, rounding, clipped);
  n = cut<&Lifted::v>(clipped, n, -1, depth, rounding, corner);

  const double other_least = std::min(r.other[next_axis(facing)], r.other[last_axis(facing)]);
  // Points within a thousandth of the shortest edge are one; these are half edges.
  const double merge = 2e-3 * std::min(std::min(width, depth), other_least);
  const Vec3 outwards = r.side * axes.row[index], normal = box == 0 ? -outwards : outwards;
  const Vec3 origin = p.centre[box] + r.half[index] * outwards;
  // The smallest gap is that of all corners, including those omitted below.
  double least = 1e300;
  for (int k = 0; k < n; ++k) least = std::min(least, corner[k].height);
  n = keep_corners(corner, n, merge, clipped);
  for (int k = 0; k < n; ++k) {
    const Lifted c = clipped[k];
    if (c.height > margin) continue;
    const Vec3 on_face = origin + c.u * axes.row[r.iu] + c.v * axes.row[r.iv];
    points.push_back({on_face + (0.5 * c.height) * outwards, normal, c.height});
  }
  return least;
}

// The nearest points of the two edges that a product of edges selects: for each box the edge along the axis
// that is farthest towards the other box.
Separation edge_contact(const BoxPair& p, const Axis& axis) {
  const Vec3 &e = p.axes[0].row[axis.index], &f = p.axes[1].row[axis.other];
  const Vec3 offset = p.centre[1] - p.centre[0];
  Vec3 normal = normalised(cross(e, f));
  if (dot(normal, offset) > 0) normal = -normal;
  Vec3 on_a = p.centre[0], on_b = p.centre[1];  // the middles of the two edges
  for (int i = 0; i < 3; ++i) {
    const Vec3 &ea = p.axes[0].row[i], &eb = p.axes[1].row[i];
    if (i != axis.index) on_a -= std::copysign(p.half[0][i], dot(ea, normal)) * ea;
    if (i != axis.other) on_b += std::copysign(p.half[1][i], dot(eb, normal)) * eb;
  }
  const Vec3 t = on_b - on_a;
  // The parameters s, r at which (s e) and (t + r f) are nearest: s - r ef = <e, t>, s ef - r = <f, t>.
  const double ef = dot(e, f), det = 1 - ef * ef;
  const double half_a = p.half[0][axis.index], half_b = p.half[1][axis.other];
  const double s = std::clamp((dot(e, t) - ef * dot(f, t)) / det, -half_a, half_a);
  const double r = std::clamp((ef * dot(e, t) - dot(f, t)) / det, -half_b, half_b);
  return {true, axis.separation, normal, on_a + s * e, on_b + r * f};
}

// Data of the two poses for the tests, once per pair.
BoxPair make_pair(const Posed& a, const Posed& b) {
  BoxPair p;
  for (int box : {0, 1}) {
    const Posed& posed = box == 0 ? a : b;
    p.half[box] = std::get<Box>(posed.shape).half;
    p.axes[box] = transposed(to_matrix(posed.frame.rotation));
    p.centre[box] = posed.frame.position;
  }
  p.turn = p.axes[0] * transposed(p.axes[1]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) p.size_of_turn(i, j) = std::abs(p.turn(i, j));
  for (int box : {0, 1}) p.from[box] = p.axes[box] * (p.centre[1] - p.centre[0]);
  p.size = std::sqrt(std::min(norm_squared(p.half[0]), norm_squared(p.half[1])));
  return p;
}

// Whether the normal of a face replaces that of the best axis. Nearly parallel edges have a product close to
// the normal of a face. They touch along a line or an area, which the product would reduce to one point. The
// face must be the best axis, or within 0.1 rad of the product of two nearly parallel edges.
bool is_face_normal(const BoxPair& p, const Axis& face, const Axis& best) {
  if (best.box != 2) return true;
  const Vec3 product = normalised(cross(p.axes[0].row[best.index], p.axes[1].row[best.other]));
  const Vec3& normal = p.axes[face.box].row[face.index];
  return std::abs(dot(product, normal)) > 0.995;
}

// Two crossing edges: the separating axis gives depth and points. Otherwise the cases without a deciding
// face: corners and edges side by side, where the separating axes miss the true distance.
void collide_without_face(const BoxPair& p, const Axis& best, const Posed& a, const Posed& b, double margin,
                          std::vector<ContactPoint>& points) {
  if (best.separation > 0 || best.box != 2) return collide_convex(a, b, margin, points);
  const Vec3& origin = a.frame.position;
  const std::size_t before = points.size();
  Separation deepest = edge_contact(p, best);
  deepest.on_a -= origin;
  deepest.on_b -= origin;
  manifold(make_convex(a.shape, a.frame, origin), make_convex(b.shape, b.frame, origin), deepest, margin,
           points);
  for (std::size_t i = before; i < points.size(); ++i) points[i].point += origin;
}

}  // namespace

void collide_boxes(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const BoxPair p = make_pair(a, b);
  Axis face;
  if (!separate_by_faces(p, margin, face)) return;
  Axis best = face;
  if (!separate_by_edges(p, margin, best)) return;

  if (is_face_normal(p, face, best)) {
    const std::size_t before = points.size();
    const double least = clip_box_faces(p, face.box, face.index, margin, points);
    // For boxes that overlap along the normal of a face that overlap is exact. Otherwise the face must give
    // the gap of the best axis.
    const bool exact = best.box != 2 && best.separation <= 0 && least < 1e300;
    const double tolerance = 1e-5 * p.size + 0.02 * std::abs(best.separation);
    if (exact || std::abs(least - best.separation) <= tolerance) return;
    points.resize(before);
  }
  collide_without_face(p, best, a, b, margin, points);
}

}  // namespace amontons::collision
