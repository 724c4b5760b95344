#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "amontons/base/math.hpp"

// What a picture shows and from where: surfaces, instances of them, planes, lines, an eye. Lengths in m.
namespace amontons {

using Colour = std::array<float, 3>;  // red, green and blue from 0 to 1

// Triangles, counter-clockwise seen from outside, which many instances share.
struct PictureSurface {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
  bool flat = true;    // faces are flat; else normals are means over the triangles that share a vertex
  bool closed = true;  // seen from outside only; what may be open is seen from both sides
};

// What the picture does with an instance.
enum class Appearance : std::uint8_t {
  moving,  // covers what is behind it
  fixed,   // the same, but what moves may be seen through it (PictureStyle::glass)
  clear,   // is mixed with what is behind it, by its opacity
  hidden   // is left out
};

struct PictureInstance {
  std::int32_t surface = 0;
  std::int32_t body = -1;  // -1: the world
  Transform at;            // in the frame of the body
  Vec3 scale{1, 1, 1};     // along the axes of the surface, positive
  Colour colour{1, 1, 1};
  float opacity = 1;
  Appearance appearance = Appearance::moving;
};

// The plane z = 0 of a frame, without an end, seen from z > 0 only.
struct PicturePlane {
  std::int32_t body = -1;
  Transform at;
};

// Drawn over everything else, so that nothing hides it.
struct PictureLine {
  Vec3 from, to;
  double width = 0;  // m
  Colour colour{};
};

struct PictureScene {
  std::vector<PictureSurface> surfaces;
  std::vector<PictureInstance> instances;
  std::vector<PicturePlane> planes;
};

// Axes of the picture and the window that it shows at the target.
struct PictureCamera {
  Vec3 right{1, 0, 0}, up{0, 0, 1}, eye{0, -1, 0};  // unit vectors; eye: from the target towards the eye
  Vec3 target;                                      // what is in the middle
  double distance =
      std::numeric_limits<double>::infinity();  // of the eye from the target; infinite: parallel rays
  double pixel = 1e-2;                          // m at the target
  int width = 1, height = 1;                    // pixels
  int samples = 2;                              // per pixel in each direction
};

struct PictureStyle {
  Vec3 light{0, 0, 1};      // unit vector towards the light
  double ambient = 0.42;    // brightness of what the light does not reach
  double glass = 0.25;      // opacity of what is fixed where something that moves is behind it; 1: hides it
  double fade = 0;          // share of white in everything but lines
  Colour floor{1, 1, 1};    // of planes in the light
  Colour nothing{1, 1, 1};  // where the picture shows nothing
};

}  // namespace amontons
