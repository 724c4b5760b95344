// Private: contacts that are given as rows of D, as in files.
#pragma once
#include "amontons/problem/problem.hpp"
#include "solvers/first_order/pass_data.hpp"

namespace amontons {

// Whether the first blocks are contacts, given as rows of D that act on two bodies with opposite forces. Only
// for problems without contacts of another form.
bool has_contact_rows(const Problem& problem, const ContactSystem& A);
// Compliance E of a contact of either form, equal in its three rows.
double compliance_of(const ContactSystem& A, std::size_t contact);
// Writes the three rows of a contact to a lane.
void fill_rows(const JacobianRow* row, std::size_t lane, ContactRows& rows);

// Largest friction coefficient: beyond it the cone is a half-space in double precision, and its cube times
// 1e150 would overflow.
inline constexpr double largest_mu = 1e50;
// The single rows in order, as intervals: free and nonnegative rows have infinite bounds.
std::vector<Interval> row_bounds(const SetProduct& K);

}  // namespace amontons
