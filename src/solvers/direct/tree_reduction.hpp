#pragma once
#include <vector>

#include "amontons/problem/linkage.hpp"
#include "solvers/direct/reduction.hpp"

namespace amontons {

// The islands of a problem whose bodies belong to trees or are free:
//
//   u = A x + b,   A = D M^-1 D' + E = Y'Y + E,   Y = M^-1/2 D'
//
// with M^-1/2 = D^-1/2 L^-T J' on trees. An island is a set of trees and free bodies that rows connect. A
// column of Y is nonzero only on the way from its bodies to the root. Bilateral rows (f: loops, couplings,
// servos) leave the other rows (c) as in Reduction, here by Cholesky's method on the rows of f:
//
//   A_ff = U'U,   (Z y) = U^-T (A_fc b_f),   W = A_cc - Z'Z,   q = b_c - Z'y,   U x_f = -(y + Z x_c).
class TreeReduction {
 public:
  // False where it does not apply: the problem has no linkage, or an island has more than `most_rows`
  // bilateral rows, or more than so many other rows and coordinates.
  bool analyse(const Problem& problem, std::size_t most_rows);
  void factor(const Problem& problem);

  std::size_t islands() const { return count_; }
  Reduction::Island& island(std::size_t i) { return islands_[i]; }
  // Completes the x_c in x by x_f.
  void recover(std::span<double> x);
  // Corrects x_f for the remaining u = A x + b there; x_c stays.
  void correct(std::span<const double> u, std::span<double> x);
  // Multiplications of factor().
  double work() const { return work_; }

 private:
  static constexpr std::size_t lanes = 8;  // not tuned: entries of a vector register
  static constexpr std::size_t group = 6;  // not tuned: rows of a kernel
  // The bilateral rows of an island: numbers in the problem; (U Z y) or, beside a thin W, (U V y) by rows,
  // `stride` apart.
  struct Held {
    std::vector<std::size_t> row;
    std::vector<double> factor;
    std::size_t stride = 0;
  };

  bool all_small(const Problem& problem, std::size_t most_rows);
  bool is_free(Index body) const { return body >= 0 && free_number_[body] >= 0; }
  std::size_t first_of_free(Index body) const {
    return trees_->coordinates() + 6 * static_cast<std::size_t>(free_number_[body]);
  }
  // An island has the blocks [first, last).
  void fill_island(const Problem& problem, std::size_t island, std::size_t first, std::size_t last);
  void find_used(const Problem& problem, std::size_t first, std::size_t last);
  template <class Begin, class Put>
  void visit_rows(const Problem& problem, std::size_t first, std::size_t last, const Begin& begin,
                  const Put& put) const;
  void fill_matrix(const Problem& problem, Held& held, Reduction::Island& island, std::size_t first,
                   std::size_t last);
  void fill_dense(const Problem& problem, Held& held, std::vector<double>& W, std::size_t c,
                  std::size_t first, std::size_t last);
  void fill_thin(const Problem& problem, Held& held, ThinMatrix& W, std::size_t c, std::size_t first,
                 std::size_t last);
  void take_held(const Held& held, Reduction::Island& island);
  void factor_held(Held& held, std::size_t width);
  template <class Put>
  void put_free(const Bodies& bodies, const JacobianRow& row, const Put& put) const;
  template <class Put>
  void put_free(const Bodies& bodies, Index body, const std::array<double, 6>& j, const Put& put) const;

  const Linkage* trees_ = nullptr;
  std::vector<Index> free_number_;  // per body: its number among free bodies that move, else -1
  std::size_t free_count_ = 0;
  // Their places: the last coordinate that moves one of their bodies; free bodies come after trees.
  std::vector<IslandBlock> blocks_;
  std::size_t count_ = 0;
  std::vector<Reduction::Island> islands_;
  std::vector<Held> held_;
  // Per row of the present island its place among the rows of c: -1 - place if it is in f.
  std::vector<std::ptrdiff_t> row_;
  std::vector<std::size_t> used_;  // coordinates that rows of this island reach, ascending
  std::vector<Index> compact_;     // per coordinate, then six per free body: its place in used_, -1 elsewhere
  std::vector<double> Y_, work_row_, pivot_;
  double work_ = 0;
};

}  // namespace amontons
