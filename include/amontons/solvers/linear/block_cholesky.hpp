#pragma once
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "amontons/base/math.hpp"

namespace amontons {

// Multifrontal Cholesky factorisation L L' of a symmetric positive definite matrix given in blocks. These are
// bodies of 6 rows in body space, cones of 1 to 6 rows in impulse space, or one block for a dense matrix. The
// order is found once per pattern (approximate minimum degree or nested dissection of the graph of blocks).
// factor() then runs on dense fronts only. Sources: Duff, Reid 1983; Liu, "The multifrontal method for sparse
// matrix solution", SIAM Review 1992. The code is our own because no permissive library offers the method;
// ARCHITECTURE.md gives the reasons and the measured ratio.
//
// For unsymmetric values on that pattern it is L U: twice the work and memory, the same order, no exchange of
// rows.
//
// Use: the constructor analyses the pattern; slot() returns the place of a block, once. Then, whenever the
// values change: set_zero(), add the blocks to panels(), factor(), and any number of solve().
class BlockCholesky {
 public:
  BlockCholesky() = default;
  // sizes[i]: rows of block i. edges: pairs i != j of coupled blocks, in any order, duplicates allowed.
  // positions: one point per block (m), or empty; they only serve the elimination order.
  BlockCholesky(std::span<const int> sizes, std::span<const std::pair<int, int>> edges,
                std::span<const Vec3> positions = {});

  // Place of block (i, j): column-major at panels()[offset] with leading dimension `stride`. If `transposed`
  // is set, the place holds block (j, i). Only the lower triangle of a diagonal block is read. Seven
  // doubles past the end of panels() may be written. Without symmetry panels(Side::upper) has the same layout
  // and holds the transpose of the matrix; the place of a diagonal block holds its transpose.
  struct Slot {
    std::size_t offset;
    int stride;
    bool transposed;
  };
  Slot slot(int i, int j) const;
  enum Side : unsigned char { lower, upper };
  std::span<double> panels(Side side = lower) { return sides_[side].panels; }
  // Clears the panels and sets whether the next matrix is symmetric. Checks the Budget as factor() does: a
  // matrix that cannot be factored in time need not be assembled.
  void set_zero(bool symmetric = true);

  // Factors the assembled matrix in place. A pivot that rounding made non-positive is replaced by a huge one,
  // which removes its direction from the solution; returns the number of such pivots. Checks the Budget of
  // the thread before it begins, by its own estimate of the time, and while it runs. LeftEarly leaves
  // panels() undefined.
  int factor();
  // Sign of the determinant of the last matrix: 1 or -1.
  int sign() const;
  // rhs := (L L')^-1 rhs or (L U)^-1 rhs, rows in the order of the blocks given.
  void solve(std::span<double> rhs);

  std::size_t rows() const { return rows_; }
  std::size_t factor_entries() const { return panel_entries_; }
  // Multiplications of one factor() of a symmetric matrix.
  double factor_work() const { return factor_work_; }

 private:
  // Consecutive nodes with one dense panel: their columns of L, and the rows of these below the diagonal.
  struct Supernode {
    int first_node, end_node;     // columns, in elimination order
    std::vector<int> row_nodes;   // nodes below the diagonal, in elimination order
    std::vector<int> child_rows;  // place of each of row_nodes in the parent's front (scalar row)
    std::vector<int> children;
    int columns, front;  // scalar sizes; the panel is front x columns
    std::size_t panel;
  };
  void order(std::span<const int> sizes, std::span<const std::pair<int, int>> edges,
             std::span<const Vec3> positions);
  void find_supernodes(const std::vector<std::vector<int>>& structure, const std::vector<int>& parent);
  void extend_add(const Supernode& child, const double* update, int update_size, double* front,
                  int stride) const;

  std::vector<int> place_;         // node of each given block
  std::vector<int> size_, start_;  // scalar size and first scalar row of each node, in elimination order
  std::vector<std::size_t> given_start_;  // first scalar row of each given block
  std::vector<int> supernode_of_;
  std::vector<Supernode> supernodes_;
  // Storage of the lower triangle and of the transposed upper one, each allocated at its first use: a pattern
  // may be analysed for its work alone.
  struct Triangle {
    std::vector<double> panels, front, stack;
  };
  void allocate(Triangle& side);
  double side_entries() const;  // of all its storage
  // Expected time of the next factor() (s).
  double seconds() const;
  void take(Triangle& of, const Supernode& s, std::size_t top) const;
  void leave(Triangle& of, const Supernode& s, std::size_t top) const;
  Triangle sides_[2];
  bool symmetric_ = true;
  std::vector<double> work_;
  std::size_t rows_ = 0, panel_entries_ = 0, largest_front_ = 0, largest_stack_ = 0;
  double factor_work_ = 0;
};

}  // namespace amontons
