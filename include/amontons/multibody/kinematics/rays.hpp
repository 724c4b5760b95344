#pragma once
#include <span>

#include "amontons/collision/rays/ray.hpp"
#include "amontons/multibody/model/state.hpp"

namespace amontons {

// The first hit of a ray among the geoms of a model.
struct GeomHit {
  RayHit hit;
  Index geom = -1;
};

// The ray is in world axes. `excluded`: one entry per geom, nonzero if the ray passes through it.
GeomHit cast_ray(const Model& model, const State& state, const Ray& ray,
                 std::span<const unsigned char> excluded);

}  // namespace amontons
