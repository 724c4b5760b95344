#pragma once
#include "amontons/base/math.hpp"

namespace amontons {

// The mean angular velocity of a torque-free rotation over h: the body turns by exp(h mean). Body axes.
Vec3 torque_free_mean(const Mat3& inertia, const Vec3& omega, double h);

}  // namespace amontons
