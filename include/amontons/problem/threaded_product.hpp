#pragma once
#include <span>

namespace amontons {

struct ContactSystem;

// y = A x, with the bits of A.product(), by so many threads (as in Options) if A is large.
void product(const ContactSystem& A, std::span<const double> x, std::span<double> y, unsigned threads);

}  // namespace amontons
