#include "picture/shadow.hpp"

#include <algorithm>
#include <limits>

#include "picture/raster.hpp"

namespace amontons {

namespace {

constexpr int block = 8;          // texels
constexpr int band = 64;          // rows of texels
constexpr int margin = 4;         // texels around the visible part
constexpr double shift = 2;       // texels: lift of a point along the normal and towards the light
constexpr double grazing = 0.15;  // least cosine of the light for which the lift is sufficient

struct Box {
  Vec3 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
           std::numeric_limits<double>::infinity()};
  Vec3 high = -low;

  void add(const Vec3& point, double reach) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], point[k] - reach);
      high[k] = std::max(high[k], point[k] + reach);
    }
  }
};

// The ball around a surface: middle of its bounds, and the farthest vertex.
std::pair<Vec3, double> ball_of(const PictureSurface& surface) {
  Box box;
  for (const Vec3& p : surface.vertices) box.add(p, 0);
  if (surface.vertices.empty()) return {{}, 0};
  const Vec3 centre = 0.5 * (box.low + box.high);
  double reach = 0;
  for (const Vec3& p : surface.vertices) reach = std::max(reach, norm(p - centre));
  return {centre, reach};
}

// Bounds, along the axes of the light, of all things in the picture or beside it within its size.
Box lit(const PictureScene& scene, std::span<const Transform> bodies, const Projection& picture,
        const Projection& light) {
  std::vector<std::pair<Vec3, double>> balls;
  for (const PictureSurface& surface : scene.surfaces) balls.push_back(ball_of(surface));
  Box box;
  for (const PictureInstance& instance : scene.instances) {
    if (instance.appearance == Appearance::hidden || instance.appearance == Appearance::clear) continue;
    const Transform pose = instance.body < 0 ? instance.at : bodies[instance.body] * instance.at;
    const auto& [centre, reach] = balls[instance.surface];
    const Vec3& s = instance.scale;
    const Vec3 middle = pose({s.x * centre.x, s.y * centre.y, s.z * centre.z});
    const double radius = reach * std::max({s.x, s.y, s.z});
    const Vec3 view = picture.view(middle);
    if (view.z > picture.nearest()) continue;
    // Things beside the picture throw shadows into it, in general from no farther than its own size.
    const Vec3 seen = picture.screen(view);
    const bool beside = seen.x < -picture.width() || seen.x > 2 * picture.width() ||
                        seen.y < -picture.height() || seen.y > 2 * picture.height();
    if (!beside ||
        radius > 4 * norm(picture.world(0, 0, seen.z) - picture.world(1, 0, seen.z)) * picture.width())
      box.add(light.view(middle), radius);
  }
  return box;
}

// A camera that looks from the light along its rays. Its axes are any two across them; where the light stands
// in the zenith, the cross product with z vanishes and x serves.
PictureCamera towards(const Vec3& light) {
  PictureCamera camera;
  const Vec3 across = cross({0, 0, 1}, light);
  camera.eye = light;
  camera.right = norm(across) > 1e-9 ? normalised(across) : Vec3{1, 0, 0};
  camera.up = cross(light, camera.right);
  camera.samples = 1;
  return camera;
}

// The same camera with the box in its middle. The longer side of the box takes all texels but the margin. The
// margin keeps the filter of the shadow from reading beyond the map.
PictureCamera framing(PictureCamera camera, const Box& box, int texels) {
  const Vec3 size = box.high - box.low, middle = 0.5 * (box.low + box.high);
  camera.pixel = std::max(std::max(size.x, size.y) / std::max(texels - 2 * margin, 1), 1e-12);
  camera.width = static_cast<int>(std::ceil(size.x / camera.pixel)) + 2 * margin;
  camera.height = static_cast<int>(std::ceil(size.y / camera.pixel)) + 2 * margin;
  camera.target = middle.x * camera.right + middle.y * camera.up + middle.z * camera.eye;
  return camera;
}

}  // namespace

Shadows::Shadows(const PictureScene& scene, std::span<const Transform> bodies, const Projection& picture,
                 const Vec3& light, int texels, unsigned threads)
    : camera_(towards(light)), projection_(camera_), light_(light) {
  // The map covers what can be seen and what can throw a shadow on it, so that its texels are small.
  const Box box = lit(scene, bodies, picture, projection_);
  empty_ = !(box.low.x <= box.high.x);
  if (empty_) return;
  camera_ = framing(camera_, box, texels);
  projection_ = Projection(camera_);
  columns_ = camera_.width;
  rows_ = camera_.height;
  for (Map& map : maps_)
    map.depth.assign(static_cast<std::size_t>(columns_) * rows_, -std::numeric_limits<float>::infinity());
  const std::vector<ScreenTriangle> triangles = project(scene, bodies, {}, projection_);
  rasterise(triangles, {columns_, rows_, band, 0}, threads, [this](const Band& seen) {
    for (int k = 0; k < 2; ++k)
      std::transform(seen.nearness[k].begin(), seen.nearness[k].end(),
                     maps_[k].depth.begin() + static_cast<std::ptrdiff_t>(seen.first) * columns_,
                     [](double depth) { return static_cast<float>(depth); });
  });
  for (Map& map : maps_) find_blocks(map);
}

// The nearest depth of each block of texels and of the texels around it. A point that is nearer to the light
// than its block needs no filter: most of a picture is lit, so most points cost one comparison.
void Shadows::find_blocks(Map& map) const {
  const int across = (columns_ + block - 1) / block, up = (rows_ + block - 1) / block;
  map.blocks.assign(static_cast<std::size_t>(across) * up, -std::numeric_limits<float>::infinity());
  for (int i = 0; i < up; ++i)
    for (int j = 0; j < across; ++j)
      for (int r = std::max(0, i * block - 1); r <= std::min(rows_ - 1, (i + 1) * block); ++r)
        for (int c = std::max(0, j * block - 1); c <= std::min(columns_ - 1, (j + 1) * block); ++c)
          map.blocks[i * across + j] = std::max(map.blocks[i * across + j], map.depth[r * columns_ + c]);
}

double Shadows::missing(const Vec3& point, const Vec3& normal, bool behind_fixed) const {
  if (empty_) return 0;
  const Vec3 seen = projection_.screen(projection_.view(point + shift * camera_.pixel * normal));
  // A texel is as deep as the surface within it is steep: that depth casts no shadow.
  const double steep = std::clamp(dot(normal, light_), grazing, 1.0);
  const double depth = seen.z + shift * camera_.pixel / steep;
  const double moving = missing(maps_[0], seen, depth);
  return behind_fixed ? std::max(moving, missing(maps_[1], seen, depth)) : moving;
}

double Shadows::missing(const Map& map, const Vec3& seen, double depth) const {
  if (!(seen.x >= 1 && seen.y >= 1 && seen.x < columns_ - 1 && seen.y < rows_ - 1)) return 0;
  const int column = static_cast<int>(seen.x), row = static_cast<int>(seen.y);
  const int across = (columns_ + block - 1) / block;
  if (map.blocks[row / block * across + column / block] <= depth) return 0;
  int hidden = 0;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j) hidden += map.depth[(row + i) * columns_ + column + j] > depth;
  return hidden / 9.0;
}

}  // namespace amontons
