#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "amontons/base/math.hpp"

// Content and view of a picture: surfaces, instances of them, planes, lines, an eye. Lengths in m.
namespace amontons {

using Colour = std::array<float, 3>;  // red, green and blue from 0 to 1

// Triangles, counter-clockwise seen from outside, shared by any number of instances.
struct PictureSurface {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
  bool flat = true;    // flat faces; otherwise normals are means over the triangles at a vertex
  bool closed = true;  // seen from outside only; an open surface is seen from both sides
};

// How the picture shows an instance.
enum class Appearance : std::uint8_t {
  moving,  // opaque
  fixed,   // opaque, but moving instances may shine through (PictureStyle::glass)
  clear,   // blended with its background by its opacity
  hidden   // not drawn
};

struct PictureInstance {
  std::int32_t surface = 0;
  std::int32_t body = -1;  // -1: the world
  Transform at;            // pose in the frame of the body
  Vec3 scale{1, 1, 1};     // along the axes of the surface, positive
  Colour colour{1, 1, 1};
  float opacity = 1;
  Appearance appearance = Appearance::moving;
};

// The infinite plane z = 0 of a frame, seen from z > 0 only.
struct PicturePlane {
  std::int32_t body = -1;
  Transform at;
};

// Drawn over everything else, so that nothing covers it.
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
  Vec3 target;                                      // point in the middle of the picture
  double distance = std::numeric_limits<double>::infinity();  // distance of the eye from the target;
                                                              // infinite: parallel rays
  double pixel = 1e-2;                                        // size of a pixel at the target, m
  int width = 1, height = 1;                                  // pixels
  int samples = 2;                                            // per pixel in each direction
};

struct PictureStyle {
  Vec3 light{0, 0, 1};         // unit vector towards the light
  double ambient = 0.42;       // brightness without direct light
  double glass = 0.25;         // opacity of a fixed instance in front of a moving one; 1: opaque
  double fade = 0;             // share of white in everything except lines
  double tile = 0;             // side of the darker and lighter tiles on planes, m; 0: none
  Colour floor{1, 1, 1};       // of lit planes
  Colour background{1, 1, 1};  // colour of the background
};

}  // namespace amontons
