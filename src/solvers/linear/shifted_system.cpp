// From A + Theta^-1 to a matrix with six rows per body, step by step: docs/algorithm.md (22, 23).
//
// 1. Symmetric, and without an inverse of Theta. With Theta = R R' and y = R z,
//    (A + Theta^-1) y = r   <=>   (I + R'A R) z = R'r                              (multiply by R')
// This also holds for singular R: y is sought only in range(R). Eigenvalues are 1 or more.
//
// 2. Bodies: A = D M^-1 D' + E, M^-1 = C C'. E is a multiple of I in each block, so that I + R'E R = L L' is
// block diagonal like R. With G = L^-1 R'D C,
//    I + R'A R = L L' + R'D C C'D'R = L (I + G G') L'.
//
// 3. Woodbury: (I + G G')^-1 = I - G (I + G'G)^-1 G'. (Check: (I + G G')(I - G S^-1 G') with S = I + G'G is
// I + G G' - G (I + G'G) S^-1 G' = I + G G' - G G' = I.) So, for z of (I + R'A R) z = q,
//    w = L^-1 q;   S v = G'w;   z = L^-T (w - G v).
//
// S = I + G'G has a block per body and one per pair of bodies that share a block of K. Its pattern is that of
// the contact graph, for any number of contacts between two bodies. Working with C on both sides of D keeps S
// symmetric with eigenvalues of 1 or more. Fixed bodies have no place in it.
//
// Trees have C = J L^-1 D^-1/2 with M = L'DL (problem/linkage.hpp). A row of D C has entries at the
// coordinates between its bodies and the root. These are nodes of S in place of the bodies
// (motion_nodes.hpp). M is not in S: two coordinates share a block only if one row reaches both.
//
// 4. Without symmetry J + A R, as of the law of Coulomb. With K = J + E R, P = R K^-1, block by block, and
// Y = D C,
//    z = K^-1 (q - Y v),   v = Y'R z:   (I + Y'P Y) v = Y'P q,
// on the same pattern, factored as L U.
#include "amontons/solvers/linear/shifted_system.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/base/leave.hpp"
#include "solvers/linear/body_kernel.hpp"
#include "solvers/linear/motion_nodes.hpp"
#include "solvers/linear/small_roots.hpp"
#include "solvers/linear/small_solve.hpp"

namespace amontons {

// The operator decides the space: bodies use body space, matrices impulse space. The pattern is analysed
// here, once. The reference to the problem serves the products of refinement.
ShiftedSystem::ShiftedSystem(const Problem& problem) : problem_(problem) {
  offset_.resize(problem.K.blocks());
  blocks_.resize(problem.K.blocks());
  for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    offset_[block] = factor_size_;
    factor_size_ += S::dim * S::dim;
    blocks_[block] = {static_cast<int>(row), S::dim, 0, 0, 0};
  });
  const std::size_t m = problem.rows();
  for (std::vector<double>* v : {&q_, &z_, &correction_, &work_}) v->resize(m);
  std::visit(
      [&]<class Op>(const Op& A) {
        if constexpr (std::is_same_v<Op, CallbackOperator>)
          throw InputError(
              "this method factors A, which a function operator does not allow; give a matrix or bodies, or "
              "use p-spg-fb, apgd or jacobi");
        else if constexpr (std::is_same_v<Op, ContactSystem>)
          analyse(A);
        else if constexpr (std::is_same_v<Op, SparseOperator>)
          analyse(m, [&](auto&& f) {
            for (std::size_t i = 0; i < m; ++i)
              for (Index k = A.indptr[i]; k < A.indptr[i + 1]; ++k) f(i, A.indices[k], A.data[k]);
          });
        else
          analyse(m, [&](auto&& f) {
            for (std::size_t i = 0; i < m; ++i)
              for (std::size_t j = 0; j < m; ++j) f(i, j, A.data[i * m + j]);
          });
      },
      problem.A);
}

// Nodes are coordinates of motion, edges the pairs of nodes on which a block acts. Rows of D C wait for the
// first factorisation: many patterns are analysed for its work alone.
void ShiftedSystem::analyse(const ContactSystem& A) {
  const MotionNodes nodes(A, problem_.graph.moves, true);
  in_body_space_ = true;
  start_.assign(1, 0);
  for (const int size : nodes.size) start_.push_back(start_.back() + size);

  std::vector<std::pair<int, int>> edges;
  std::vector<int> place(nodes.size.size(), -1);  // of each node among those of the present block
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    find_nodes(A, nodes, b, place);
    const std::span<const int> own = nodes_of(b);
    for (std::size_t j = 0; j < own.size(); ++j) {
      for (std::size_t i = 0; i < j; ++i) edges.emplace_back(own[i], own[j]);
      place[own[j]] = -1;
    }
  }
  // Symbolic only. The places of the blocks do not change, so they are looked up once.
  cholesky_ = BlockCholesky(nodes.size, edges, nodes.position);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    blocks_[b].slot = slots_.size();
    const std::span<const int> own = nodes_of(b);
    for (std::size_t j = 0; j < own.size(); ++j)
      for (std::size_t i = 0; i <= j; ++i) slots_.push_back(cholesky_.slot(own[i], own[j]));
  }
  packed_.resize(cholesky_.rows());
  node_vectors_.resize(8 * nodes.size.size());
}

// The nodes of a block. `place` is -1 before.
void ShiftedSystem::find_nodes(const ContactSystem& A, const MotionNodes& nodes, std::size_t b,
                               std::vector<int>& place) {
  Block& block = blocks_[b];
  block.node = node_.size();
  const auto take = [&](int node) {
    if (node < 0 || place[node] >= 0) return;
    place[node] = static_cast<int>(node_.size() - block.node);
    node_.push_back(node);
  };
  const ContactGraph::Link& link = problem_.graph.links[b];
  for (const Index body : {link.a, link.b})
    if (body >= 0) take(nodes.of_body[body]);
  if (!A.half.first.empty())
    for (std::size_t k = A.half.first[block.row]; k < A.half.first[block.row + block.dim]; ++k)
      take(nodes.of_coordinate[A.half.coordinate[k]]);
  dims_.push_back(block.dim);
  counts_.push_back(static_cast<int>(node_.size() - block.node));
}

// D C row by row, in the order of the blocks, with eight numbers per node of the block.
void ShiftedSystem::form_rows(const ContactSystem& A) {
  MotionNodes nodes(A, problem_.graph.moves, true);
  nodes.make_roots(A.bodies);
  compliance_ = A.compliance;
  if (std::any_of(compliance_.begin(), compliance_.end(), [](double e) { return e > 0; }))
    L_.resize(factor_size_);
  std::size_t size = 0;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    blocks_[b].value = size;
    size += 8 * static_cast<std::size_t>(counts_[b]) * blocks_[b].dim;
  }
  D_.resize(size);
  G_.resize(size);
  std::vector<int> place(nodes.size.size());  // of each node of the present block among them
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    const std::span<const int> own = nodes_of(b);
    for (std::size_t j = 0; j < own.size(); ++j) place[own[j]] = static_cast<int>(j);
    for (int i = block.row; i < block.row + block.dim; ++i) {
      double* out = D_.data() + block.value + 8 * own.size() * (i - block.row);
      nodes.visit_row(A, i, A.jacobian[i], [&](std::size_t at, double value) {
        out[8 * place[at / MotionNodes::width] + at % MotionNodes::width] = value;
      });
    }
  }
}

// For a matrix: nodes are the blocks of K, edges the pairs of blocks with a nonzero entry. Only the lower
// triangle is taken, as A is symmetric. Entries given in several parts are summed.
void ShiftedSystem::analyse(std::size_t m, auto&& for_each_entry) {
  std::vector<int> block_of(m), sizes;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    for (int k = 0; k < blocks_[b].dim; ++k) block_of[blocks_[b].row + k] = static_cast<int>(b);
    sizes.push_back(blocks_[b].dim);
  }
  // Entries arrive by rows: the pairs of one block row are found with a stamp per block column.
  std::vector<int> pair_of(blocks_.size(), -1), stamp(blocks_.size(), -1);
  std::vector<std::pair<int, int>> edges;
  for_each_entry([&](std::size_t i, std::size_t j, double value) {
    const int I = block_of[i], J = block_of[j];
    // The first entry of a pair creates it; stamp[J] = I means that pair_of[J] belongs to this block row.
    if (J > I || value == 0) return;
    if (stamp[J] != I) {
      leave_if_due_at(pairs_.size());
      stamp[J] = I;
      pair_of[J] = static_cast<int>(pairs_.size());
      pairs_.push_back({I, J, pair_values_.size(), {}});
      pair_values_.resize(pair_values_.size() + sizes[I] * sizes[J], 0.0);
      if (I != J) edges.emplace_back(I, J);
    }
    pair_values_[pairs_[pair_of[J]].values + (i - blocks_[I].row) * sizes[J] + (j - blocks_[J].row)] += value;
  });
  cholesky_ = BlockCholesky(sizes, edges);
  for (Pair& pair : pairs_) {
    leave_if_due_at(static_cast<std::size_t>(&pair - pairs_.data()));
    pair.slot = cholesky_.slot(pair.i, pair.j);
  }
  for (int b = 0; b < static_cast<int>(blocks_.size()); ++b) slots_.push_back(cholesky_.slot(b, b));
  require_semidefinite();
}

int ShiftedSystem::factor(std::span<const double> R) { return factor(R, {}); }

int ShiftedSystem::factor(std::span<const double> R, std::span<const double> J) {
  if (const auto* A = std::get_if<ContactSystem>(&problem_.A); A && D_.empty())
    A->contacts.empty() ? form_rows(*A) : form_rows(A->stored());
  R_.assign(R.begin(), R.end());
  J_.assign(J.begin(), J.end());
  cholesky_.set_zero(J.empty());
  sign_of_blocks_ = 1;
  in_body_space() ? assemble_bodies() : assemble_pairs();
  return cholesky_.factor();
}

// I + R'AR with R R' = 1e5 P^-1 has a negative pivot if and only if P^-1/2 A P^-1/2 has an eigenvalue below
// -1e-5 (Sylvester's law of inertia). Real files have some at -1e-7, from rounding in the engine that wrote
// them. The scale P makes the test independent of the units of a file.
void ShiftedSystem::require_semidefinite() {
  std::vector<double> R(factor_size_, 0.0);
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    for (int k = 0; k < blocks_[b].dim; ++k)
      R[offset_[b] + k * (blocks_[b].dim + 1)] = std::sqrt(1e5 / problem_.P[b]);
  AMONTONS_REQUIRE(
      factor(R) == 0,
      "A is not positive semidefinite, so the problem is not one of contact mechanics and may have no "
      "solution; check the signs of its rows");
}

// G = L^-1 R'D C of one block, from rows of D C: the product with R', then forward substitution, all columns.
void ShiftedSystem::form_G(std::size_t b) {
  const Block& block = blocks_[b];
  const double* R = &R_[offset_[b]];
  const int lanes = 8 * counts_[b];
  double* G = G_.data() + block.value;
  AMONTONS_DISPATCH(combine_rows, R, block.dim, D_.data() + block.value, G, lanes);
  // No compliance: L is the identity.
  if (L_.empty()) return;
  double* L = &L_[offset_[b]];
  compliance_root(R, block.dim, compliance_[block.row], L);
  for (int k = 0; k < lanes; ++k)
    for (int i = 0; i < block.dim; ++i) {
      for (int j = 0; j < i; ++j) G[lanes * i + k] -= L[block.dim * i + j] * G[lanes * j + k];
      G[lanes * i + k] /= L[(block.dim + 1) * i];
    }
}

// K^-1 = (J + E R)^-1 of one block, and P D C with P = R K^-1.
void ShiftedSystem::form_PD(std::size_t b) {
  const double *R = &R_[offset_[b]], *J = &J_[offset_[b]];
  const double e = compliance_.empty() ? 0 : compliance_[blocks_[b].row];
  // P transposed, as combine_rows takes it.
  double K[largest_dim * largest_dim], P[largest_dim * largest_dim], *inverse = &inverse_[offset_[b]];
  with_size(blocks_[b].dim, [&](auto dim) {
    for (int i = 0; i < dim * dim; ++i) {
      inverse[i] = i % (dim + 1) == 0;
      K[i] = J[i] + e * R[i];
    }
    sign_of_blocks_ *= solve_block(dim, K, inverse, dim);
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j) {
        P[dim * j + i] = 0;
        for (int k = 0; k < dim; ++k) P[dim * j + i] += R[dim * i + k] * inverse[dim * k + j];
      }
  });
  const std::size_t at = blocks_[b].value;
  AMONTONS_DISPATCH(combine_rows, P, blocks_[b].dim, D_.data() + at, G_.data() + at, 8 * counts_[b]);
}

// S = I + sum over blocks of G_block' G_block, or Y_block' P Y_block. Each block contributes the products of
// its nodes with themselves, and with each other. For transposed slots left and right are exchanged. The
// identity is added for each node at its first block: each node has one.
void ShiftedSystem::assemble_bodies() {
  const bool symmetric = J_.empty();
  if (!symmetric) inverse_.resize(factor_size_);
  const std::span<double> H = cholesky_.panels(), U = cholesky_.panels(BlockCholesky::upper);
  // Nodes whose identity has been added.
  std::vector<char> seen(start_.size(), 0);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    symmetric ? form_G(b) : form_PD(b);
    const Block& block = blocks_[b];
    const double *PD = G_.data() + block.value, *D = symmetric ? PD : D_.data() + block.value;
    const std::span<const int> own = nodes_of(b);
    const int lanes = 8 * counts_[b];
    const BlockCholesky::Slot* slot = slots_.data() + block.slot;
    for (std::size_t j = 0; j < own.size(); ++j)
      for (std::size_t i = 0; i <= j; ++i, ++slot) {
        const std::size_t left = slot->transposed ? j : i, right = slot->transposed ? i : j;
        const int columns = start_[own[right] + 1] - start_[own[right]];
        const auto add = [&](const std::span<double> to, const double* of_left, const double* of_right) {
          AMONTONS_DISPATCH(add_outer_product, EightRows{&to[slot->offset], slot->stride, columns},
                            of_left + 8 * left, of_right + 8 * right, lanes, block.dim);
        };
        add(H, D, PD);
        if (!symmetric) add(U, PD, D);
        if (i < j || seen[own[i]]) continue;
        seen[own[i]] = 1;
        for (int c = 0; c < columns; ++c) {
          const std::size_t at = slot->offset + static_cast<std::size_t>(c) * slot->stride + c;
          H[at] += 1;
          if (!symmetric) U[at] += 1;
        }
      }
  }
}

// I + R'A R or J + A R, pair by pair: (R'A R)_IJ = R_I' A_IJ R_J, at most 6 x 6. The upper triangle has the
// transposed A_JI R_I, which is R_I' A_IJ.
void ShiftedSystem::assemble_pairs() {
  const bool symmetric = J_.empty();
  const std::span<double> H = cholesky_.panels(), U = cholesky_.panels(BlockCholesky::upper);
  for (const Pair& pair : pairs_) {
    leave_if_due_at(static_cast<std::size_t>(&pair - pairs_.data()));
    const auto [offset, stride, transposed] = pair.slot;
    const int di = blocks_[pair.i].dim, dj = blocks_[pair.j].dim;
    const double *Ri = &R_[offset_[pair.i]], *Rj = &R_[offset_[pair.j]], *A = &pair_values_[pair.values];
    double AR[largest_dim * largest_dim];
    for (int i = 0; i < di; ++i)
      for (int j = 0; j < dj; ++j) {
        AR[i * dj + j] = 0;
        for (int k = 0; k < dj; ++k) AR[i * dj + j] += A[i * dj + k] * Rj[k * dj + j];
      }
    // Panels are column-major; for a transposed slot i and j, and the triangles, are exchanged.
    const double* right = symmetric ? AR : A;
    for (int i = 0; i < di; ++i)
      for (int j = 0; j < dj; ++j) {
        double sum = 0;
        for (int k = 0; k < di; ++k) sum += Ri[k * di + i] * right[k * dj + j];
        const std::size_t at = offset + (transposed ? i * stride + j : j * stride + i);
        (symmetric || transposed ? H : U)[at] += sum;
        if (!symmetric) (transposed ? U : H)[at] += AR[i * dj + j];
      }
  }
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const BlockCholesky::Slot& slot = slots_[b];
    const int dim = blocks_[b].dim;
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j) {
        const std::size_t at = slot.offset + static_cast<std::size_t>(j) * slot.stride + i;
        if (symmetric) {
          H[at] += i == j;
          continue;
        }
        H[at] += J_[offset_[b] + dim * i + j];
        U[at] += J_[offset_[b] + dim * j + i];
      }
  }
}

// Forward and backward substitution in each block; without compliance L is the identity and not stored.
void ShiftedSystem::divide_by_L(std::span<double> q) const {
  for (std::size_t b = 0; !L_.empty() && b < blocks_.size(); ++b) {
    const auto [row, dim] = std::pair{blocks_[b].row, blocks_[b].dim};
    const double* L = &L_[offset_[b]];
    for (int i = 0; i < dim; ++i) {
      for (int j = 0; j < i; ++j) q[row + i] -= L[dim * i + j] * q[row + j];
      q[row + i] /= L[(dim + 1) * i];
    }
  }
}

void ShiftedSystem::divide_by_L_transposed(std::span<double> z) const {
  for (std::size_t b = 0; !L_.empty() && b < blocks_.size(); ++b) {
    const auto [row, dim] = std::pair{blocks_[b].row, blocks_[b].dim};
    const double* L = &L_[offset_[b]];
    for (int i = dim - 1; i >= 0; --i) {
      for (int j = i + 1; j < dim; ++j) z[row + i] -= L[dim * j + i] * z[row + j];
      z[row + i] /= L[(dim + 1) * i];
    }
  }
}

// w = L^-1 q;  S v = G'w;  z = L^-T (w - G v). Without symmetry:
// w = R K^-1 q;  S v = Y'w;  z = K^-1 (q - Y v).
void ShiftedSystem::solve_once(std::span<const double> q, std::span<double> z) {
  std::copy(q.begin(), q.end(), z.begin());
  if (!in_body_space()) return cholesky_.solve(z);
  const bool symmetric = J_.empty();
  std::span<const double> w = z;
  if (symmetric) {
    divide_by_L(z);
  } else {
    times_blocks<false>(inverse_, z, work_);
    times_factor(work_, work_);
    w = work_;
  }
  const NodeRows rows{blocks_.size(), dims_.data(), counts_.data(), node_.data(),
                      symmetric ? G_.data() : D_.data()};
  std::fill(node_vectors_.begin(), node_vectors_.end(), 0.0);
  // Kernels have eight doubles per node, the factorisation its coordinates.
  double* nodes = node_vectors_.data();
  const std::size_t count = start_.size() - 1;
  // nodes = G'w or Y'w
  AMONTONS_DISPATCH(scatter_rows, rows, w.data(), nodes);
  for (std::size_t i = 0; i < count; ++i)
    std::copy_n(nodes + 8 * i, start_[i + 1] - start_[i], packed_.data() + start_[i]);
  // v = S^-1 nodes
  cholesky_.solve(packed_);
  for (std::size_t i = 0; i < count; ++i)
    std::copy_n(packed_.data() + start_[i], start_[i + 1] - start_[i], nodes + 8 * i);
  // work = G v or Y v
  AMONTONS_DISPATCH(gather_rows, rows, nodes, work_.data());
  for (std::size_t i = 0; i < z.size(); ++i) z[i] -= work_[i];
  symmetric ? divide_by_L_transposed(z) : times_blocks<false>(inverse_, z, z);
}

// By the operator itself and not by G: refinement corrects the rounding of C, G and the factors.
void ShiftedSystem::apply(std::span<const double> z, std::span<double> out) {
  times_factor(z, work_);
  product(problem_.A, work_, out);
  const bool symmetric = J_.empty();
  symmetric ? times_transposed_factor(out, out) : times_blocks<false>(J_, z, work_);
  for (std::size_t i = 0; i < z.size(); ++i) out[i] += symmetric ? z[i] : work_[i];
}

// out = M v, or M' v, block by block; v and out may be the same memory.
template <bool transposed>
void ShiftedSystem::times_blocks(std::span<const double> M, std::span<const double> v,
                                 std::span<double> out) const {
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    with_size(blocks_[b].dim, [&, R = &M[offset_[b]], from = &v[blocks_[b].row]](auto dim) {
      double sum[largest_dim] = {};
      for (int i = 0; i < dim; ++i)
        for (int k = 0; k < dim; ++k) sum[i] += R[transposed ? k * dim + i : i * dim + k] * from[k];
      std::copy(sum, sum + dim, &out[blocks_[b].row]);
    });
}

void ShiftedSystem::times_factor(std::span<const double> z, std::span<double> y) const {
  times_blocks<false>(R_, z, y);
}

void ShiftedSystem::times_transposed_factor(std::span<const double> r, std::span<double> q) const {
  times_blocks<true>(R_, r, q);
}

// Refinement: solves for the defect q - (I + R'A R) z and adds the result. For large Theta it recovers the
// digits that w - G v of Woodbury's identity loses by cancellation.
void ShiftedSystem::solve_reduced(std::span<const double> q, std::span<double> z, int refinements) {
  std::copy(q.begin(), q.end(), q_.begin());
  solve_once(q_, z);
  for (int step = 0; step < refinements; ++step) {
    apply(z, correction_);
    for (std::size_t i = 0; i < z.size(); ++i) correction_[i] = q_[i] - correction_[i];
    solve_once(correction_, z_);
    for (std::size_t i = 0; i < z.size(); ++i) z[i] += z_[i];
  }
}

void ShiftedSystem::solve(std::span<const double> r, std::span<double> y, int refinements) {
  times_transposed_factor(r, y);
  solve_reduced(y, y, refinements);
  times_factor(y, y);
}

}  // namespace amontons
