#pragma once
#include <vector>

#include "amontons/problem/operators.hpp"
#include "amontons/sets/product.hpp"

namespace amontons {

// The friction law. associated: find x in K with -(A x + b) in N_K(x), the optimality condition of
// min 1/2 x'Ax + b'x over K. coulomb: the same with b_n replaced by b_n + mu |u_t(x)| for every contact (De
// Saxce 1992), which is Coulomb's law: sliding contacts do not separate.
enum class Law : unsigned char { associated, coulomb };

// The variational inequality. x: impulses (N s), b: constraint velocities without impulses (m/s).
struct Problem {
  Operator A;
  std::vector<double> b;
  SetProduct K;
  // The diagonal preconditioner: per block the mean of diag(A) over the rows of the block, so that Pi_K in
  // the P metric is the Euclidean projection. Always positive.
  std::vector<double> P;

  std::size_t rows() const { return b.size(); }
};

// Checks sizes, finiteness, the sign of the diagonal and (for matrices) symmetry, then computes P. Throws
// InputError naming the thing that is wrong.
Problem make_problem(Operator A, std::vector<double> b, SetProduct K);

// u plus the De Saxce term: what the VI of the law asks to be in the normal cone. g may be u.
template <class Set>
inline void add_saxce_term(const Set& set, Law law, const double* u, double* g) {
  for (int k = 0; k < Set::dim; ++k) g[k] = u[k];
  if constexpr (Set::dim == 3) {
    if (law == Law::coulomb) g[0] += set.mu * std::sqrt(u[1] * u[1] + u[2] * u[2]);
  }
}

}  // namespace amontons
