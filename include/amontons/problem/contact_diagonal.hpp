#pragma once
#include <cstddef>

namespace amontons {

struct ContactSystem;

// The entries of diag(A) for one contact, one per row, where its bodies are free.
void contact_diagonal(const ContactSystem& A, std::size_t contact, double* d);

}  // namespace amontons
