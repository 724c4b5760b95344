#include "collision/narrow/surface_body.hpp"

namespace amontons::collision {

namespace {

// The origin of the shape, which lies inside all shapes but hulls: for those the mean of the corners.
Vec3 point_inside(const Shape& shape, const Quat& rotation) {
  const auto* hull = std::get_if<Hull>(&shape);
  if (!hull) return {};
  Vec3 mean;
  for (const Vec3& v : hull->data->vertices) mean += v / static_cast<double>(hull->data->vertices.size());
  return rotate(rotation, mean);
}

}  // namespace

SurfaceBody::SurfaceBody(const Shape& shape, const Transform& frame, double margin_)
    : convex(make_convex(shape, frame, frame.position)),
      local(bounds(shape, {})),
      inside(point_inside(shape, frame.rotation)),
      origin(frame.position),
      box(bounds(shape, frame)),
      margin(margin_) {
  const Vec3 reach{margin, margin, margin};
  box.lower -= reach;
  box.upper += reach;
}

}  // namespace amontons::collision
