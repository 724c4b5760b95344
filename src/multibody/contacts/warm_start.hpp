// Uses impulses of the last step for the contacts of this one.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/problem.hpp"

namespace amontons {

// The contacts with an impulse in the solution x of a problem, in the form of State::contacts.
void keep_for_warm_start(const Problem& problem, std::span<const double> x, const BodyFrames& bodies,
                         std::vector<Contact>& kept);

// Appends the rows of all contacts to x0, zeros without a match in the last step: same geoms, nearest point.
// The impulses of `last` are scaled by the ratio of the steps.
void warm_start_contacts(const Model& model, const std::vector<Contact>& last, double scale,
                         const BodyFrames& bodies, const std::vector<Contact>& contacts,
                         std::vector<double>& x0);

// Stores in compliant contacts their impulses of the last step, in the units of this one (Contact::held).
void hold_contacts(const Model& model, const std::vector<Contact>& last, double scale,
                   const BodyFrames& bodies, std::vector<Contact>& contacts);

}  // namespace amontons
