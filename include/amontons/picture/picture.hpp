#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "amontons/picture/scene.hpp"

// A picture by depth buffer on the processor: it needs no display and no driver, and is the same on every
// machine.
namespace amontons {

struct Picture {
  std::vector<std::uint8_t> colours;  // (height, width, 3), the highest row first
  // Per sample, the lowest row first: the nearest instance that is not clear, -1 for none, -2 - k for plane
  // k. Then its distance from the target towards the eye (m). Empty unless requested.
  std::vector<std::int32_t> labels;
  std::vector<float> depths;
};

// Viewed once, from one camera.
struct PictureView {
  PictureCamera camera;
  PictureStyle style;
  std::span<const PictureLine> lines;
  bool probe = false;    // fill the labels and the depths
  unsigned threads = 0;  // 0: one per core
};

// Draws instances at the poses of their bodies. Results do not depend on the number of threads. Throws
// InputError naming what is missing: a body, a surface, a vertex, or the pixels of the picture.
Picture draw_picture(const PictureScene& scene, std::span<const Transform> bodies, const PictureView& view);

}  // namespace amontons
