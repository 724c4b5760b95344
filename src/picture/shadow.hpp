#pragma once
#include <span>
#include <vector>

#include "picture/projection.hpp"

// The picture from the light, and so the parts in shadow.
namespace amontons {

class Shadows {
 public:
  // Contains everything that may cast a shadow into the picture; texels: size of the light's own picture.
  Shadows(const PictureScene& scene, std::span<const Transform> bodies, const Projection& picture,
          const Vec3& light, int texels, unsigned threads);

  // The share of the light, from 0 to 1, that a shadow removes at a point of a surface with this normal,
  // softened over 3 x 3 texels. behind_fixed: whether fixed things cast a shadow on it.
  double missing(const Vec3& point, const Vec3& normal, bool behind_fixed) const;

 private:
  struct Map {
    std::vector<float> depth;   // (rows, columns)
    std::vector<float> blocks;  // the largest depth of a block of texels and those around it
  };
  double missing(const Map& map, const Vec3& seen, double depth) const;
  void find_blocks(Map& map) const;

  PictureCamera camera_;
  Projection projection_;
  Vec3 light_;
  Map maps_[2];  // of moving things, of fixed things
  int columns_ = 0, rows_ = 0;
  bool empty_ = true;
};

}  // namespace amontons
