#pragma once
#include <cmath>
#include <span>
#include <vector>

#include "amontons/picture/scene.hpp"

// From the world to samples of the picture.
namespace amontons {

// Each layer of a picture has a depth buffer: see Appearance; lines are over all.
enum class Layer : std::uint8_t { moving, fixed, clear, over };
inline constexpr int layers = 4;

// Nearness of an infinite plane, which is affine over the screen: at + across column + up row.
struct SeenPlane {
  double at, across, up;
  double least, most;  // range of nearness; outside it the plane is behind the eye, or too near to it

  double nearness(double column, double row) const {
    const double here = at + across * column + up * row;
    return here <= least || here > most ? -std::numeric_limits<double>::infinity() : here;
  }
};

// A camera in units of samples. Nearness grows towards the eye and is affine over the screen of any plane. It
// is the distance z from the target with parallel rays, and d / (d - z) for an eye at distance d, which is
// also the scale there.
class Projection {
 public:
  explicit Projection(const PictureCamera& camera);

  int width() const { return width_; }
  int height() const { return height_; }
  bool parallel() const { return parallel_; }
  // Coordinates along right, up and eye, from the target (m).
  Vec3 view(const Vec3& world) const {
    const Vec3 v = world - camera_.target;
    return {dot(v, camera_.right), dot(v, camera_.up), dot(v, camera_.eye)};
  }
  // A vector of the view in the world.
  Vec3 turned(const Vec3& v) const { return v.x * camera_.right + v.y * camera_.up + v.z * camera_.eye; }
  // Column and row of samples, including fractions, and nearness.
  Vec3 screen(const Vec3& view) const {
    const double scale = parallel_ ? 1 : camera_.distance / (camera_.distance - view.z);
    return {view.x * scale / sample_ + 0.5 * width_, view.y * scale / sample_ + 0.5 * height_,
            parallel_ ? view.z : scale};
  }
  double depth(double nearness) const {
    return parallel_ ? nearness : camera_.distance - camera_.distance / nearness;
  }
  Vec3 world(double column, double row, double nearness) const;
  // The plane through `point` with this normal, seen from its front.
  SeenPlane plane(const Vec3& point, const Vec3& normal) const;
  // Parts nearer to the eye than this (m, from the target) are clipped.
  double nearest() const;

 private:
  PictureCamera camera_;
  double sample_;
  int width_, height_;
  bool parallel_;
};

struct ScreenTriangle {
  double x[3], y[3];  // samples, multiples of 2^-8; counter-clockwise
  double nearness[3];
  float normal[3][3];  // unit vectors of the world at the corners
  std::int32_t thing;  // index of the instance or the line
  Layer layer;
  double area;  // twice the area (samples)
};

// The possibly visible triangles of all instances and lines.
std::vector<ScreenTriangle> project(const PictureScene& scene, std::span<const Transform> bodies,
                                    std::span<const PictureLine> lines, const Projection& to);

}  // namespace amontons
