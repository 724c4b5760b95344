#pragma once
#include <utility>
#include <vector>

#include "amontons/multibody/model/state.hpp"

namespace amontons {

// The pairs of geoms that may touch and overlap by more than `depth` (m), first < second, in order.
std::vector<std::pair<Index, Index>> overlapping_geoms(const Model& model, const State& state, double depth);

}  // namespace amontons
