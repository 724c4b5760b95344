// Demands of a step on closed and nearly closed contacts.
#pragma once
#include <vector>

#include "amontons/multibody/model/model.hpp"
#include "multibody/step/assemble.hpp"

namespace amontons {

// Assembly parameters of a step of length h with these contacts and `joint_rows` rows, solved to the
// tolerance. recovery (m/s): speed of the correction of errors by velocities. keeps_closed: a velocity keeps
// closed contacts from opening.
Assembly assembly_of_step(const Model& model, const std::vector<Contact>& contacts, std::size_t joint_rows,
                          double h, double recovery, bool keeps_closed, double tolerance);

}  // namespace amontons
