#include "amontons/picture/picture.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/base/error.hpp"
#include "picture/raster.hpp"
#include "picture/shadow.hpp"

namespace amontons {

namespace {

constexpr int band_rows = 16;        // pixels
constexpr int most_texels = 1400;    // of the light's picture
constexpr double brightest = 1.06;   // of a face normal to the light
constexpr double shade = 0.75;       // share of the direct light that a shadow removes
constexpr double floor_shade = 0.3;  // the same on a plane
constexpr double tile_shade =
    0.12;                         // share of the brightness that a dark tile of a plane lacks at the target
constexpr double tiled = 0.6;     // radius around the target within which planes have tiles, in widths
constexpr float outline = 0.72f;  // brightness at the border of two things
constexpr std::int32_t no_instance = -1;

void require(const PictureScene& scene, std::size_t bodies, const PictureCamera& camera) {
  AMONTONS_REQUIRE(camera.width > 0 && camera.height > 0 && camera.samples > 0 && camera.pixel > 0,
                   "a picture needs width, height, samples and size of a pixel above zero");
  for (const PictureSurface& s : scene.surfaces)
    for (const auto& t : s.triangles)
      AMONTONS_REQUIRE(
          *std::min_element(t.begin(), t.end()) >= 0 &&
              *std::max_element(t.begin(), t.end()) < static_cast<std::int64_t>(s.vertices.size()),
          "a triangle of a picture names a vertex that is not there");
  const auto there = [&](std::int32_t body) { return body < static_cast<std::int64_t>(bodies); };
  for (const PictureInstance& i : scene.instances)
    AMONTONS_REQUIRE(there(i.body) && i.surface >= 0 && i.surface < std::ssize(scene.surfaces),
                     "an instance of a picture names a body or a surface that is not there");
  for (const PicturePlane& p : scene.planes)
    AMONTONS_REQUIRE(there(p.body), "a plane of a picture names a body that is not there");
}

// The layers of a sample.
struct Seen {
  std::int32_t moving = no_instance, fixed = no_instance;      // instance; -2 - k is plane k
  bool fixed_first = false;                                    // whether the fixed one is nearer
  bool dark = false;                                           // whether it is a dark tile of a plane
  double nearness = -std::numeric_limits<double>::infinity();  // of the nearer one

  std::int32_t first() const { return fixed_first || moving == no_instance ? fixed : moving; }
};

// Draws in bands of rows. Each sample has the nearest moving thing, the nearest fixed one, and what lies over
// both (transparent things and lines); `colour` mixes them. Triangles are projected once; planes are not
// triangles, because they have no border, and are asked at each sample.
class Painter {
 public:
  Painter(const PictureScene& scene, std::span<const Transform> bodies, const PictureView& view)
      : scene_(scene),
        view_(view),
        style_(view.style),
        tiled_(tiled * view.camera.width * view.camera.pixel),
        projection_(view.camera),
        triangles_(project(scene, bodies, view.lines, projection_)),
        shadows_(scene, bodies, projection_, view.style.light,
                 std::min(most_texels, std::max(projection_.width(), projection_.height())), view.threads) {
    for (const PicturePlane& plane : scene.planes) {
      const Transform at = plane.body < 0 ? plane.at : bodies[plane.body] * plane.at;
      const Vec3 normal = rotate(at.rotation, {0, 0, 1});
      planes_.push_back({projection_.plane(at.position, normal), normal, at});
    }
  }

  Picture draw() const {
    const PictureCamera& camera = view_.camera;
    const int samples = camera.samples, width = projection_.width(), height = projection_.height();
    Picture picture;
    picture.colours.resize(static_cast<std::size_t>(3) * camera.width * camera.height);
    if (view_.probe) {
      picture.labels.resize(static_cast<std::size_t>(width) * height);
      picture.depths.resize(picture.labels.size());
    }
    rasterise(triangles_, {width, height, band_rows * samples, 1}, view_.threads, [&](const Band& band) {
      const int below = band.first == 0 ? 0 : 1;
      const std::vector<Seen> seen = layers_of(band);
      std::vector<float> row(static_cast<std::size_t>(3) * camera.width);
      for (int r = band.first + below; r < band.first + band.rows; r += samples) {
        for (int pixel = 0; pixel < camera.width; ++pixel) {
          const Colour c = mean(band, seen, pixel * samples, r, samples);
          for (int k = 0; k < 3; ++k) row[3 * pixel + k] = c[k];
        }
        std::uint8_t* out = &picture.colours[row.size() * (camera.height - 1 - r / samples)];
        for (std::size_t k = 0; k < row.size(); ++k) out[k] = static_cast<std::uint8_t>(255 * row[k] + 0.5f);
      }
      if (view_.probe) report(band, seen, below, picture);
    });
    return picture;
  }

 private:
  struct Plane {
    SeenPlane seen;
    Vec3 normal;
    Transform at;
  };

  // Layer 0 of a band has moving triangles, layer 1 fixed ones, with which planes compete by their nearness.
  std::vector<Seen> layers_of(const Band& band) const {
    std::vector<Seen> out(band.nearness[0].size());
    for (int row = band.first; row < band.first + band.rows; ++row)
      for (int column = 0; column < band.width; ++column) {
        const std::size_t k = band.at(column, row);
        Seen& s = out[k];
        double fixed = band.nearness[1][k];
        if (band.triangle[1][k] >= 0) s.fixed = triangles_[band.triangle[1][k]].thing;
        for (std::size_t p = 0; p < planes_.size(); ++p) {
          const double here = planes_[p].seen.nearness(column + 0.5, row + 0.5);
          if (here > fixed) fixed = here, s.fixed = -2 - static_cast<std::int32_t>(p);
        }
        if (band.triangle[0][k] >= 0) s.moving = triangles_[band.triangle[0][k]].thing;
        s.fixed_first = fixed > band.nearness[0][k];
        if (style_.tile > 0 && s.fixed <= -2 && (s.fixed_first || s.moving == no_instance))
          s.dark = dark_tile(planes_[-2 - s.fixed], projection_.world(column + 0.5, row + 0.5, fixed));
        s.nearness = std::max(fixed, band.nearness[0][k]);
      }
    return out;
  }

  // Mean over the samples of a pixel; one represents all if they show the same triangles.
  Colour mean(const Band& band, const std::vector<Seen>& seen, int column, int row, int samples) const {
    const std::size_t first = band.at(column, row);
    bool same = !edge(band, seen, column, row);
    for (int i = 0; i < samples && same; ++i)
      for (int j = 0; j < samples && same; ++j) {
        const std::size_t k = band.at(column + j, row + i);
        for (const auto& triangle : band.triangle) same = same && triangle[k] == triangle[first];
        same = same && seen[k].fixed == seen[first].fixed && seen[k].dark == seen[first].dark &&
               seen[k].fixed_first == seen[first].fixed_first;
      }
    if (same) return colour(band, seen, column, row);
    Colour sum{};
    for (int i = 0; i < samples; ++i)
      for (int j = 0; j < samples; ++j) {
        const Colour c = colour(band, seen, column + j, row + i);
        for (int k = 0; k < 3; ++k) sum[k] += c[k];
      }
    for (float& c : sum) c /= static_cast<float>(samples * samples);
    return sum;
  }

  // The colours are laid over each other: background, the moving thing, the fixed one (perhaps as glass),
  // what is transparent. Lines lie over all, and borders of things are darker.
  Colour colour(const Band& band, const std::vector<Seen>& seen, int column, int row) const {
    const std::size_t k = band.at(column, row);
    if (const std::int32_t over = band.triangle[3][k]; over >= 0)
      return view_.lines[triangles_[over].thing].colour;
    const Seen& s = seen[k];
    const bool through = shines_through(s);
    Colour out = style_.background;
    if (s.moving != no_instance && (!s.fixed_first || through))
      out = lit(triangles_[band.triangle[0][k]], column, row, style_.glass >= 1);
    if (s.fixed <= -2 && (s.fixed_first || s.moving == no_instance)) out = floor(s, column, row);
    if (s.fixed >= 0 && (s.fixed_first || s.moving == no_instance))
      out = mixed(out, lit(triangles_[band.triangle[1][k]], column, row, true), through ? style_.glass : 1);
    if (band.triangle[2][k] >= 0 && band.nearness[2][k] > s.nearness) {
      const ScreenTriangle& t = triangles_[band.triangle[2][k]];
      out = mixed(out, lit(t, column, row, false), scene_.instances[t.thing].opacity);
    }
    if (edge(band, seen, column, row))
      for (float& c : out) c *= outline;
    return mixed(out, {1, 1, 1}, style_.fade);
  }

  // A plane covers things below it; moving instances shine through other fixed ones.
  bool shines_through(const Seen& s) const {
    return s.moving != no_instance && s.fixed_first && s.fixed >= 0 && style_.glass < 1;
  }
  std::int32_t shown_moving(const Seen& s) const {
    return !s.fixed_first || shines_through(s) ? s.moving : no_instance;
  }

  // Whether a sample and its left or lower neighbour show different things.
  bool edge(const Band& band, const std::vector<Seen>& seen, int column, int row) const {
    const Seen& s = seen[band.at(column, row)];
    const auto differs = [&](int c, int r) {
      const Seen& other = seen[band.at(c, r)];
      return shown_moving(s) != shown_moving(other) || s.first() != other.first();
    };
    return (column > 0 && differs(column - 1, row)) || (row > band.first && differs(column, row - 1));
  }

  // Light from the surroundings, and from one direction by the cosine to the normal, less what a shadow
  // takes.
  Colour lit(const ScreenTriangle& t, int column, int row, bool behind_fixed) const {
    Vec3 w = weights(t, column + 0.5, row + 0.5);
    const double nearness = w.x * t.nearness[0] + w.y * t.nearness[1] + w.z * t.nearness[2];
    // A linear function in the world is linear on the screen after division by the distance.
    if (!projection_.parallel())
      w = Vec3{w.x * t.nearness[0], w.y * t.nearness[1], w.z * t.nearness[2]} / nearness;
    Vec3 normal;
    for (int i = 0; i < 3; ++i)
      normal[i] = w.x * t.normal[0][i] + w.y * t.normal[1][i] + w.z * t.normal[2][i];
    normal = normalised(normal);
    const double direct = std::max(dot(normal, style_.light), 0.0);
    double missing = 0;
    if (direct > 0)
      missing = shadows_.missing(projection_.world(column + 0.5, row + 0.5, nearness), normal, behind_fixed);
    const double bright = style_.ambient + (brightest - style_.ambient) * direct * (1 - shade * missing);
    Colour out = scene_.instances[t.thing].colour;
    for (float& c : out) c = std::min(1.0f, static_cast<float>(c * bright));
    return out;
  }

  // Tiles alternate along both axes of the plane.
  bool dark_tile(const Plane& plane, const Vec3& point) const {
    const Vec3 local = rotate(conjugate(plane.at.rotation), point - plane.at.position);
    return std::fmod(std::abs(std::floor(local.x / style_.tile) + std::floor(local.y / style_.tile)), 2) > 0;
  }

  // Tiles fade with the square of the distance from the target, so that none is smaller than a pixel.
  double tile_brightness(const Plane& plane, const Vec3& point) const {
    const Vec3 away = point - view_.camera.target, along = away - dot(away, plane.normal) * plane.normal;
    return 1 - tile_shade * std::max(0.0, 1 - dot(along, along) / (tiled_ * tiled_));
  }

  // A plane has the colour of the floor where it lies as the ground does, and that share of it elsewhere.
  Colour floor(const Seen& s, int column, int row) const {
    const Plane& plane = planes_[-2 - s.fixed];
    const Vec3 point = projection_.world(column + 0.5, row + 0.5, s.nearness);
    const auto bright = [&](double cosine) {
      return style_.ambient + (brightest - style_.ambient) * std::max(cosine, 0.0);
    };
    const double tilt = std::min(1.0, bright(dot(plane.normal, style_.light)) / bright(style_.light.z));
    const double missing = shadows_.missing(point, plane.normal, true);
    const double tile = s.dark ? tile_brightness(plane, point) : 1;
    Colour out = style_.floor;
    for (float& c : out) c *= static_cast<float>(tilt * tile * (1 - floor_shade * missing));
    return out;
  }

  static Colour mixed(Colour a, const Colour& b, double share) {
    for (int k = 0; k < 3; ++k) a[k] += static_cast<float>(share) * (b[k] - a[k]);
    return a;
  }

  void report(const Band& band, const std::vector<Seen>& seen, int below, Picture& picture) const {
    for (int row = band.first + below; row < band.first + band.rows; ++row)
      for (int column = 0; column < band.width; ++column) {
        const Seen& s = seen[band.at(column, row)];
        const std::size_t at = static_cast<std::size_t>(row) * band.width + column;
        picture.labels[at] = s.first();
        picture.depths[at] = static_cast<float>(projection_.depth(s.nearness));
      }
  }

  const PictureScene& scene_;
  const PictureView& view_;
  const PictureStyle& style_;
  double tiled_;  // m
  Projection projection_;
  std::vector<ScreenTriangle> triangles_;
  Shadows shadows_;
  std::vector<Plane> planes_;
};

}  // namespace

Picture draw_picture(const PictureScene& scene, std::span<const Transform> bodies, const PictureView& view) {
  require(scene, bodies.size(), view.camera);
  return Painter(scene, bodies, view).draw();
}

}  // namespace amontons
