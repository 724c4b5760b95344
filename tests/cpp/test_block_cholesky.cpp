#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "amontons/base/isa.hpp"
#include "amontons/solvers/linear/block_cholesky.hpp"
#include "check.hpp"
#include "problems.hpp"
#include "solvers/linear/body_kernel.hpp"
#include "solvers/linear/front_kernel.hpp"

using namespace amontons;
using small::Vector;

namespace {

using Edges = std::vector<std::pair<int, int>>;

// A symmetric positive definite matrix with a block pattern, dense and row-major.
struct BlockMatrix {
  std::vector<int> sizes, start;
  Edges edges;
  std::size_t m = 0;
  Vector A;

  BlockMatrix(std::vector<int> block_sizes, Edges block_edges, unsigned seed)
      : sizes(std::move(block_sizes)), edges(std::move(block_edges)) {
    small::Random random(seed);
    for (int size : sizes) start.push_back(static_cast<int>(m)), m += size;
    A.resize(m * m);
    const auto fill = [&](int I, int J) {
      for (int i = start[I]; i < start[I] + sizes[I]; ++i)
        for (int j = start[J]; j < start[J] + sizes[J]; ++j) A[i * m + j] = A[j * m + i] = random.normal();
    };
    for (std::size_t i = 0; i < sizes.size(); ++i) fill(static_cast<int>(i), static_cast<int>(i));
    for (auto [i, j] : edges)
      if (i != j) fill(i, j);
    // Diagonally dominant, so definite; not too much, so that off-diagonal errors show.
    for (std::size_t i = 0; i < m; ++i) {
      double sum = 0.1;
      for (std::size_t j = 0; j < m; ++j) sum += i == j ? 0.0 : std::abs(A[i * m + j]);
      A[i * m + i] = sum;
    }
  }

  void assemble(BlockCholesky& factor) const {
    factor.set_zero();
    const auto put = [&](int I, int J) {
      const BlockCholesky::Slot slot = factor.slot(I, J);
      for (int i = 0; i < sizes[I]; ++i)
        for (int j = 0; j < sizes[J]; ++j) {
          const std::size_t at =
              slot.transposed ? std::size_t(i) * slot.stride + j : std::size_t(j) * slot.stride + i;
          factor.panels()[slot.offset + at] = A[(start[I] + i) * m + start[J] + j];
        }
    };
    for (std::size_t i = 0; i < sizes.size(); ++i) put(static_cast<int>(i), static_cast<int>(i));
    for (auto [i, j] : edges)
      if (i != j) put(i, j);
  }
};

void compare(const BlockMatrix& matrix, BlockCholesky& factor, unsigned seed) {
  matrix.assemble(factor);
  CHECK(factor.rows() == matrix.m);
  CHECK(factor.factor() == 0);
  for (unsigned k = 0; k < 2; ++k) {
    const Vector b = small::Random(seed + k).vector(matrix.m), expected = small::solve_dense(matrix.A, b);
    Vector x = b;
    factor.solve(x);
    double scale = 0;
    for (double v : expected) scale = std::max(scale, std::abs(v));
    for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(x[i], expected[i], 1e-12 * scale);
  }
}

void compare(std::vector<int> sizes, Edges edges, unsigned seed) {
  const BlockMatrix matrix(std::move(sizes), std::move(edges), seed);
  BlockCholesky factor(matrix.sizes, matrix.edges);
  compare(matrix, factor, seed);
}

std::vector<Isa> isas() {
  std::vector<Isa> list;
  for (Isa isa : {Isa::baseline, Isa::avx2, Isa::avx512})
    if (isa <= active_isa()) list.push_back(isa);
  return list;
}

// Calls the function of the given instruction set.
#if defined(AMONTONS_X86)
#define CALL(isa, f, ...)                        \
  ((isa) == Isa::avx512 ? avx512::f(__VA_ARGS__) \
   : (isa) == Isa::avx2 ? avx2::f(__VA_ARGS__)   \
                        : baseline::f(__VA_ARGS__))
#else
#define CALL(isa, f, ...) (baseline::f(__VA_ARGS__))
#endif

// A front as the factorisation makes it: column-major with padding, definite, only the lower triangle filled.
Vector front_matrix(int front, int stride, unsigned seed) {
  small::Random random(seed);
  Vector F(static_cast<std::size_t>(stride) * (front + 8), 0.0);
  for (int j = 0; j < front; ++j) {
    for (int i = j; i < front; ++i) F[j * stride + i] = random.normal();
    F[j * stride + j] = 2.0 * front;
  }
  return F;
}

}  // namespace

// Breaks when a front of an odd size, a merged supernode or a tile at an edge is handled wrongly: one dense
// block of every size up to beyond two panels of columns.
TEST(one_dense_block) {
  for (int size : {1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 23, 31, 33, 47, 48, 49, 63, 65, 97, 130})
    compare({size}, {}, size);
}

// Breaks when blocks are not independent: no edges, all sizes mixed, some repeated.
TEST(disconnected_blocks) {
  compare({6, 6, 6, 6}, {}, 1);
  compare({1, 3, 6, 2, 17, 1}, {}, 2);
  compare({3, 3, 1, 1, 6, 6}, {{0, 2}, {4, 5}}, 3);  // three islands
}

// Breaks when an update matrix reaches the wrong rows of its parent: patterns of known shape.
TEST(trees_chains_and_cycles) {
  const int n = 23;
  for (int size : {1, 3, 6}) {
    std::vector<int> sizes(n, size);
    Edges chain, cycle, star, reversed_star, tree, complete;
    for (int i = 1; i < n; ++i) {
      chain.emplace_back(i, i - 1);
      star.emplace_back(0, i);
      reversed_star.emplace_back(i, n - 1);
      tree.emplace_back((i - 1) / 3, i);
      for (int j = 0; j < i; ++j) complete.emplace_back(i, j);
    }
    cycle = chain;
    cycle.emplace_back(0, n - 1);
    reversed_star.pop_back();
    for (const Edges& edges : {chain, cycle, star, reversed_star, tree, complete})
      compare(sizes, edges, size);
  }
}

// Breaks for a pattern nobody thought of. Edges in both directions and repeated, block sizes from 1 to 9.
TEST(random_patterns) {
  small::Random random(4);
  for (unsigned seed = 1; seed < 120; ++seed) {
    const int n = 1 + static_cast<int>(random.below(28));
    std::vector<int> sizes(n);
    const bool bodies = seed % 3 == 0;
    for (int& size : sizes) size = bodies ? 6 : 1 + static_cast<int>(random.below(9));
    Edges edges;
    const std::size_t count = random.below(3 * n);
    for (std::size_t k = 0; k < count; ++k)
      edges.emplace_back(static_cast<int>(random.below(n)), static_cast<int>(random.below(n)));
    if (!edges.empty()) edges.emplace_back(edges[0].second, edges[0].first), edges.push_back(edges[0]);
    compare(sizes, edges, seed);
  }
}

// A wall of bricks: many supernodes, fronts of many sizes, a deep stack of update matrices. Breaks when an
// update matrix is taken from the stack in the wrong order, or the stack is too small.
TEST(grid_of_bodies) {
  const int columns = 9, height = 8;
  Edges edges;
  for (int r = 0; r < height; ++r)
    for (int c = 0; c < columns; ++c) {
      if (c > 0) edges.emplace_back(r * columns + c, r * columns + c - 1);
      if (r > 0) edges.emplace_back(r * columns + c, (r - 1) * columns + c);
      if (r > 0 && c > 0) edges.emplace_back(r * columns + c, (r - 1) * columns + c - 1);
    }
  compare(std::vector<int>(columns * height, 6), edges, 9);
}

// Breaks when the first factorisation leaves something behind for the second.
TEST(one_pattern_many_values) {
  const BlockMatrix first({6, 6, 3, 1, 6}, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 0}}, 1);
  const BlockMatrix second(first.sizes, first.edges, 2);
  BlockCholesky factor(first.sizes, first.edges);
  for (const BlockMatrix* matrix : {&first, &second, &first}) compare(*matrix, factor, 3);
}

// Breaks when slot() gives one place twice, or a wrong orientation: the places of all blocks are disjoint,
// and (i, j) is (j, i) transposed.
TEST(slots_are_disjoint) {
  const std::vector<int> sizes{2, 3, 1, 6, 4};
  const Edges edges{{0, 1}, {3, 1}, {2, 3}, {4, 0}, {4, 3}};
  BlockCholesky factor(sizes, edges);
  std::vector<int> used(factor.factor_entries());
  const auto mark = [&](int I, int J) {
    const auto slot = factor.slot(I, J), back = factor.slot(J, I);
    CHECK(slot.offset == back.offset && slot.stride == back.stride &&
          (I == J || slot.transposed != back.transposed));
    const int rows = slot.transposed ? sizes[J] : sizes[I], columns = slot.transposed ? sizes[I] : sizes[J];
    for (int j = 0; j < columns; ++j)
      for (int i = I == J ? j : 0; i < rows; ++i) ++used[slot.offset + std::size_t(j) * slot.stride + i];
  };
  for (int i = 0; i < 5; ++i) mark(i, i);
  for (auto [i, j] : edges) mark(i, j);
  CHECK(*std::max_element(used.begin(), used.end()) == 1);
}

// Breaks when a singular matrix gives infinite numbers: the pivot is replaced, its direction left out, and
// the solution of the rest is right. [[4, 2, 0], [2, 1, 0], [0, 0, 9]] x = (0, 0, 18), and (4, 2, 18).
TEST(singular_pivot_is_left_out) {
  BlockCholesky factor(std::vector<int>{3}, Edges{});
  const double A[3][3] = {{4, 2, 0}, {2, 1, 0}, {0, 0, 9}};
  const auto slot = factor.slot(0, 0);
  factor.set_zero();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) factor.panels()[slot.offset + j * slot.stride + i] = A[i][j];
  CHECK(factor.factor() == 1);
  Vector x{4, 2, 18};
  factor.solve(x);
  CHECK_NEAR(x[0], 1, 1e-15);
  CHECK_NEAR(x[1], 0, 1e-30);
  CHECK_NEAR(x[2], 2, 1e-15);
}

// Breaks when a matrix without blocks has a pivot, or its panels are read.
TEST(no_blocks) {
  BlockCholesky factor(std::vector<int>{}, Edges{});
  CHECK(factor.rows() == 0);
  factor.set_zero();
  CHECK(factor.factor() == 0);
  factor.solve({});
}

// Breaks when a kernel rounds differently in one instruction set, or touches what lies beyond the front.
TEST(front_kernel_has_the_same_bits_in_every_instruction_set) {
  for (int front : {1, 2, 5, 6, 8, 11, 16, 18, 29, 48, 54, 66, 77, 103, 150})
    for (int columns : {1, 6, front / 2, front - 1, front}) {
      if (columns < 1 || columns > front) continue;
      const int stride = (front + 7) / 8 * 8;
      const Vector F = front_matrix(front, stride, front);
      Vector expected;
      for (Isa isa : isas()) {
        Vector A = F, pack(front_pack_size(front));
        CHECK(CALL(isa, partial_cholesky, A.data(), front, stride, columns, pack.data()) == 0);
        // Above the diagonal tiles may leave anything; the factorisation reads the lower triangle only.
        for (int j = 0; j < front; ++j)
          for (int i = 0; i < j; ++i) A[j * stride + i] = 0;
        if (expected.empty()) expected = A;
        CHECK(A == expected);
      }
      // The oracle: L L' restores the first columns, and the rest is the Schur complement.
      double largest_error = 0;
      for (int j = 0; j < front; ++j)
        for (int i = j; i < front; ++i) {
          double sum = j < columns ? 0 : expected[j * stride + i];
          for (int k = 0; k < std::min(columns, j + 1); ++k)
            sum += expected[k * stride + i] * expected[k * stride + j];
          largest_error = std::max(largest_error, std::abs(sum - F[j * stride + i]));
        }
      CHECK_NEAR(largest_error, 0, 1e-13 * front);
    }
}

// Breaks when the substitutions with one panel sum in the order of the registers' width, or leave out a row
// at a size that is no multiple of it. The oracle multiplies back by the panel.
TEST(panel_solves_have_the_same_bits_in_every_instruction_set) {
  for (int front : {1, 3, 6, 8, 13, 16, 24, 37, 64, 101})
    for (int columns : {1, 2, 6, 7, front / 2, front}) {
      if (columns < 1 || columns > front) continue;
      const Vector L = front_matrix(front, front, front + columns);
      const Vector own = small::Random(1).vector(columns),
                   below = small::Random(2).vector(front - columns + 1);
      Vector forward, backward;
      for (Isa isa : isas()) {
        Vector y = own, rest(below.size(), 0.0), z = own;
        CALL(isa, panel_forward, L.data(), front, columns, y.data(), rest.data());
        CALL(isa, panel_backward, L.data(), front, columns, z.data(), below.data());
        y.insert(y.end(), rest.begin(), rest.end());
        if (forward.empty()) forward = y, backward = z;
        CHECK(y == forward);
        CHECK(z == backward);
      }
      // L11 y = own, rest = L21 y; L11' z = own - L21' below.
      for (int i = 0; i < front; ++i) {
        double sum = 0;
        for (int k = 0; k < std::min(i + 1, columns); ++k) sum += L[k * front + i] * forward[k];
        CHECK_NEAR(sum, i < columns ? own[i] : forward[i], 1e-12);
      }
      for (int k = 0; k < columns; ++k) {
        double sum = 0;
        for (int i = k; i < front; ++i)
          sum += L[k * front + i] * (i < columns ? backward[i] : below[i - columns]);
        CHECK_NEAR(sum, own[k], 1e-12 * front);
      }
    }
}

// Breaks when scatter, gather or the outer product of stored rows round differently in one instruction set,
// or a row writes to a node that is not its own. The oracle is the plain double loop.
TEST(node_rows_have_the_same_bits_in_every_instruction_set) {
  const int nodes = 5, blocks = 7;
  small::Random random(8);
  std::vector<int> dims, counts, node;
  int rows = 0;
  Vector G;
  for (int b = 0; b < blocks; ++b) {
    dims.push_back(1 + b % 3);
    counts.push_back(b % 4);  // a block on no node, and on up to three
    rows += dims[b];
    for (int s = 0; s < counts[b]; ++s) node.push_back((b + s) % nodes);
    for (int k = 0; k < 8 * dims[b] * counts[b]; ++k) G.push_back(k % 8 < 6 ? random.normal() : 0);
  }
  const NodeRows node_rows{blocks, dims.data(), counts.data(), node.data(), G.data()};
  const Vector z = random.vector(rows), left = random.vector(3 * 24);
  Vector scattered, gathered, block;
  for (Isa isa : isas()) {
    Vector velocity(8 * nodes, 0.0), out(rows), H(4 * 9 + 8, 0.5);
    CALL(isa, scatter_rows, node_rows, z.data(), velocity.data());
    CALL(isa, gather_rows, node_rows, velocity.data(), out.data());
    CALL(isa, add_outer_product, (EightRows{H.data(), 9, 4}), left.data(), left.data() + 8, 24, 3);
    if (scattered.empty()) scattered = velocity, gathered = out, block = H;
    CHECK(velocity == scattered && out == gathered && H == block);
  }
  // f(row, place among the velocities, entry)
  const auto each = [&](auto&& f) {
    for (int b = 0, row = 0, first = 0, at = 0; b < blocks; first += counts[b++])
      for (int i = 0; i < dims[b]; ++i, ++row)
        for (int k = 0; k < 8 * counts[b]; ++k, ++at) f(row, 8 * node[first + k / 8] + k % 8, G[at]);
  };
  Vector expected(8 * nodes, 0.0), expected_out(rows, 0.0);
  each([&](int row, int lane, double g) { expected[lane] += g * z[row]; });
  each([&](int row, int lane, double g) { expected_out[row] += g * expected[lane]; });
  for (std::size_t k = 0; k < expected.size(); ++k) CHECK_NEAR(scattered[k], expected[k], 1e-14);
  for (int i = 0; i < rows; ++i) CHECK_NEAR(gathered[i], expected_out[i], 1e-13);
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 9; ++r) {
      double sum = 0.5;
      for (int i = 0; i < 3 && r < 8; ++i) sum += left[24 * i + r] * left[24 * i + 8 + c];
      CHECK_NEAR(block[9 * c + r], sum, 1e-14);
    }
}
