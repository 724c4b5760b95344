// Passes over large problems by so many threads (as in Options), with the bits of one.
#pragma once
#include <span>

namespace amontons {

struct ContactSystem;
struct Problem;

// A.product(x, y), A.diagonal(d) and renew(problem).
void product(const ContactSystem& A, std::span<const double> x, std::span<double> y, unsigned threads);
void diagonal(const ContactSystem& A, std::span<double> d, unsigned threads);
void renew(Problem& problem, unsigned threads);

}  // namespace amontons
