#pragma once
#include "multibody/joints/row_terms.hpp"

namespace amontons {

// The contacts of a journal in its bearing, or of a slider in its guide.
void append_clearance_rows(const RowInput& in, const JointContext& joint, JointRows& rows);

}  // namespace amontons
