#pragma once
#include <cstddef>
#include <span>

namespace amontons {

struct ContactSystem;

// Entries of diag(A) where bodies are free. Those of one contact, one per row.
void contact_diagonal(const ContactSystem& A, std::size_t contact, double* d);
// Their mean, to rounding: of three rows the basis does not matter.
double mean_diagonal(const ContactSystem& A, std::size_t contact);
// The entries of the stored rows.
void row_diagonal(const ContactSystem& A, std::span<double> d);

}  // namespace amontons
