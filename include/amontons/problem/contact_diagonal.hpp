#pragma once
#include <cstddef>

#include "amontons/problem/contact_system.hpp"

namespace amontons {

// The entries of diag(A) for one contact, one per row, where its bodies are free.
void contact_diagonal(const ContactSystem& A, std::size_t contact, double* d);

}  // namespace amontons
