// Impulses of the last step on the contacts of this one.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/problem.hpp"

namespace amontons {

// The contacts of a problem that carry something in its solution x, as State::contacts holds them.
void keep_for_warm_start(const Problem& problem, std::span<const double> x, const BodyFrames& bodies,
                         std::vector<Contact>& kept);

// Appends the rows of all contacts to x0, zeros where the last step knew nothing: same geoms, nearest point.
// The impulses of `last` are scaled by the ratio of the steps.
void warm_start_contacts(const Model& model, const std::vector<Contact>& last, double scale,
                         const BodyFrames& bodies, const std::vector<Contact>& contacts,
                         std::vector<double>& x0);

// Tells compliant contacts what they carried in the last step, in the units of this one (Contact::held).
void hold_contacts(const Model& model, const std::vector<Contact>& last, double scale,
                   const BodyFrames& bodies, std::vector<Contact>& contacts);

}  // namespace amontons
