#pragma once
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "amontons/base/math.hpp"

namespace amontons {

// Multifrontal Cholesky factorisation L L' of a symmetric positive definite matrix given in blocks: bodies
// of 6 rows in body space, cones of 1 to 6 rows in impulse space, or one block for a dense matrix. The order
// is found once per pattern (approximate minimum degree or nested dissection of the graph of blocks);
// factor() then runs on dense fronts only. Source of the method: Duff, Reid 1983; Liu, "The multifrontal
// method for sparse matrix solution", SIAM Review 1992. Our own code because no permissive library offers it:
// the reasons and the ratio are in ARCHITECTURE.md.
//
// With values that are not symmetric on that pattern it is L U: twice the work and memory, the same order, no
// exchange of rows.
//
// Use: the constructor analyses the pattern; slot() says where a block goes, once. Then as often as the
// values change: set_zero(), add the blocks to panels(), factor(), and any number of solve().
class BlockCholesky {
 public:
  BlockCholesky() = default;
  // sizes[i]: rows of block i. edges: pairs i != j of coupled blocks, in any order, duplicates allowed.
  // positions: a point per block, m, or none; they serve the order alone.
  BlockCholesky(std::span<const int> sizes, std::span<const std::pair<int, int>> edges,
                std::span<const Vec3> positions = {});

  // Where block (i, j) is assembled: column-major at panels()[offset] with leading dimension `stride`. When
  // `transposed`, the place holds block (j, i). Of a diagonal block only the lower triangle is read.
  // Two doubles past the end of panels() may be written.
  // Without symmetry panels(Side::upper) has, at the same places, what the transpose of the matrix would have
  // in panels(): of a diagonal block its transpose.
  struct Slot {
    std::size_t offset;
    int stride;
    bool transposed;
  };
  Slot slot(int i, int j) const;
  enum Side : unsigned char { lower, upper };
  std::span<double> panels(Side side = lower) { return sides_[side].panels; }
  // What is assembled next is symmetric, or is not. Looks at the Patience as factor() does: what will not be
  // factored need not be assembled.
  void set_zero(bool symmetric = true);

  // Factors the assembled matrix in place. A pivot that rounding made non-positive is replaced by a huge one,
  // so that its direction is left out of the solution; returns how many were.
  // Looks at the Patience of the thread before it begins, by its own estimate of the time, and on the way:
  // LeftEarly leaves panels() undefined.
  int factor();
  // Of the determinant of the last matrix: 1 or -1.
  int sign() const;
  // rhs := (L L')^-1 rhs or (L U)^-1 rhs, rows in the order of the blocks given.
  void solve(std::span<double> rhs);

  std::size_t rows() const { return rows_; }
  std::size_t factor_entries() const { return sides_[lower].panels.size(); }
  // Multiplications of one factor() with symmetry.
  double factor_work() const { return factor_work_; }

 private:
  // Consecutive nodes with one dense panel: their columns of L, and the rows that these have below the
  // diagonal.
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
  // Of the lower triangle, and of the upper one, transposed, which has memory once it is needed.
  struct Triangle {
    std::vector<double> panels, front, stack;
  };
  // What the next factor() is expected to take (s).
  double seconds() const;
  void take(Triangle& of, const Supernode& s, std::size_t top) const;
  void leave(Triangle& of, const Supernode& s, std::size_t top) const;
  Triangle sides_[2];
  bool symmetric_ = true;
  std::vector<double> work_;
  std::size_t rows_ = 0;
  double factor_work_ = 0;
};

}  // namespace amontons
