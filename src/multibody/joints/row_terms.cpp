#include "multibody/joints/row_terms.hpp"

#include <algorithm>
#include <cmath>

#include "multibody/bodies/row_products.hpp"

namespace amontons {

double regularisation(const JacobianRow& row, const StepBodies& bodies) {
  return locked_regularisation * inverse_effective_mass(row, bodies.mobility);
}

double recovery(double error, const JointOptions& options) {
  return std::clamp(error / options.h, -options.recovery_speed, options.recovery_speed);
}

double closing(double gap, const JointOptions& options) {
  return std::max(gap / options.h, -options.recovery_speed);
}

bool within_reach(const JacobianRow& row, const StepBodies& bodies, double gap, double motor_speed,
                  const JointOptions& options) {
  const double speed = std::max(
      {std::abs(row_velocity(row, bodies.start)), std::abs(row_velocity(row, bodies.free)), motor_speed});
  return gap <= 2 * options.h * speed + 0.1 * options.length;
}

void add_interval(JointRows& rows, double bound) {
  if (bound == infinity)
    rows.cones.append(Free{});
  else
    rows.cones.append(Interval{-bound, bound});
}

}  // namespace amontons
