// Passes over large problems by so many threads (as in Options), with the bits of one.
#pragma once
#include <span>

namespace amontons {

struct ContactSystem;
struct Problem;

// A.product(x, y) and renew(problem).
void product(const ContactSystem& A, std::span<const double> x, std::span<double> y, unsigned threads);
void renew(Problem& problem, unsigned threads);

}  // namespace amontons
