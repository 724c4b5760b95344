#include "collision/narrow/separation.hpp"

#include <cmath>

#include "collision/narrow/epa.hpp"
#include "collision/narrow/gjk.hpp"
#include "collision/narrow/smooth.hpp"

// Cores that keep their distance need GJK only, whatever the radii around them: the depth of two capsules is
// exact as long as their axes are apart. Cores that overlap need EPA, which approaches round surfaces by
// triangles. That leaves a depth good to 1e-8 of the size with a normal good to its root only, so where the
// surface is known better than that, the normal is sharpened.
namespace amontons::collision {

namespace {

double separated_by(const Convex& a, const Convex& b, const Vec3& n) {
  return dot(n, support(a, -n) - support(b, n)) - a.radius - b.radius;
}

// The side of a cylinder is that of the capsule around its axis.
Convex as_capsule(const Convex& body) {
  if (body.kind != Convex::Kind::cylinder) return body;
  Convex capsule = body;
  capsule.kind = Convex::Kind::segment;
  capsule.radius = body.size.x;
  return capsule;
}

bool is_smooth(const Convex& body) { return body.kind == Convex::Kind::ellipsoid; }

// Where the side of a cylinder touches, capsules in place of the cylinders have cores that stay apart, for
// which GJK is exact.
void sharpen_sides(const Convex& a, const Convex& b, Separation& s) {
  const auto touches_side = [&](const Convex& body) {
    return body.kind == Convex::Kind::cylinder && std::abs(dot(body.axis[2], s.normal)) < 0.5;
  };
  if (!touches_side(a) && !touches_side(b)) return;
  const Convex p = touches_side(a) ? as_capsule(a) : a, q = touches_side(b) ? as_capsule(b) : b;
  const double size = pair_scale(a, b).size;
  const Separation t = separation(p, q, 0.01 * size);
  // The capsule bulges at its ends: it must see what the cylinder does, and no less than was known.
  if (!t.within || norm_squared(t.normal - s.normal) > 1e-4) return;
  if (t.distance < s.distance - 1e-12 * size ||
      std::abs(separated_by(a, b, t.normal) - t.distance) > 1e-9 * size)
    return;
  s = t;
}

}  // namespace

Separation separation(const Convex& a, const Convex& b, double limit) {
  Separation result;
  Simplex simplex;
  const double radii = a.radius + b.radius;
  const Cores cores = distance_of_cores(a, b, limit + radii, simplex, result);
  if (cores == Cores::beyond_limit) return result;
  if (cores == Cores::overlap) penetration(a, b, simplex, result);
  result.distance -= radii;
  result.on_a -= a.radius * result.normal;
  result.on_b += b.radius * result.normal;
  if (cores == Cores::overlap) {
    if (is_smooth(a) || is_smooth(b))
      sharpen_smooth(a, b, result);
    else
      sharpen_sides(a, b, result);
  }
  result.within = result.distance <= limit;
  return result;
}

}  // namespace amontons::collision
