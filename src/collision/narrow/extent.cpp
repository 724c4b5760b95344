#include "amontons/collision/narrow/extent.hpp"

#include "collision/narrow/convex.hpp"
#include "collision/narrow/feature.hpp"

namespace amontons {

// The support function about `from` as origin; the radius around a core adds the same along every direction.
double extent_along(const Shape& shape, const Transform& frame, const Vec3& direction, const Vec3& from) {
  const collision::Convex body = collision::make_convex(shape, frame, from);
  return dot(direction, collision::support(body, direction)) + body.radius;
}

bool has_face(const Shape& shape, const Transform& frame, const Vec3& direction) {
  thread_local collision::Feature feature;
  const collision::Convex body = collision::make_convex(shape, frame, frame.position);
  collision::supporting_feature(body, direction, nullptr, nullptr, feature);
  return feature.count > 2;
}

}  // namespace amontons
