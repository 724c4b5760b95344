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
//   u_c = W x_c + q,   W = Y_c [K^-1]_vv Y_c' + E_c,   q = b_c + Y_c [K^-1 (0, -b_f)]_v,   Y_c = D_c C,
//
// and their sets unchanged. Bilateral rows are equations, so they leave the VI exactly. W is block diagonal
// over islands: sets of bodies that trees, bilateral and other rows connect.
//
// With K = L S L', Z = L^-1 (Y_c', 0) and z = L^-1 (0, -b_f): W = Z'S Z + E_c, q = b_c + Z'S z. A column of Z
// is nonzero only on the paths from its nodes to the root of the elimination tree. Columns are sorted by the
// place of their body, so that the columns through a node form a range, and all loops run along rows of it.
//
// An island with few coordinates and many rows keeps W in factors (ThinMatrix). Its columns are those of its
// coordinates in place of its rows, and Z'S Z = Q.
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
  // place of bodies. It does not apply either to an island whose matrix has more than `most_rows` rows, or
  // where K takes much work.
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

  void find_islands(const Problem& problem);
  void fill_islands(const Problem& problem);
  void find_used(const Problem& problem, std::size_t island);
  void place_columns(const Problem& problem);
  void start_columns(const Problem& problem);
  void sweep();
  void add_products(std::size_t node, const Range& range);
  void finish_islands();

  Mechanism mechanism_;
  std::vector<IslandBlock> rest_;  // their places: the first of the places of their bodies in the order of K
  std::size_t count_ = 0;
  std::vector<Island> islands_;
  // Per island: its first block, and its first column. It has none if W is in factors and no row bilateral.
  // Beside trees also the places of its coordinates in Z: six per node, in the order of K.
  std::vector<std::size_t> first_block_, first_column_;
  std::vector<std::vector<std::size_t>> used_;
  std::vector<Index> compact_;  // per place in Z: its number among those of the present island, -1 elsewhere
  // Nodes: range and island.
  std::vector<Range> range_;
  std::vector<std::size_t> row_;  // per place: where its row of Z would begin, if it had all columns
  std::vector<Index> island_of_node_;
  std::vector<double> Z_, z_, sums_, solution_;
};

}  // namespace amontons
