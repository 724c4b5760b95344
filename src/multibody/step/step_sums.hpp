#pragma once
#include <cstddef>

#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// The solves of a step so far: of positions, impacts, and of the step itself.
struct StepSums {
  unsigned solves = 0;  // calls of a solver
  std::size_t iterations = 0, products = 0, factorizations = 0;
  Status status = Status::converged;  // of the first that missed its tolerance; positions do not count
  void add_cost(const Solution& solution) {
    iterations += solution.iterations;
    products += solution.products;
    factorizations += solution.factorizations;
  }
  void add_status(Status next) {
    if (status == Status::converged) status = next;
  }
};

}  // namespace amontons
