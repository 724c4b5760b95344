#pragma once
#include <span>

#include "amontons/collision/rays/ray.hpp"
#include "amontons/multibody/model/state.hpp"

namespace amontons {

// What a ray meets first among the geoms of a model.
struct GeomHit {
  RayHit hit;
  Index geom = -1;
};

// The ray is in the world. `excluded`: one entry per geom, not zero where the ray passes through it.
GeomHit cast_ray(const Model& model, const State& state, const Ray& ray,
                 std::span<const unsigned char> excluded);

}  // namespace amontons
