#pragma once
#include <functional>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"
#include "amontons/multibody/step/report.hpp"
#include "amontons/problem/problem.hpp"

namespace amontons {

struct ImpactOptions {
  double h;
  double threshold;                               // m/s, slower approaches do not bounce
  double tolerance;                               // of the solves
  std::function<Solution(const Problem&)> solve;  // within what is left of the step's budget
  std::function<const JointRows&()> joint_rows;   // called for when something bounces
};

// Impacts with restitution at the start of a step: turns the velocities v before them into those after, adds
// the impulses to the contacts and stores those of the locked directions of each joint, as State does. Adds
// the cost of its solves to the report, and their residual if it is worse. Returns whether anything bounced.
bool resolve_impacts(const std::vector<BodyFrame>& frames, const std::vector<BodyMobility>& mobility,
                     const ImpactOptions& options, std::vector<BodyVelocity>& v,
                     std::vector<Contact>& contacts, std::vector<JointWrench>& joints, Report& report);

}  // namespace amontons
