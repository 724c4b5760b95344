#pragma once
#include <span>
#include <vector>

#include "amontons/problem/problem.hpp"
#include "amontons/solvers/linear/block_cholesky.hpp"

namespace amontons {

struct MotionNodes;  // solvers/linear/motion_nodes.hpp

// Solves (A + Theta^-1) y = r, the linear system of the interior point (Theta from the Nesterov-Todd
// scaling). Theta = R R' is block diagonal with one dim x dim factor R per cone block. A singular R is
// allowed; the system then means y in range(R). In terms of z, y = R z:
//
//    (I + R' A R) z = R' r.
//
// Newton's method and the path of Coulomb's law have (J + A R) z = q with any blocks J and R, y = R z. An
// open contact has R = 0, a sliding one a rank below dim.
//
// Body space, A = D M^-1 D' + E: with M^-1 = C C', I + R'ER = L L' and G = L^-1 R' D C this is L (I + G G')
// L' z = q. By Woodbury (I + G G')^-1 = I - G (I + G' G)^-1 G': six unknowns per body, or the coordinates of
// trees, for any number of contacts. Impulse space (A given as a matrix): I + R'AR is factored directly.
// shifted_system.cpp derives the steps. The pattern is analysed once. factor() serves each new Theta, and any
// number of right-hand sides follow.
class ShiftedSystem {
 public:
  // Analyses the pattern. InputError for a callback operator, which cannot be factored, and for an indefinite
  // matrix.
  explicit ShiftedSystem(const Problem& problem);

  // Offset of the row-major factor of a block in the array given to factor(): dim^2 entries.
  std::size_t factor_offset(std::size_t block) const { return offset_[block]; }
  std::size_t factor_size() const { return factor_size_; }

  // Returns the number of pivots that rounding made non-positive, which occurs if A is semidefinite.
  int factor(std::span<const double> R);
  // Without symmetry: factors (J + A R) with blocks J of any values, row-major as R, which takes twice as
  // long. Returns the number of pivots that were zero.
  int factor(std::span<const double> R, std::span<const double> J);
  // Sign of the determinant of (J + A R): 1 or -1.
  int sign() const { return sign_of_blocks_ * cholesky_.sign(); }
  // z of (I + R' A R) z = q, or of (J + A R) z = q, with `refinements` steps of iterative refinement. q and
  // z may be the same memory.
  void solve_reduced(std::span<const double> q, std::span<double> z, int refinements);
  // y for r: q = R' r, y = R z.
  void solve(std::span<const double> r, std::span<double> y, int refinements);
  void times_transposed_factor(std::span<const double> r, std::span<double> q) const;  // q = R' r
  void times_factor(std::span<const double> z, std::span<double> y) const;             // y = R z

  bool in_body_space() const { return in_body_space_; }
  std::size_t factor_entries() const { return cholesky_.factor_entries(); }
  // Multiplications of the last factorisation, or of the first one.
  double factor_work() const { return (J_.empty() ? 1 : 2) * cholesky_.factor_work(); }

 private:
  struct Block {
    int row, dim;
    // Where its nodes begin in node_, its rows in D_, and the slots of pairs of its nodes in slots_.
    std::size_t node, value, slot;
  };
  struct Pair {  // a coupled pair of blocks of a matrix, i >= j, with the values of A row-major
    int i, j;
    std::size_t values;
    BlockCholesky::Slot slot;
  };
  void analyse(const ContactSystem& A);
  void find_nodes(const ContactSystem& A, const MotionNodes& nodes, std::size_t block,
                  std::vector<int>& place);
  void form_rows(const ContactSystem& A);
  std::span<const int> nodes_of(std::size_t block) const {
    return {node_.data() + blocks_[block].node, static_cast<std::size_t>(counts_[block])};
  }
  void analyse(std::size_t m, auto&& for_each_entry);
  void require_semidefinite();
  void form_G(std::size_t block);
  void form_PD(std::size_t block);
  void assemble_bodies();
  void assemble_pairs();
  template <bool transposed>
  void times_blocks(std::span<const double> M, std::span<const double> v, std::span<double> out) const;
  void solve_once(std::span<const double> q, std::span<double> z);
  void apply(std::span<const double> z, std::span<double> out);  // out = (I + R' A R) z or (J + A R) z
  void divide_by_L(std::span<double> q) const;                   // q := L^-1 q
  void divide_by_L_transposed(std::span<double> z) const;        // z := L^-T z

  const Problem& problem_;
  std::vector<std::size_t> offset_;
  std::size_t factor_size_ = 0;
  std::vector<Block> blocks_;
  bool in_body_space_ = false;
  // Per block its rows and its nodes; the latter one block after the other; and the first coordinate of each
  // node in the factorisation.
  std::vector<int> dims_, counts_, node_, start_;
  // Pairs i <= j of the nodes of a block, one j after the other; the diagonal for a matrix.
  std::vector<BlockCholesky::Slot> slots_;
  std::vector<double> D_, G_;  // rows of D C and of L^-1 R' D C, or of P D C, eight numbers per node
  std::vector<double> compliance_, R_;
  std::vector<double> L_;            // factors L of the blocks, laid out as R_; empty without compliance
  std::vector<double> J_, inverse_;  // without symmetry: J, and (J + E R)^-1 of every block
  std::vector<Pair> pairs_;
  std::vector<double> pair_values_;
  BlockCholesky cholesky_;
  int sign_of_blocks_ = 1;  // sign of the product of the determinants of all J + E R
  std::vector<double> q_, z_, correction_, work_;
  // Velocities of the nodes: eight doubles per node for the kernels, its coordinates in the factorisation.
  std::vector<double> node_vectors_, packed_;
};

}  // namespace amontons
