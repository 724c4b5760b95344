#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "amontons/picture/scene.hpp"

// A picture by depth buffer on the processor: it needs no display and no driver, and is the same everywhere.
namespace amontons {

struct Picture {
  std::vector<std::uint8_t> colours;  // (height, width, 3), the highest row first
  // Of each sample, the lowest row first: the instance seen first that is not clear, -1 for none, -2 - k for
  // plane k; and how far it is from the target towards the eye (m). Empty unless asked for.
  std::vector<std::int32_t> labels;
  std::vector<float> depths;
};

// Instances at the poses of their bodies. Results do not depend on the number of threads (0: one per core).
// Throws InputError naming what is not there: a body, a surface, a vertex, or a picture without pixels.
Picture draw_picture(const PictureScene& scene, std::span<const Transform> bodies,
                     const PictureCamera& camera, const PictureStyle& style,
                     std::span<const PictureLine> lines, bool probe, unsigned threads);

}  // namespace amontons
