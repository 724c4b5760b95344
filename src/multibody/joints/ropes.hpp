#pragma once
#include "multibody/joints/course.hpp"

// Tendons that rub: ropes over pulleys and through eyes, and belts.
namespace amontons {

// The rows of all places at which one tendon rubs; `first` is the number of its first rub in the state.
void append_rope_rows(const RowInput& in, Index tendon, std::size_t first, JointRows& rows);

}  // namespace amontons
