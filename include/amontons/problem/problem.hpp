#pragma once
#include <vector>

#include "amontons/problem/contact_graph.hpp"
#include "amontons/problem/operators.hpp"
#include "amontons/sets/product.hpp"

namespace amontons {

// The friction law. associated: find x in K with -(A x + b) in N_K(x), the optimality condition of min 1/2
// x'Ax + b'x over K. coulomb: the same with b_n replaced by b_n + s(u(x)) for every contact, s the De Saxce
// term of its set (mu |u_t|; De Saxce 1992). This is Coulomb's law: sliding contacts do not separate.
enum class Law : unsigned char { associated, coulomb };

// The variational inequality: find x in K with <g(x), y - x> >= 0 for all y in K, g = A x + b (+ the De
// Saxce term under coulomb). x: impulses (N s), b: constraint velocities without impulses (m/s).
//
// A problem is constant. It owns A, or views it and keeps it alive (operators.hpp), so that it can be passed
// on, solved by several methods and written to a file.
struct Problem {
  Operator A;
  std::vector<double> b;
  SetProduct K;
  // The diagonal preconditioner: per block the mean of diag(A) over the rows of the block, so that Pi_K in
  // the P metric is the Euclidean projection. Always positive.
  std::vector<double> P;
  ContactGraph graph;  // empty for matrices and functions
  // The law of the problem, by default the law of the simulation that made it. Options of a solve may name
  // another one. Without friction both laws agree.
  Law law = Law::coulomb;

  std::size_t rows() const { return b.size(); }
};

// Makes the problem of a user: checks sizes, finiteness, the sign of the diagonal and (for matrices)
// symmetry. Throws InputError naming the error.
Problem make_problem(Operator A, std::vector<double> b, SetProduct K, Law law = Law::coulomb);
// The same for data that are already checked or made by the library: without checks.
Problem trusted_problem(Operator A, std::vector<double> b, SetProduct K, Law law = Law::coulomb);
// Whether bodies move in coordinates of joints. Then rows of D and inverse masses are not all of A.
bool has_trees(const Problem& problem);
// The same problem with A as a matrix, for what reads rows and masses: Gauss-Seidel, solvers of users, files.
Problem as_matrix(const Problem& problem);

// u plus the De Saxce term: the vector that the VI requires to be in the normal cone. g may be u.
template <class S>
inline void add_de_saxce_term(const S& set, Law law, const double* u, double* g) {
  double term = 0;
  if constexpr (S::frictional)
    if (law == Law::coulomb) term = set.de_saxce(u);
  for (int k = 0; k < S::dim; ++k) g[k] = u[k];
  g[0] += term;
}

}  // namespace amontons
