// Passes over large problems by so many threads (as in Options), with the bits of one.
#pragma once
#include <span>

namespace amontons {

struct ContactSystem;
struct Problem;

// A.product(x, y).
void product(const ContactSystem& A, std::span<const double> x, std::span<double> y, unsigned threads);
// Updates P and the graph after A, b and K were replaced in place: a problem that is made again in every step
// keeps its memory.
void renew(Problem& problem, unsigned threads);

}  // namespace amontons
