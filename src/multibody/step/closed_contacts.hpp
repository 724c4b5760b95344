// What a step asks of contacts that are closed, or nearly.
#pragma once
#include <vector>

#include "amontons/multibody/model/model.hpp"
#include "multibody/step/assemble.hpp"

namespace amontons {

// The assembly of a step of length h with these contacts and so many joint rows, solved to the tolerance.
// recovery (m/s): at which velocities take back errors. keeps_closed: whether closed contacts are kept from
// opening by a velocity.
Assembly assembly_of_step(const Model& model, const std::vector<Contact>& contacts, std::size_t joint_rows,
                          double h, double recovery, bool keeps_closed, double tolerance);

}  // namespace amontons
