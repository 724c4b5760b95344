#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// "interior-point": the central path, then newton and p-spg-fb for the last digits. One factorisation per
// step, ten to thirty steps. The most accurate method, and the method for hyperstatic stacks. InputError for
// a function.
Solution interior_point(const Problem&, const Options&, Budget&);
// The path alone, without that crossover: a phase of other tables.
Solution central_path(const Problem&, const Options&, Budget&);
std::unique_ptr<Run> start_central_path(const Problem&, const Options&, Budget&);
// The same with the De Saxce term held in each step.
std::unique_ptr<Run> start_path_of_frozen_terms(const Problem&, const Options&, Budget&);

}  // namespace amontons
