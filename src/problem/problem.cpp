#include "amontons/problem/problem.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "amontons/base/error.hpp"
#include "amontons/base/math.hpp"

namespace amontons {

namespace {

// name(): what the values are, called for the message only.
template <class Name>
void require_finite(std::span<const double> values, Name&& name) {
  for (std::size_t i = 0; i < values.size(); ++i)
    AMONTONS_REQUIRE(std::isfinite(values[i]), name() + "[" + std::to_string(i) + "] is not finite (" +
                                                   std::to_string(values[i]) + ")");
}

// The pair of entries that differ most, and the largest entry.
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

// Row i asks row j for its entry (j, i). With ascending columns a cursor per row finds it that only moves
// forward, because i ascends: linear time and no transpose. Rows in another order, or with an entry in
// several parts, are summed one by one.
Asymmetry asymmetry(const SparseOperator& A) {
  const std::size_t m = A.rows();
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

void check(const CallbackOperator& A) {
  AMONTONS_REQUIRE(static_cast<bool>(A.function), "A: the product function is empty");
  require_finite(A.diag, [] { return std::string("diagonal of A"); });
}

void check_bodies(const BodyOperator& A) {
  const InverseMass& mass = A.inverse_mass;
  AMONTONS_REQUIRE(mass.inertia.size() == mass.bodies(), "inverse mass: give one inverse inertia per body");
  for (std::size_t i = 0; i < mass.bodies(); ++i) {
    const auto body = [i] { return "body " + std::to_string(i); };
    AMONTONS_REQUIRE(mass.translation[i] >= 0 && std::isfinite(mass.translation[i]),
                     body() + ": inverse mass must be finite and not negative");
    const auto& [xx, yy, zz, xy, xz, yz] = mass.inertia[i];
    require_finite(mass.inertia[i], [&] { return body() + ": inverse inertia"; });
    // Positive semidefinite by its principal minors (with room for rounding).
    const double scale = xx + yy + zz, eps = 1e-10;
    const double det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    AMONTONS_REQUIRE(xx >= 0 && yy >= 0 && zz >= 0 && xx * yy - xy * xy >= -eps * scale * scale &&
                         xx * zz - xz * xz >= -eps * scale * scale &&
                         yy * zz - yz * yz >= -eps * scale * scale && det >= -eps * scale * scale * scale,
                     body() + ": the inverse inertia is not positive semidefinite");
  }
  AMONTONS_REQUIRE(A.compliance.size() == A.rows(), "compliance: give one value per row");
  const Index n = static_cast<Index>(mass.bodies());
  for (std::size_t i = 0; i < A.rows(); ++i) {
    const JacobianRow& row = A.jacobian[i];
    const auto where = [i] { return "row " + std::to_string(i); };
    for (Index body : {row.body_a, row.body_b})
      AMONTONS_REQUIRE(body >= -1 && body < n, where() + ": body " + std::to_string(body) +
                                                   " does not exist (there are " + std::to_string(n) +
                                                   "; -1 is the world)");
    AMONTONS_REQUIRE(
        row.body_a < 0 || row.body_a != row.body_b,
        where() + " joins body " + std::to_string(row.body_a) + " to itself; a row needs two bodies or one");
    require_finite(row.a, [&] { return where() + ": jacobian of body a"; });
    require_finite(row.b, [&] { return where() + ": jacobian of body b"; });
    AMONTONS_REQUIRE(A.compliance[i] >= 0 && std::isfinite(A.compliance[i]),
                     where() + ": compliance must be finite and not negative");
  }
}

void check(const BodyOperator& A) { check_bodies(A); }

void check(const ContactOperator& A) {
  check_bodies(A.joints);
  AMONTONS_REQUIRE(A.contact_compliance.size() == A.contacts.size(),
                   "contact compliance: give one value per contact");
  const Index n = static_cast<Index>(A.joints.inverse_mass.bodies());
  for (std::size_t c = 0; c < A.contacts.size(); ++c) {
    const ContactFrame& contact = A.contacts[c];
    const auto where = [c] { return "contact " + std::to_string(c); };
    for (Index body : {contact.body_a, contact.body_b})
      AMONTONS_REQUIRE(body >= -1 && body < n, where() + ": body " + std::to_string(body) +
                                                   " does not exist (there are " + std::to_string(n) +
                                                   "; -1 is the world)");
    AMONTONS_REQUIRE(contact.body_a != contact.body_b, where() + " is between body " +
                                                           std::to_string(contact.body_a) +
                                                           " and itself; a contact needs two bodies");
    require_finite(contact.r_a, [&] { return where() + ": r_a"; });
    require_finite(contact.r_b, [&] { return where() + ": r_b"; });
    require_finite(contact.normal, [&] { return where() + ": normal"; });
    const auto& [x, y, z] = contact.normal;
    AMONTONS_REQUIRE(std::abs(x * x + y * y + z * z - 1) < 1e-6,
                     where() + ": the normal is not a unit vector; normalise it");
    AMONTONS_REQUIRE(A.contact_compliance[c] >= 0 && std::isfinite(A.contact_compliance[c]),
                     where() + ": compliance must be finite and not negative");
  }
}

// Body-space factorisation and contact passes handle a friction block as one unit of two bodies.
void check_blocks(const Operator& A, const SetProduct& K) {
  if (const auto* op = std::get_if<BodyOperator>(&A))
    for_each_block(K, [&]<class Set>(const Set&, std::size_t, std::size_t row) {
      for (int k = 1; k < Set::dim; ++k)
        AMONTONS_REQUIRE(op->jacobian[row].body_a == op->jacobian[row + k].body_a &&
                             op->jacobian[row].body_b == op->jacobian[row + k].body_b,
                         "rows " + std::to_string(row) + " to " + std::to_string(row + 2) +
                             " are one friction cone and must act on the same two bodies in the same order");
    });
  if (const auto* op = std::get_if<ContactOperator>(&A)) {
    const std::size_t n = op->contacts.size();
    const bool contacts_first =
        n == 0 || (K.runs().front().kind == SetKind::friction && K.runs().front().count == n);
    AMONTONS_REQUIRE(contacts_first && K.contacts() == n,
                     "contacts: the cones must start with one friction cone per contact (" +
                         std::to_string(n) + ") and have none among the joint rows");
  }
}

}  // namespace

Problem make_problem(Operator A, std::vector<double> b, SetProduct K) {
  std::visit([](const auto& op) { check(op); }, A);
  const std::size_t m = rows(A);
  AMONTONS_REQUIRE(b.size() == m,
                   "b has " + std::to_string(b.size()) + " entries but A has " + std::to_string(m) + " rows");
  AMONTONS_REQUIRE(K.rows() == m, "the cones have " + std::to_string(K.rows()) + " rows in all but A has " +
                                      std::to_string(m) + " (a friction cone takes three rows)");
  require_finite(b, [] { return std::string("b"); });
  check_blocks(A, K);

  std::vector<double> diag(m), P(K.blocks());
  diagonal(A, diag);
  double largest = 0;
  for (std::size_t i = 0; i < m; ++i) largest = std::max(largest, std::abs(diag[i]));
  for (std::size_t i = 0; i < m; ++i)
    AMONTONS_REQUIRE(diag[i] >= -1e-12 * largest, "A[" + std::to_string(i) + ", " + std::to_string(i) +
                                                      "] = " + std::to_string(diag[i]) +
                                                      " is negative: A must be positive semidefinite");
  // Blocks that no body carries (zero rows) would divide by zero: any positive value serves them.
  const double floor = largest > 0 ? 1e-14 * largest : 1.0;
  for_each_block(K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
    double mean = 0;
    for (int k = 0; k < Set::dim; ++k) mean += diag[row + k] / Set::dim;
    P[block] = std::max(mean, floor);
  });
  return {std::move(A), std::move(b), std::move(K), std::move(P)};
}

}  // namespace amontons
