#pragma once
#include "multibody/joints/wide_rows.hpp"

namespace amontons {

// Its length and the row of its rate.
Line tendon_line(const Model& model, const BodyFrames& bodies, std::span<const JointContext> joints,
                 const State& state, Index tendon);
// The same outside a step, where the joints are not placed yet.
Line tendon_line(const Model& model, const BodyFrames& bodies, const State& state, Index tendon);

double tendon_length(const Model& model, const BodyFrames& bodies, const State& state, Index tendon);

// Drives, springs, friction and limits of tendons, and the actuators on them.
void append_tendon_rows(const RowInput& in, JointRows& rows);

// The factor of a tendon's rows, which makes them velocities in m/s.
double tendon_scale(const Model& model, Index tendon);

// Excess of a length over its rest lengths, > 0 if it is too long.
double tendon_stretch(const Tendon& tendon, double length);

}  // namespace amontons
