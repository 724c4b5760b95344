#pragma once
#include <cmath>

// Polygons over a plane, in the form that clipping leaves them.
namespace amontons::collision {

// A point over a plane: its coordinates there and its height along the normal.
struct Lifted {
  double u, v, height;
};

inline Lifted lerp(const Lifted& p, const Lifted& q, double t) {
  return {p.u + t * (q.u - p.u), p.v + t * (q.v - p.v), p.height + t * (q.height - p.height)};
}

inline bool is_near(const Lifted& p, const Lifted& q, double distance) {
  return std::abs(p.u - q.u) <= distance && std::abs(p.v - q.v) <= distance;
}

// Edges of two faces that nearly fall together cross in a point that is no corner of what the faces share,
// and that comes and goes with the last bits of the poses. Whether p is such a point: between its neighbours
// a and b, within `merge` of the line through them.
inline bool is_on_line(const Lifted& p, const Lifted& a, const Lifted& b, double merge) {
  const double du = b.u - a.u, dv = b.v - a.v, area = std::abs(du * (p.v - a.v) - dv * (p.u - a.u));
  const bool between = du * (p.u - a.u) + dv * (p.v - a.v) > 0 && du * (b.u - p.u) + dv * (b.v - p.v) > 0;
  return between && !(area > merge * std::sqrt(du * du + dv * dv));
}

}  // namespace amontons::collision
