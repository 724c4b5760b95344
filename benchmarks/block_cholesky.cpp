// BlockCholesky against the sparse Cholesky factorisations of Eigen, on a symmetric positive definite matrix
// of 6 x 6 blocks: what every Newton step of a factorising method does in body space.
//
//   block_cholesky MATRIX.mtx [REPEATS]
//
// The matrix is read from Matrix Market (coordinate real symmetric, the lower triangle); block_cholesky.py
// makes it from a problem file. Both sides order by approximate minimum degree, analyse once, and are then
// given the values again and again: times are the fastest of the repeats, which neighbours on the machine
// disturb least. Ours contains the copying of the values into the panels, theirs the permutation, which is
// the same work.
#include "amontons/solvers/linear/block_cholesky.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "amontons/base/isa.hpp"

#if __has_include(<Eigen/SparseCholesky>)
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#define WITH_EIGEN
#endif

namespace {

constexpr int dim = 6;

struct Entry {
  int row, column;
  double value;
};

struct Matrix {
  int rows = 0;
  std::vector<Entry> lower;
};

Matrix read(const char* path) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && line[0] == '%') continue;
  Matrix A;
  int columns = 0;
  std::size_t count = 0;
  if (std::sscanf(line.c_str(), "%d %d %zu", &A.rows, &columns, &count) != 3 || A.rows % dim) {
    std::fprintf(stderr, "%s: not a Matrix Market file of 6 x 6 blocks\n", path);
    std::exit(2);
  }
  for (Entry e; file >> e.row >> e.column >> e.value;) A.lower.push_back({e.row - 1, e.column - 1, e.value});
  return A;
}

template <class F>
double fastest(int repeats, F&& f) {
  double best = INFINITY;
  for (int k = 0; k < repeats; ++k) {
    const auto start = std::chrono::steady_clock::now();
    f();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

struct Times {
  double analyse, factor, solve;
  std::size_t entries;
  std::vector<double> x;
};

void print(const char* name, const Times& t, const Times& ours) {
  double difference = 0, scale = 0;
  for (std::size_t i = 0; i < t.x.size(); ++i) {
    difference = std::max(difference, std::abs(t.x[i] - ours.x[i]));
    scale = std::max(scale, std::abs(ours.x[i]));
  }
  std::printf("%-16s %9.2f %9.3f %9.3f %11zu %8.2f %8.2f %10.1e\n", name, 1e3 * t.analyse, 1e3 * t.factor,
              1e3 * t.solve, t.entries, t.factor / ours.factor, t.solve / ours.solve, difference / scale);
}

Times run_ours(const Matrix& A, const std::vector<double>& b, int repeats) {
  std::set<std::pair<int, int>> pairs;
  for (const Entry& e : A.lower)
    if (e.row / dim != e.column / dim) pairs.emplace(e.row / dim, e.column / dim);
  const std::vector<std::pair<int, int>> edges(pairs.begin(), pairs.end());
  const std::vector<int> sizes(A.rows / dim, dim);
  amontons::BlockCholesky L;
  Times t;
  t.analyse = fastest(3, [&] { L = amontons::BlockCholesky(sizes, edges); });
  L.set_zero();
  for (const Entry& e : A.lower) {
    const auto slot = L.slot(e.row / dim, e.column / dim);
    const int i = slot.transposed ? e.column % dim : e.row % dim,
              j = slot.transposed ? e.row % dim : e.column % dim;
    L.panels()[slot.offset + static_cast<std::size_t>(j) * slot.stride + i] = e.value;
  }
  const std::vector<double> values(L.panels().begin(), L.panels().end());
  t.factor = fastest(repeats, [&] {
    std::copy(values.begin(), values.end(), L.panels().begin());
    L.factor();
  });
  t.solve = fastest(repeats, [&] {
    t.x = b;
    L.solve(t.x);
  });
  t.entries = L.factor_entries();
  return t;
}

#ifdef WITH_EIGEN
template <class Factorisation>
Times run_eigen(const Matrix& A, const std::vector<double>& b, int repeats) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const Entry& e : A.lower) entries.emplace_back(e.row, e.column, e.value);
  Eigen::SparseMatrix<double> lower(A.rows, A.rows);
  lower.setFromTriplets(entries.begin(), entries.end());
  Factorisation L;
  Times t;
  t.analyse = fastest(3, [&] { L.analyzePattern(lower); });
  t.factor = fastest(repeats, [&] { L.factorize(lower); });
  const Eigen::Map<const Eigen::VectorXd> rhs(b.data(), A.rows);
  Eigen::VectorXd x;
  t.solve = fastest(repeats, [&] { x = L.solve(rhs); });
  t.entries = static_cast<std::size_t>(L.matrixL().nestedExpression().nonZeros());
  t.x.assign(x.data(), x.data() + x.size());
  return t;
}
#endif

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: block_cholesky MATRIX.mtx [REPEATS]\n");
    return 2;
  }
  const Matrix A = read(argv[1]);
  const int repeats = argc > 2 ? std::atoi(argv[2]) : 20;
  std::vector<double> b(A.rows);
  for (int i = 0; i < A.rows; ++i) b[i] = std::sin(1.0 + i);
  const char* isa[] = {"baseline", "avx2", "avx512"};
  std::printf("%d rows, %zu entries in the lower triangle, instruction set of BlockCholesky %s\n", A.rows,
              A.lower.size(), isa[static_cast<int>(amontons::active_isa())]);
  std::printf("%-16s %9s %9s %9s %11s %8s %8s %10s\n", "", "analyse", "factor", "solve", "entries of",
              "factor", "solve", "difference");
  std::printf("%-16s %9s %9s %9s %11s %8s %8s %10s\n", "", "ms", "ms", "ms", "the factor", "ratio", "ratio",
              "of x");
  const Times ours = run_ours(A, b, repeats);
  print("BlockCholesky", ours, ours);
#ifdef WITH_EIGEN
  using Sparse = Eigen::SparseMatrix<double>;
  print("SimplicialLLT",
        run_eigen<Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::AMDOrdering<int>>>(A, b, repeats), ours);
  print("SimplicialLDLT",
        run_eigen<Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::AMDOrdering<int>>>(A, b, repeats), ours);
#else
  std::printf("(built without Eigen: nothing to compare with)\n");
#endif
  return 0;
}
