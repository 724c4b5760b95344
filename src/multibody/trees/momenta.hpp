// Momenta of the bodies of trees over a displacement.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/joints/rows.hpp"
#include "multibody/trees/tree_step.hpp"

namespace amontons {

// The flow of a body of the model with the velocity v, at a reference point. The world has none. A driven
// body has that of its given velocity, whose centre of mass moves straight.
Flow flow_of(const BodyFrames& frames, const BodyVelocities& v, Index body, const Vec3& reference);

// in.memory.flow from rates; a tree on a driven body begins with the flow of that body, of the velocities v.
void make_flows(const TreeSetting& in, const BodyFrames& frames, const BodyVelocities& v,
                std::span<const double> rates, const TreeStep& trees);

// The momentum of each body, as a wrench about the reference, while its coordinates move with the rates for
// h; h < 0: while they came. It belongs to the displacement of the centre of mass and to the rotation over h.
// The inertia is that in the middle, R I R' with R half of the rotation.
void make_momenta(const TreeSetting& in, std::span<const double> rates, double h, const TreeStep& trees,
                  std::vector<Flow>& momenta);

// The same of rates so slow that the displacement over a step is that of the velocity.
void make_slow_momenta(const TreeSetting& in, std::span<const double> rates, const TreeStep& trees,
                       std::vector<Flow>& momenta);

// Mean velocities of the bodies of trees over the last displacement, over h; those of other bodies stay.
void write_mean_before(const TreeSetting& in, double h, const TreeStep& trees, BodyVelocities& mean);

// Poses and velocities of the bodies of trees at the start of the last displacement, over h.
void change_past(const TreeSetting& in, const TreeStep& trees, std::vector<Past>& past);

// Inertias that stand for the stiffness of light links resist the change of rates since the start.
void subtract_stiffness(const TreeSetting& in, std::span<const double> rates, const TreeStep& trees,
                        std::vector<Flow>& impulses);

}  // namespace amontons
