// Input of a user is checked here once. Afterwards sizes agree, values are finite, indices exist, A is
// symmetric and its diagonal is not negative, and later code relies on it. Only a factorisation finds out
// whether a matrix is semidefinite (ShiftedSystem); methods that do not factor notice negative curvature
// along their steps. Each check may rely on those before it. A message names the thing by the index that the
// user knows.
#include "amontons/problem/problem.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "amontons/base/error.hpp"
#include "amontons/base/math.hpp"
#include "amontons/base/parts.hpp"
#include "amontons/problem/contact_diagonal.hpp"
#include "amontons/problem/threaded_product.hpp"

namespace amontons {

namespace {

// name(): the description of the values, called only for the message.
template <class Name>
void require_finite(std::span<const double> values, Name&& name) {
  for (std::size_t i = 0; i < values.size(); ++i)
    AMONTONS_REQUIRE(std::isfinite(values[i]), name() + "[" + std::to_string(i) + "] is not finite (" +
                                                   std::to_string(values[i]) + ")");
}

// The pair of entries that differ most, and the largest entry. The difference relative to the whole matrix
// counts, since small entries are often differences of large ones.
struct Asymmetry {
  double difference = 0, largest = 0;
  std::size_t i = 0, j = 0;

  void add(std::size_t row, std::size_t column, double entry, double mirror) {
    largest = std::max({largest, std::abs(entry), std::abs(mirror)});
    if (std::abs(entry - mirror) <= difference) return;
    difference = std::abs(entry - mirror);
    i = row;
    j = column;
  }
};

// asymmetry_of_rounding: the error of matrix products, for example of H'M^-1 H formed in another order.
void require_symmetric(const Asymmetry& worst) {
  if (worst.difference <= asymmetry_of_rounding * worst.largest) return;
  const auto entry = [](std::size_t i, std::size_t j) {
    return "A[" + std::to_string(i) + ", " + std::to_string(j) + "]";
  };
  char relative[32];
  std::snprintf(relative, sizeof relative, "%.1e", worst.difference / worst.largest);
  throw InputError("A is not symmetric: " + entry(worst.i, worst.j) + " and " + entry(worst.j, worst.i) +
                   " differ by " + relative + " of the largest entry; symmetrise it, A = (A + A.T) / 2");
}

// Row i looks up its entry (j, i) in row j. With ascending columns one cursor per row finds it, which only
// moves forward because i ascends: linear time and no transpose. For rows in another order, or with an entry
// in several parts, parts are summed one by one.
Asymmetry asymmetry(const SparseOperator& A) {
  const std::size_t m = A.rows();
  // The canonical format of scipy, which most files have.
  bool ascending = true;
  for (std::size_t i = 0; i < m; ++i)
    for (Index k = A.indptr[i] + 1; k < A.indptr[i + 1]; ++k)
      ascending = ascending && A.indices[k - 1] < A.indices[k];
  const auto sum = [&](Index row, Index column) {
    double value = 0;
    for (Index k = A.indptr[row]; k < A.indptr[row + 1]; ++k)
      if (A.indices[k] == column) value += A.data[k];
    return value;
  };
  std::vector<Index> cursor(A.indptr.begin(), A.indptr.end() - 1);
  const auto next = [&](Index row, Index column) {
    Index& k = cursor[row];
    while (k < A.indptr[row + 1] && A.indices[k] < column) ++k;
    return k < A.indptr[row + 1] && A.indices[k] == column ? A.data[k] : 0.0;
  };
  Asymmetry worst;
  for (Index i = 0; i < static_cast<Index>(m); ++i)
    for (Index k = A.indptr[i]; k < A.indptr[i + 1]; ++k) {
      const Index j = A.indices[k];
      if (ascending)
        worst.add(i, j, A.data[k], next(j, i));
      else
        worst.add(i, j, sum(i, j), sum(j, i));
    }
  return worst;
}

// The structure is checked first, since a wrong indptr would lead out of the arrays, then the values.
void check(const SparseOperator& A) {
  AMONTONS_REQUIRE(!A.indptr.empty() && A.indptr.front() == 0, "A: indptr must start with 0");
  const Index m = static_cast<Index>(A.rows());
  for (Index i = 0; i < m; ++i)
    AMONTONS_REQUIRE(A.indptr[i] <= A.indptr[i + 1], "A: indptr decreases at row " + std::to_string(i));
  AMONTONS_REQUIRE(
      static_cast<std::size_t>(A.indptr[m]) == A.indices.size() && A.indices.size() == A.data.size(),
      "A: indptr ends at " + std::to_string(A.indptr[m]) + " but there are " +
          std::to_string(A.indices.size()) + " indices and " + std::to_string(A.data.size()) + " values");
  for (std::size_t k = 0; k < A.indices.size(); ++k)
    AMONTONS_REQUIRE(A.indices[k] >= 0 && A.indices[k] < m,
                     "A: column index " + std::to_string(A.indices[k]) + " at position " + std::to_string(k) +
                         " is outside 0.." + std::to_string(m - 1));
  require_finite(A.data, [] { return std::string("A.data"); });
  require_symmetric(asymmetry(A));
}

void check(const DenseOperator& A) {
  AMONTONS_REQUIRE(A.data.size() == A.m * A.m, "A: a dense matrix must be square");
  require_finite(A.data, [] { return std::string("A"); });
  Asymmetry worst;
  for (std::size_t i = 0; i < A.m; ++i)
    for (std::size_t j = 0; j <= i; ++j) worst.add(j, i, A.data[j * A.m + i], A.data[i * A.m + j]);
  require_symmetric(worst);
}

// All checks of a function that need no call. The caller is responsible for symmetry.
void check(const CallbackOperator& A) {
  AMONTONS_REQUIRE(static_cast<bool>(A.function), "A: the product function is empty");
  require_finite(A.diag, [] { return std::string("diagonal of A"); });
}

void check_bodies(const Bodies& bodies) {
  AMONTONS_REQUIRE(bodies.inverse_inertia.size() == bodies.size(),
                   "inverse mass: give one inverse inertia per body");
  // The centres only affect the order of bodies in memory; a file need not contain them.
  AMONTONS_REQUIRE(bodies.centre.empty() || bodies.centre.size() == bodies.size(),
                   "centres of mass: give one per body, or none");
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto body = [i] { return "body " + std::to_string(i); };
    AMONTONS_REQUIRE(bodies.inverse_mass[i] >= 0 && std::isfinite(bodies.inverse_mass[i]),
                     body() + ": inverse mass must be finite and not negative");
    const auto& [xx, yy, zz, xy, xz, yz] = bodies.inverse_inertia[i];
    require_finite(bodies.inverse_inertia[i], [&] { return body() + ": inverse inertia"; });
    // Positive semidefinite by all seven principal minors, with room for rounding. A minor of order k is a
    // sum of products of k entries, and is compared with the k-th power of the trace.
    const double scale = xx + yy + zz, eps = 1e-10;
    const double det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    AMONTONS_REQUIRE(xx >= 0 && yy >= 0 && zz >= 0 && xx * yy - xy * xy >= -eps * scale * scale &&
                         xx * zz - xz * xz >= -eps * scale * scale &&
                         yy * zz - yz * yz >= -eps * scale * scale && det >= -eps * scale * scale * scale,
                     body() + ": the inverse inertia is not positive semidefinite");
  }
}

void check_index(Index body, std::size_t bodies, const std::string& where) {
  AMONTONS_REQUIRE(body >= -1 && body < static_cast<Index>(bodies),
                   where + ": body " + std::to_string(body) + " does not exist (there are " +
                       std::to_string(bodies) + "; -1 is the world)");
}

// A row with one body on both sides would lack the product of the two parts in the diagonal and in the
// factorisation. A row on no body at all is allowed and empty.
void check_row(const ContactSystem& A, std::size_t i) {
  const JacobianRow& row = A.jacobian[i];
  const std::string where = "row " + std::to_string(i);
  for (Index body : {row.body_a, row.body_b}) check_index(body, A.bodies.size(), where);
  AMONTONS_REQUIRE(
      row.body_a < 0 || row.body_a != row.body_b,
      where + " joins body " + std::to_string(row.body_a) + " to itself; a row needs two bodies or one");
  require_finite(row.a, [&] { return where + ": jacobian of body a"; });
  require_finite(row.b, [&] { return where + ": jacobian of body b"; });
  AMONTONS_REQUIRE(A.compliance[i] >= 0 && std::isfinite(A.compliance[i]),
                   where + ": compliance must be finite and not negative");
}

// The square of the normal must be 1 to 1e-6, which admits seven written digits; a larger error means that
// the vector was not normalised.
void check_contact(const ContactSystem& A, std::size_t i) {
  const ContactGeometry& c = A.contacts[i];
  const std::string where = "contact " + std::to_string(i);
  for (Index body : {c.body_a, c.body_b}) check_index(body, A.bodies.size(), where);
  AMONTONS_REQUIRE(c.body_a != c.body_b, where + " is between body " + std::to_string(c.body_a) +
                                             " and itself; a contact needs two bodies");
  require_finite(c.r_a.array(), [&] { return where + ": r_a"; });
  require_finite(c.r_b.array(), [&] { return where + ": r_b"; });
  require_finite(c.normal.array(), [&] { return where + ": normal"; });
  require_finite(c.direction.array(), [&] { return where + ": friction direction"; });
  AMONTONS_REQUIRE(std::abs(norm_squared(c.normal) - 1) < 1e-6,
                   where + ": the normal is not a unit vector; normalise it");
  AMONTONS_REQUIRE(c.rows >= 3 && c.rows <= 6, where + ": a contact has 3, 4, 5 or 6 rows");
  AMONTONS_REQUIRE(c.moment_length > 0 && std::isfinite(c.moment_length),
                   where + ": the length of its moments must be positive and finite");
  AMONTONS_REQUIRE(A.contact_compliance[i] >= 0 && std::isfinite(A.contact_compliance[i]),
                   where + ": compliance must be finite and not negative");
}

// Sizes are checked before the loops that rely on them.
void check(const ContactSystem& A) {
  check_bodies(A.bodies);
  AMONTONS_REQUIRE(A.contact_compliance.size() == A.contacts.size(),
                   "contact compliance: give one value per contact");
  AMONTONS_REQUIRE(A.compliance.size() == A.jacobian.size(), "compliance: give one value per row");
  for (std::size_t i = 0; i < A.contacts.size(); ++i) check_contact(A, i);
  for (std::size_t i = 0; i < A.jacobian.size(); ++i) check_row(A, i);
}

// Body-space factorisation and contact passes treat a block as one unit of two bodies. Contacts come first,
// each with a set of its number of rows, then rows, those of one block between the same bodies.
void check_blocks(const ContactSystem& A, const SetProduct& K) {
  const std::size_t contact_rows = A.contact_rows();
  std::size_t contact = 0;
  for_each_block(K, [&]<class S>(const S&, std::size_t, std::size_t row) {
    if (row < contact_rows) {
      const bool fits = S::frictional && contact < A.contacts.size() && A.contacts[contact].rows == S::dim;
      AMONTONS_REQUIRE(fits, "contacts: the cones must start with one friction cone per contact (" +
                                 std::to_string(A.contacts.size()) +
                                 "), of as many rows as the contact has, and contact " +
                                 std::to_string(contact) + " has none");
      ++contact;
      return;
    }
    // A journal or a rope is no contact.
    constexpr bool planar = std::is_same_v<S, PlanarFriction>;
    AMONTONS_REQUIRE(!S::frictional || planar || A.contacts.empty(),
                     "contacts: the cones must start with one friction cone per contact (" +
                         std::to_string(A.contacts.size()) + ") and have none among the joint rows");
    // A friction cone on stored rows: one contact whose arms are not in the file.
    const JacobianRow* first = &A.jacobian[row - contact_rows];
    for (int k = 1; k < S::dim; ++k)
      AMONTONS_REQUIRE(first->body_a == first[k].body_a && first->body_b == first[k].body_b,
                       "rows " + std::to_string(row) + " to " + std::to_string(row + S::dim - 1) +
                           " are one friction cone and must act on the same two bodies in the same order");
  });
}

// docs/algorithm.md (15): per block the mean of diag(A). Blocks that no body carries (zero rows) would cause
// a division by zero; any positive value serves them. 1e-14 of the largest mean is such a value, in the
// units of the problem; 1 if A is zero.
void keep_positive(std::vector<double>& P) {
  double largest = 0;
  for (double p : P) largest = std::max(largest, std::abs(p));
  const double floor = largest > 0 ? 1e-14 * largest : 1.0;
  for (double& p : P) p = std::max(p, floor);
}

// The means of the blocks from `first` on, from the entries of diag(A) of their rows.
void average(const SetProduct& K, std::size_t first, const double* diagonal, std::vector<double>& P) {
  for_each_block(K, [&]<class S>(const S&, std::size_t block, std::size_t) {
    if (block < first) return;
    P[block] = 0;
    for (int k = 0; k < S::dim; ++k) P[block] += *diagonal++ / S::dim;
  });
}

// Contacts are the first blocks, each with a mean of its own: threads share them, and no entry of diag(A) is
// stored for them. Along trees the entries follow from the rows of D M^-1/2, and a matrix has its diagonal:
// their blocks are averaged from all entries.
void make_preconditioner(Problem& problem, unsigned threads) {
  problem.P.resize(problem.K.blocks());
  static thread_local std::vector<double> diag;
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  if (system && !has_trees(problem)) {
    const std::size_t contacts = system->contacts.size();
    for_entries(threads, contacts, [&](std::size_t i) { problem.P[i] = mean_diagonal(*system, i); });
    diag.resize(system->jacobian.size());
    row_diagonal(*system, diag);
    average(problem.K, contacts, diag.data(), problem.P);
  } else {
    diag.resize(problem.rows());
    diagonal(problem.A, diag);
    average(problem.K, 0, diag.data(), problem.P);
  }
  keep_positive(problem.P);
}

}  // namespace

// P from the diagonal, the graph from the bodies: derived data of A and K are made once, here.
void renew(Problem& problem, unsigned threads) {
  auto* system = std::get_if<ContactSystem>(&problem.A);
  if (system) system->renew();
  make_preconditioner(problem, threads);
  if (system) make_contact_graph(*system, problem.K, problem.graph);
}

bool has_trees(const Problem& problem) {
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  return system && linkage_of(*system);
}

// A is symmetric: the product with a unit vector is a row. P stays that of the problem, so that residuals
// agree. There is no graph, as for every matrix: such a problem is one island.
Problem as_matrix(const Problem& problem) {
  const std::size_t m = problem.rows();
  auto data = std::make_shared<std::vector<double>>(m * m);
  std::vector<double> unit(m, 0.0);
  for (std::size_t i = 0; i < m; ++i) {
    unit[i] = 1;
    product(problem.A, unit, std::span(*data).subspan(m * i, m));
    unit[i] = 0;
  }
  return {DenseOperator{*data, m, data}, problem.b, problem.K, problem.P, {}, problem.law};
}

Problem trusted_problem(Operator A, std::vector<double> b, SetProduct K, Law law) {
  Problem problem{std::move(A), std::move(b), std::move(K), {}, {}, law};
  renew(problem, 1);
  return problem;
}

// First A alone, then b and K against A, then their blocks; the diagonal last, as it is formed from all of A.
Problem make_problem(Operator A, std::vector<double> b, SetProduct K, Law law) {
  std::visit([](const auto& op) { check(op); }, A);
  const std::size_t m = rows(A);
  AMONTONS_REQUIRE(b.size() == m,
                   "b has " + std::to_string(b.size()) + " entries but A has " + std::to_string(m) + " rows");
  AMONTONS_REQUIRE(K.rows() == m, "the cones have " + std::to_string(K.rows()) + " rows in all but A has " +
                                      std::to_string(m) + " (a friction cone takes three rows)");
  require_finite(b, [] { return std::string("b"); });
  if (const auto* system = std::get_if<ContactSystem>(&A)) check_blocks(*system, K);
  Problem problem = trusted_problem(std::move(A), std::move(b), std::move(K), law);
  std::vector<double> diag(m);
  diagonal(problem.A, diag);
  double largest = 0;
  for (double d : diag) largest = std::max(largest, std::abs(d));
  for (std::size_t i = 0; i < m; ++i)
    // Zero is allowed (rows that no body carries), and its rounding.
    AMONTONS_REQUIRE(diag[i] >= -1e-12 * largest, "A[" + std::to_string(i) + ", " + std::to_string(i) +
                                                      "] = " + std::to_string(diag[i]) +
                                                      " is negative: A must be positive semidefinite");
  return problem;
}

}  // namespace amontons
