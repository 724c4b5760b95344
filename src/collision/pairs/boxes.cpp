#include "collision/pairs/boxes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/narrow/manifold.hpp"
#include "collision/narrow/polygon.hpp"
#include "collision/narrow/separation.hpp"

// Two boxes by the separating axis theorem (Gottschalk, Lin, Manocha, OBBTree, 1996): of the six face normals
// and nine products of edges the one with the largest separation is the way out of an overlap, and bounds the
// distance from below. The manifold is the face of one box clipped by that of the other.
namespace amontons::collision {

namespace {

struct BoxPair {
  Vec3 a, b;    // half edges
  Mat3 axes_a;  // rows: the axes of a in the world
  Mat3 axes_b;
  Mat3 turn;          // turn(i, j) = <axis i of a, axis j of b>
  Mat3 size_of_turn;  // its absolute values
  Vec3 from_a;        // centre of b from that of a, along a's axes
  Vec3 from_b;        // the same along b's axes
  Vec3 centre_a, centre_b;
  double size;  // of the smaller box
};

struct Axis {
  double separation;
  int box, index, other;  // box 0, 1: face `index` of a, b; box 2: edges `index` of a and `other` of b
};

// The other two axes: (i, next, last) is right-handed.
int next_axis(int i) { return i == 2 ? 0 : i + 1; }
int last_axis(int i) { return i == 0 ? 2 : i - 1; }

// Along the normal of a face the centres are |<normal, offset>| apart, and a box of half edges h reaches
// sum_i h_i |<axis i, normal>| to either side. False: farther apart than the margin.
bool separate_by_faces(const BoxPair& p, double margin, Axis& best) {
  const Mat3& q = p.size_of_turn;
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

// Along the product of edge i of a and edge j of b, e x f, in the coordinates of a: its
// components are (0, -turn(i2, j), turn(i1, j)) for (i, i1, i2), so that only the other two edges
// of either box reach along it.
bool separate_by_edges(const BoxPair& p, double margin, Axis& best) {
  const Mat3& q = p.size_of_turn;
  for (int i = 0; i < 3; ++i) {
    const int i1 = next_axis(i), i2 = last_axis(i);
    for (int j = 0; j < 3; ++j) {
      const int j1 = next_axis(j), j2 = last_axis(j);
      const double squared = p.turn(i1, j) * p.turn(i1, j) + p.turn(i2, j) * p.turn(i2, j);
      const double s = std::abs(p.from_a[i2] * p.turn(i1, j) - p.from_a[i1] * p.turn(i2, j)) -
                       (p.a[i1] * q(i2, j) + p.a[i2] * q(i1, j) + p.b[j1] * q(i, j2) + p.b[j2] * q(i, j1));
      // s is the separation times the length of the product; parallel edges add nothing to the faces.
      if (squared < 1e-12) continue;
      if (s > 0 && s * s > margin * margin * squared) return false;
      const double length = std::sqrt(squared);
      if (s > best.separation * length + 1e-6 * p.size * length) best = {s / length, 2, i, j};
    }
  }
  return true;
}

// Keeps what lies at sign * coordinate <= limit, up to rounding: Sutherland and Hodgman's clipping by a line
// along an axis. Returns the number of corners.
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

// Corners of the two faces that nearly fall together come twice, and edges that nearly fall together cross in
// a point that is no corner: such points say nothing, and come and go with the last bits of the poses.
int keep_corners(const Lifted* in, int n, double merge, Lifted* out) {
  int m = 0;
  for (int k = 0; k < n; ++k) {
    bool repeated = false;
    for (int i = 0; i < m; ++i) repeated |= is_near(in[k], out[i], merge);
    if (!repeated) out[m++] = in[k];
  }
  for (int k = 0; k < m && m > 2;) {
    if (!is_on_line(out[k], out[k > 0 ? k - 1 : m - 1], out[k + 1 < m ? k + 1 : 0], merge)) {
      ++k;
      continue;
    }
    std::copy(out + k + 1, out + m, out + k);
    --m;
  }
  return m;
}

// One box of a pair as the reference, whose face clips the other box, in the coordinates of its own axes.
struct Reference {
  const Mat3& axes;
  const Vec3 &centre, &half, &other;  // `other`: the half edges of the other box
  Vec3 towards;                       // the other centre
  Mat3 turn;                          // turn(i, j) = <own axis i, other axis j>
  int index, iu, iv;                  // the face's axis and the two along it
  double side;                        // of the face: the one that looks at the other box

  Reference(const BoxPair& p, int box, int face_axis)
      : axes(box == 0 ? p.axes_a : p.axes_b),
        centre(box == 0 ? p.centre_a : p.centre_b),
        half(box == 0 ? p.a : p.b),
        other(box == 0 ? p.b : p.a),
        towards(box == 0 ? p.from_a : -p.from_b),
        turn(box == 0 ? p.turn : transposed(p.turn)),
        index(face_axis),
        iu(next_axis(face_axis)),
        iv(last_axis(face_axis)),
        side(towards[face_axis] < 0 ? -1 : 1) {}

  // The axis of the other box that is turned most along the face's; of nearly equal ones the first.
  int facing_axis() const {
    int facing = 0;
    for (int j = 1; j < 3; ++j)
      if (std::abs(turn(index, j)) > std::abs(turn(index, facing)) + 1e-9) facing = j;
    return facing;
  }

  // The corners of the other box's face about axis `facing` that is turned against the
  // reference face, over that face.
  void lift_facing(int facing, Lifted* corner) const {
    const double sign = turn(index, facing) * side > 0 ? -1 : 1;
    const int j1 = next_axis(facing), j2 = last_axis(facing);
    // Of the face, along own axis i: its centre and its two half edges.
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

// Clips the face of the other box that is turned most against face `index` of a reference box, and appends
// the points within the margin. Returns the smallest gap.
double clip_box_faces(const BoxPair& p, int box, int index, double margin,
                      std::vector<ContactPoint>& points) {
  const Reference r(p, box, index);
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
  const double merge = 2e-3 * std::min(std::min(width, depth), other_least);
  const Vec3 outwards = r.side * r.axes.row[index], normal = box == 0 ? -outwards : outwards;
  const Vec3 origin = r.centre + r.half[index] * outwards;
  double least = 1e300;
  for (int k = 0; k < n; ++k) least = std::min(least, corner[k].height);
  n = keep_corners(corner, n, merge, clipped);
  for (int k = 0; k < n; ++k) {
    const Lifted c = clipped[k];
    if (c.height > margin) continue;
    const Vec3 on_face = origin + c.u * r.axes.row[r.iu] + c.v * r.axes.row[r.iv];
    points.push_back({on_face + (0.5 * c.height) * outwards, normal, c.height});
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
  // The parameters s, r at which (s e) and (t + r f) are nearest: s - r ef = <e, t>, s ef - r = <f, t>.
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

BoxPair make_pair(const Box& a, const Transform& frame_a, const Box& b, const Transform& frame_b) {
  BoxPair p;
  p.a = a.half;
  p.b = b.half;
  p.axes_a = transposed(to_matrix(frame_a.rotation));
  const Mat3 columns_b = to_matrix(frame_b.rotation);
  p.axes_b = transposed(columns_b);
  p.turn = p.axes_a * columns_b;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) p.size_of_turn(i, j) = std::abs(p.turn(i, j));
  const Vec3 offset = frame_b.position - frame_a.position;
  p.from_a = p.axes_a * offset;
  p.from_b = p.axes_b * offset;
  p.centre_a = frame_a.position;
  p.centre_b = frame_b.position;
  p.size = std::sqrt(std::min(norm_squared(p.a), norm_squared(p.b)));
  return p;
}

// Whether the normal of a face takes the place of that of the best axis: the face is the best axis, or within
// 0.1 rad of the product of two nearly parallel edges.
bool is_face_normal(const BoxPair& p, const Axis& face, const Axis& best) {
  if (best.box != 2) return true;
  const Vec3 product = normalised(cross(p.axes_a.row[best.index], p.axes_b.row[best.other]));
  const Vec3& normal = (face.box == 0 ? p.axes_a : p.axes_b).row[face.index];
  return std::abs(dot(product, normal)) > 0.995;
}

// What no face decides: corners and edges side by side, where the separating axes miss the true distance.
void collide_without_face(const BoxPair& p, const Axis& best, const Posed& a, const Posed& b, double margin,
                          std::vector<ContactPoint>& points) {
  const Vec3& origin = a.frame.position;
  const Convex body_a = make_convex(a.shape, a.frame, origin), body_b = make_convex(b.shape, b.frame, origin);
  const std::size_t before = points.size();
  if (best.separation <= 0 && best.box == 2) {
    Separation deepest = edge_contact(p, best);
    deepest.on_a -= origin;
    deepest.on_b -= origin;
    manifold(body_a, body_b, deepest, margin, points);
  } else if (const Separation s = separation(body_a, body_b, margin); s.within) {
    manifold(body_a, body_b, s, margin, points);
  }
  for (std::size_t i = before; i < points.size(); ++i) points[i].point += origin;
}

}  // namespace

void collide_boxes(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const BoxPair p = make_pair(std::get<Box>(a.shape), a.frame, std::get<Box>(b.shape), b.frame);
  Axis face;
  if (!separate_by_faces(p, margin, face)) return;
  Axis best = face;
  if (!separate_by_edges(p, margin, best)) return;

  if (is_face_normal(p, face, best)) {
    const std::size_t before = points.size();
    const double least = clip_box_faces(p, face.box, face.index, margin, points);
    // Boxes that overlap along the normal of a face do so by exactly that; otherwise the face must see the
    // gap that the best axis does.
    const bool exact = best.box != 2 && best.separation <= 0 && least < 1e300;
    const double tolerance = 1e-5 * p.size + 0.02 * std::abs(best.separation);
    if (exact || std::abs(least - best.separation) <= tolerance) return;
    points.resize(before);
  }
  collide_without_face(p, best, a, b, margin, points);
}

}  // namespace amontons::collision
