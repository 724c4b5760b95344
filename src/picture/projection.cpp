#include "picture/projection.hpp"

#include <algorithm>

#include "amontons/base/elementary.hpp"

namespace amontons {

namespace {

constexpr double grid = 256;      // corners are multiples of 2^-8 samples: exact edge functions in doubles
constexpr double cut = 0.99;      // relative to the distance of the eye: nearer parts are clipped
constexpr double no_area = 1e-9;  // squared samples

struct Corner {
  Vec3 view, normal;
};

// Collects the triangles on the screen.
class Collector {
 public:
  Collector(const Projection& to, std::vector<ScreenTriangle>& out) : to_(to), out_(out) {}

  void add(const Corner (&corners)[3], std::int32_t thing, Layer layer, bool both_sides) {
    Corner kept[4];
    const int count = clip(corners, kept);
    for (int k = 2; k < count; ++k) emit({kept[0], kept[k - 1], kept[k]}, thing, layer, both_sides);
  }

 private:
  // Sutherland and Hodgman's step at the plane in front of the eye: at most four corners remain.
  int clip(const Corner (&in)[3], Corner (&out)[4]) const {
    const double limit = to_.nearest();
    int count = 0;
    for (int k = 0; k < 3; ++k) {
      const Corner &a = in[k], &b = in[(k + 1) % 3];
      const bool inside = a.view.z <= limit;
      if (inside) out[count++] = a;
      if (inside != (b.view.z <= limit)) {
        const double s = (limit - a.view.z) / (b.view.z - a.view.z);
        out[count++] = {a.view + s * (b.view - a.view), a.normal + s * (b.normal - a.normal)};
      }
    }
    return count;
  }

  // One triangle in pixels. Corners are rounded to the grid before the area is taken. Two triangles with a
  // common edge then see the same edge, and each sample beside it lies in one of them. A triangle that shows
  // its back is left out, unless both sides count. It then becomes one that shows its front, with the
  // opposite normals.
  void emit(const Corner (&corners)[3], std::int32_t thing, Layer layer, bool both_sides) {
    ScreenTriangle t;
    for (int k = 0; k < 3; ++k) {
      const Vec3 at = to_.screen(corners[k].view);
      t.x[k] = std::round(at.x * grid) / grid;
      t.y[k] = std::round(at.y * grid) / grid;
      t.nearness[k] = at.z;
    }
    // All corners beyond one side of the picture: nothing of the triangle is inside.
    const auto outside = [](const double (&v)[3], int end) {
      return (v[0] < 0 && v[1] < 0 && v[2] < 0) || (v[0] > end && v[1] > end && v[2] > end);
    };
    if (outside(t.x, to_.width()) || outside(t.y, to_.height())) return;
    t.area = (t.x[1] - t.x[0]) * (t.y[2] - t.y[0]) - (t.x[2] - t.x[0]) * (t.y[1] - t.y[0]);
    if (std::abs(t.area) < no_area || (t.area < 0 && !both_sides)) return;
    const double side = t.area < 0 ? -1 : 1;
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) t.normal[k][i] = static_cast<float>(side * corners[k].normal[i]);
    if (side < 0) {
      std::swap(t.x[1], t.x[2]);
      std::swap(t.y[1], t.y[2]);
      std::swap(t.nearness[1], t.nearness[2]);
      std::swap(t.normal[1], t.normal[2]);
      t.area = -t.area;
    }
    t.thing = thing;
    t.layer = layer;
    out_.push_back(t);
  }

  const Projection& to_;
  std::vector<ScreenTriangle>& out_;
};

Layer layer_of(const PictureInstance& instance) {
  if (instance.appearance == Appearance::clear) return Layer::clear;
  return instance.appearance == Appearance::fixed ? Layer::fixed : Layer::moving;
}

Vec3 unit_or_up(const Vec3& v) {
  const double length = norm(v);
  return length > 0 ? v / length : Vec3{0, 0, 1};
}

// Mean normals of a surface at its vertices, weighted by the areas of the triangles.
std::vector<Vec3> mean_normals(const PictureSurface& surface) {
  std::vector<Vec3> sums(surface.vertices.size());
  for (const auto& t : surface.triangles) {
    const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
    for (const std::int32_t k : t) sums[k] += cross(b - a, c - a);
  }
  for (Vec3& sum : sums) sum = unit_or_up(sum);
  return sums;
}

// A line is a strip of constant width on the screen: two triangles across its direction there. One that
// points at the eye has no direction and is left out, as is one that reaches behind the eye.
void add_line(const PictureLine& line, std::int32_t index, const Projection& to, Collector& out) {
  const Vec3 a = to.view(line.from), b = to.view(line.to);
  if (a.z > to.nearest() || b.z > to.nearest()) return;
  const Vec3 along = b - a;
  const double length = elementary::hypot(along.x, along.y);
  if (length == 0) return;
  const Vec3 side = (0.5 * line.width / length) * Vec3{-along.y, along.x, 0};
  const Corner quad[4] = {{a - side, {}}, {b - side, {}}, {b + side, {}}, {a + side, {}}};
  out.add({quad[0], quad[1], quad[2]}, index, Layer::over, true);
  out.add({quad[0], quad[2], quad[3]}, index, Layer::over, true);
}

}  // namespace

Projection::Projection(const PictureCamera& camera)
    : camera_(camera),
      sample_(camera.pixel / camera.samples),
      width_(camera.width * camera.samples),
      height_(camera.height * camera.samples),
      parallel_(!std::isfinite(camera.distance)) {}

double Projection::nearest() const {
  return parallel_ ? std::numeric_limits<double>::infinity() : cut * camera_.distance;
}

Vec3 Projection::world(double column, double row, double nearness) const {
  const double step = sample_ / (parallel_ ? 1 : nearness);
  return camera_.target + (column - 0.5 * width_) * step * camera_.right +
         (row - 0.5 * height_) * step * camera_.up + depth(nearness) * camera_.eye;
}

SeenPlane Projection::plane(const Vec3& point, const Vec3& normal) const {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const double right = sample_ * dot(camera_.right, normal), up = sample_ * dot(camera_.up, normal);
  const double centre = -0.5 * (right * width_ + up * height_), facing = dot(camera_.eye, normal);
  const double below = dot(camera_.target - point, normal);
  if (parallel_) {  // <target + across + z eye - point, normal> = 0, where across is zero in the middle
    if (facing < 1e-3) return {-inf, 0, 0, -inf, inf};
    return {-(below + centre) / facing, -right / facing, -up / facing, -inf, inf};
  }
  // eye + t (across - d e) is in the plane at t = height / descent, and the nearness there is 1 / t: positive
  // in front of the eye.
  const double height = below + camera_.distance * facing;
  if (height <= 0) return {-inf, 0, 0, -inf, inf};
  return {(camera_.distance * facing - centre) / height, -right / height, -up / height, 0, 1 / (1 - cut)};
}

std::vector<ScreenTriangle> project(const PictureScene& scene, std::span<const Transform> bodies,
                                    std::span<const PictureLine> lines, const Projection& to) {
  std::vector<ScreenTriangle> out;
  Collector collector(to, out);
  std::vector<std::vector<Vec3>> means;
  for (const PictureSurface& surface : scene.surfaces)
    means.push_back(surface.flat ? std::vector<Vec3>{} : mean_normals(surface));
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const PictureInstance& instance = scene.instances[i];
    if (instance.appearance == Appearance::hidden) continue;
    const PictureSurface& surface = scene.surfaces[instance.surface];
    const Transform pose = instance.body < 0 ? instance.at : bodies[instance.body] * instance.at;
    const Mat3 turn = to_matrix(pose.rotation);
    const Vec3& s = instance.scale;
    corners.clear();
    for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
      const Vec3& p = surface.vertices[v];
      Corner corner{to.view(turn * Vec3{s.x * p.x, s.y * p.y, s.z * p.z} + pose.position), {}};
      // A normal is scaled by the inverse of the scale.
      if (!surface.flat) {
        const Vec3& n = means[instance.surface][v];
        corner.normal = unit_or_up(turn * Vec3{n.x / s.x, n.y / s.y, n.z / s.z});
      }
      corners.push_back(corner);
    }
    for (const auto& t : surface.triangles) {
      Corner three[3] = {corners[t[0]], corners[t[1]], corners[t[2]]};
      if (surface.flat) {
        const Vec3 face = to.turned(cross(three[1].view - three[0].view, three[2].view - three[0].view));
        for (Corner& corner : three) corner.normal = unit_or_up(face);
      }
      collector.add(three, static_cast<std::int32_t>(i), layer_of(instance), !surface.closed);
    }
  }
  for (std::size_t k = 0; k < lines.size(); ++k)
    add_line(lines[k], static_cast<std::int32_t>(k), to, collector);
  return out;
}

}  // namespace amontons
