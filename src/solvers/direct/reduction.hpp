#pragma once
#include <span>
#include <vector>

#include "solvers/direct/island_blocks.hpp"
#include "solvers/direct/mechanism.hpp"
#include "solvers/direct/thin_matrix.hpp"

namespace amontons {

// The rest of a problem after its bilateral rows (f) are eliminated: the other rows (c) with the mobility of
// the constrained bodies, docs/algorithm.md (31),
//
//   u_c = W x_c + q,   W = D_c [K^-1]_vv D_c' + E_c,   q = b_c + D_c [K^-1 (0, -b_f)]_v,
//
// and their sets unchanged. Bilateral rows are equations, so they leave the VI exactly. W is block diagonal
// over islands: sets of bodies that bilateral and other rows connect.
//
// With K = L S L', Y = L^-1 (D_c', 0) and y = L^-1 (0, -b_f): W = Y'S Y + E_c, q = b_c + Y'S y. A column of Y
// is nonzero only on the path from its bodies to the root of the elimination tree. Columns are sorted by the
// place of their body, so that the columns through a node form a range, and all loops run along rows of it.
class Reduction {
 public:
  // One island: its sets, W (row-major; or thin, then W is empty), q and P in one order, and for each of its
  // rows the row of the problem.
  struct Island {
    SetProduct K;
    std::vector<double> W, q, P;
    ThinMatrix thin;
    std::vector<std::size_t> row;
    std::size_t rows() const { return row.size(); }
    double diagonal(std::size_t i) const { return thin.empty() ? W[(rows() + 1) * i] : thin.diagonal(i); }
    void clear();
    // Adds a set, its P and its rows of q = b; W is left to the caller.
    void add(const Problem& problem, const IslandBlock& b);
    // Given x and the u of the problem at x, moves q so that W x + q = u there.
    void shift(std::span<const double> x, std::span<const double> u);
  };

  // Finds the islands and analyses K. False where elimination does not apply: for a matrix or a function in
  // place of bodies. It does not apply either to an island of more than `most_rows` rows, or where K takes
  // much work.
  bool analyse(const Problem& problem, std::size_t most_rows);
  // W and q; false if K has no factorisation.
  bool factor(const Problem& problem);

  std::size_t islands() const { return count_; }
  Island& island(std::size_t i) { return islands_[i]; }
  const Mechanism& mechanism() const { return mechanism_; }
  // Multiplications of factor().
  double work() const;

  // Completes the x_c in x by x_f.
  void recover(std::span<double> x);
  // Corrects x_f for the remaining u = A x + b there; x_c stays.
  void correct(std::span<const double> u, std::span<double> x);

 private:
  static constexpr std::size_t width = QuasidefiniteFactor::width;
  // Columns [first, last) pass a node; its six rows of that length begin at `at`. Zeros pad the rows to whole
  // vectors, so that loops need no remainder.
  struct Range {
    std::size_t first, last, at;
    std::size_t size() const { return last - first; }
    std::size_t stride() const { return (size() + lanes - 1) / lanes * lanes; }
  };
  static constexpr std::size_t lanes = 8;  // not tuned: entries of a vector register

  bool find_islands(const Problem& problem, std::size_t most_rows);
  void fill_islands(const Problem& problem);
  void place_columns(const Problem& problem);
  void start_columns(const Problem& problem);
  void start_column(const Bodies& bodies, const JacobianRow& D, std::size_t column);
  void sweep();
  void add_products(std::size_t node, const Range& range);

  Mechanism mechanism_;
  std::vector<IslandBlock> rest_;  // their places: the first of the places of their bodies in the order of K
  std::size_t count_ = 0;
  std::vector<Island> islands_;
  // Columns of Y: the first of each island. Nodes: range and island.
  std::vector<std::size_t> first_column_;
  std::vector<Range> range_;
  std::vector<Index> island_of_node_;
  std::vector<double> Y_, y_, z_;
};

}  // namespace amontons
