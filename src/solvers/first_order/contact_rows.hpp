// Private: contacts that are given as rows of D, as files have them.
#pragma once
#include "amontons/problem/problem.hpp"
#include "solvers/first_order/pass_data.hpp"

namespace amontons {

// Whether the first blocks are contacts, given as rows of D that act on two bodies with opposite forces. Not
// asked of a problem that has contacts of another form.
bool has_contact_rows(const Problem& problem, const ContactSystem& A);
// E of a contact of either form, the same in its three rows.
double compliance_of(const ContactSystem& A, std::size_t contact);
// The three rows of a contact, in a lane.
void fill_rows(const JacobianRow* row, std::size_t lane, ContactRows& rows);

}  // namespace amontons
