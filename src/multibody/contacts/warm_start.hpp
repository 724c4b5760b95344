// Uses impulses of the last step for the contacts of this one.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/model/state.hpp"
#include "amontons/problem/problem.hpp"

namespace amontons {

// The contacts with an impulse in the solution x of a problem, in the form of State::contacts.
// `solved`: the contacts with the results of the step, which supply slip and state. A slip up to `least`
// (m/s) is an error of the solve: contacts that share their friction may be at their limit and stick.
// `same`: per contact the number in `kept`, on entry, of the one whose impulse it keeps to the bit; -1: none.
void keep_for_warm_start(const Problem& problem, std::span<const double> x,
                         const std::vector<Contact>& solved, std::span<const Index> same, double least,
                         const BodyFrames& bodies, unsigned threads, std::vector<CarriedContact>& kept);

// The contact of the last step that each contact continues, by its number there: same geoms, nearest point.
// -1: none, it had no impulse.
void find_known(const Model& model, const std::vector<CarriedContact>& last, const BodyFrames& bodies,
                const std::vector<Contact>& contacts, std::vector<Index>& known);

// Sets the friction of contacts that slipped in the last step, and whose static and kinetic coefficients
// differ. The others keep the static one, with which they are found.
void set_slipping_friction(const Model& model, const std::vector<CarriedContact>& last,
                           std::span<const Index> known, std::vector<Contact>& contacts);

// Appends the rows of all contacts to x0, zeros for those that are not known. The impulses of `last` are
// scaled by the ratio of the steps.
void warm_start_contacts(const std::vector<CarriedContact>& last, std::span<const Index> known, double scale,
                         const std::vector<Contact>& contacts, std::vector<double>& x0);

// Stores in compliant contacts their impulses of the last step, in the units of this one (Contact::held).
void hold_contacts(const std::vector<CarriedContact>& last, std::span<const Index> known, double scale,
                   std::vector<Contact>& contacts);

}  // namespace amontons
