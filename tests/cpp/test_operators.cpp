#include <algorithm>
#include <cmath>
#include <vector>

#include "amontons/problem/operators.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;
using small::largest, small::Vector;

namespace {

void check_close(const Vector& a, const Vector& b, double tolerance) {
  CHECK(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK_NEAR(a[i], b[i], tolerance * (largest(b) + 1e-300));
}

Vector multiply(const Operator& A, const Vector& x) {
  Vector y(x.size(), NAN);  // a product must write every entry
  product(A, x, y);
  return y;
}

Vector dense_apply(const Vector& A, const Vector& x) {
  Vector y(x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < x.size(); ++j) y[i] += A[i * x.size() + j] * x[j];
  return y;
}

Vector diagonal_of(const Operator& A) {
  Vector d(rows(A), NAN);
  diagonal(A, d);
  return d;
}

// D M^-1 D' + E with full matrices, from the definition. M^-1 is 6n x 6n, D m x 6n.
Vector delassus(const ContactSystem& A) {
  const std::size_t n = 6 * A.bodies.size(), m = A.rows();
  Vector W(n * n), D(m * n), DW(m * n), result(m * m);
  for (std::size_t i = 0; i < A.bodies.size(); ++i) {
    const auto& [xx, yy, zz, xy, xz, yz] = A.bodies.inverse_inertia[i];
    const double I[3][3] = {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
    for (int r = 0; r < 3; ++r) {
      W[(6 * i + r) * n + 6 * i + r] = A.bodies.inverse_mass[i];
      for (int c = 0; c < 3; ++c) W[(6 * i + 3 + r) * n + 6 * i + 3 + c] = I[r][c];
    }
  }
  for (std::size_t i = 0; i < m; ++i)
    for (int k = 0; k < 6; ++k) {
      const JacobianRow& row = A.jacobian[i];
      if (row.body_a >= 0) D[i * n + 6 * row.body_a + k] = row.a[k];
      if (row.body_b >= 0) D[i * n + 6 * row.body_b + k] = row.b[k];
    }
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t k = 0; k < n; ++k) DW[i * n + j] += D[i * n + k] * W[k * n + j];
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < m; ++j) {
      for (std::size_t k = 0; k < n; ++k) result[i * m + j] += DW[i * n + k] * D[j * n + k];
      if (i == j) result[i * m + j] += A.compliance[i];
    }
  return result;
}

// Contacts and joints between random bodies with full inertia tensors, one of them fixed, some sides the
// world.
ContactSystem random_contacts(unsigned seed, int contacts, int joints, int bodies) {
  small::Random random(seed);
  ContactSystem A;
  for (int i = 0; i < bodies; ++i) {
    const Vector I = small::gram_matrix(random, 3, 4);
    A.bodies.inverse_mass.push_back(i == 2 ? 0 : random.uniform(0.1, 3));
    A.bodies.inverse_inertia.push_back({I[0], I[4], I[8], I[1], I[2], I[5]});
    if (i == 2) A.bodies.inverse_inertia.back() = {};
  }
  const auto pick = [&](Index& a, Index& b) {
    a = static_cast<Index>(random.below(bodies));
    b = random.below(4) == 0 ? -1 : static_cast<Index>(random.below(bodies));
    if (a == b) b = -1;
    if (random.below(2)) std::swap(a, b);
  };
  for (int i = 0; i < contacts; ++i) {
    Contact c{};
    pick(c.body_a, c.body_b);
    for (int k = 0; k < 3; ++k)
      c.r_a[k] = random.normal(), c.r_b[k] = random.normal(), c.normal[k] = random.normal();
    c.normal = normalised(c.normal);
    A.contacts.push_back(c);
    A.contact_compliance.push_back(i % 2 ? 0.0 : 0.3);
  }
  for (int i = 0; i < joints; ++i) {
    JacobianRow row{};
    pick(row.body_a, row.body_b);
    for (double& v : row.a) v = random.normal();
    for (double& v : row.b) v = random.normal();
    A.jacobian.push_back(row);
    A.compliance.push_back(i % 3 ? 0.0 : 0.7);
  }
  return A;
}

}  // namespace

// Breaks when any of the five operators is not the matrix it stands for: they all share one matrix here,
// computed from the definition D M^-1 D' + E.
TEST(all_operators_are_the_dense_matrix) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const ContactSystem contacts = random_contacts(seed, 9, 5, 6);
    const ContactSystem stored = contacts.stored();
    const Vector A = delassus(stored);
    const std::size_t m = contacts.rows();
    CHECK(m == 32 && stored.rows() == m);
    CallbackOperator callback{[&](std::span<const double> x, std::span<double> y) {
                                const Vector Ax = dense_apply(A, {x.begin(), x.end()});
                                std::copy(Ax.begin(), Ax.end(), y.begin());
                              },
                              Vector(m, 1.0)};
    const std::vector<Operator> operators{contacts, stored, small::dense_operator(A, m),
                                          small::sparse_operator(A, m), callback};
    Vector expected_diagonal;
    for (std::size_t i = 0; i < m; ++i) expected_diagonal.push_back(A[(m + 1) * i]);
    for (const Operator& op : operators) {
      CHECK(rows(op) == m);
      for (unsigned k = 0; k < 3; ++k) {
        const Vector x = small::Random(10 * seed + k).vector(m);
        check_close(multiply(op, x), dense_apply(A, x), 1e-13);
      }
      if (!std::holds_alternative<CallbackOperator>(op))
        check_close(diagonal_of(op), expected_diagonal, 1e-14);
    }
    CHECK(diagonal_of(callback) == Vector(m, 1.0));
  }
}

// Breaks when a sign, a moment arm or the order (normal, t1, t2) of a contact is wrong. One unit mass at (0,
// 0, 0) with inverse inertia diag(1, 2, 3), touched at r = (0.5, 0, -1) by the ground, n = z. By hand: n
// gives force z and torque r x z = (0, -0.5, 0), so A_nn = 1 + 2 * 0.25.
TEST(contact_by_hand) {
  ContactSystem A;
  small::add_body(A, 1, {1, 0.5, 1.0 / 3});
  A.contacts = {contact_between(0, -1, {0.5, 0, -1}, {0, 0, 0}, {0, 0, 1})};
  A.contact_compliance = {0.25};
  const Vector matrix = small::dense_matrix(A);
  CHECK_NEAR(matrix[0], 1 + 2 * 0.25 + 0.25, 1e-15);
  // The trace over the tangents does not depend on their angle: forces x and y have torques (0, -1, 0) and
  // (1, 0, 0.5).
  CHECK_NEAR(matrix[4] + matrix[8], (1 + 2 * 1.0) + (1 + 1.0 + 3 * 0.25) + 2 * 0.25, 1e-14);
  // The same seen from body B: r_b and the sides exchanged, normal reversed.
  ContactSystem B = A;
  B.contacts = {contact_between(-1, 0, {0, 0, 0}, {0.5, 0, -1}, {0, 0, -1})};
  CHECK_NEAR(small::dense_matrix(B)[0], matrix[0], 1e-15);
}

// Breaks when the tangents are not a right-handed orthonormal frame, above all near n_z = -1 and n_z = 0.
TEST(tangents_complete_the_normal) {
  std::vector<std::array<double, 3>> normals{{0, 0, 1},  {0, 0, -1},   {1, 0, 0},    {-1, 0, 0},   {0, 1, 0},
                                             {0, -1, 0}, {0, 1, -0.0}, {1, 0, -0.0}, {1e-9, 0, -1}};
  small::Random random(2);
  for (int i = 0; i < 500; ++i) {
    std::array<double, 3> n{random.normal(), random.normal(), random.normal()};
    if (i % 5 == 0) n[2] = -1e3;
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (double& v : n) v /= length;
    normals.push_back(n);
  }
  for (const auto& n : normals) {
    const ContactBasis basis(to_vec3(n));
    const std::array<double, 3> t1 = basis.tangent_1.array(), t2 = basis.tangent_2.array();
    const auto dot = [](const auto& a, const auto& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    CHECK_NEAR(dot(t1, t1), 1, 1e-14);
    CHECK_NEAR(dot(t2, t2), 1, 1e-14);
    CHECK_NEAR(dot(n, t1), 0, 1e-15);
    CHECK_NEAR(dot(n, t2), 0, 1e-15);
    CHECK_NEAR(dot(t1, t2), 0, 1e-15);
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      CHECK_NEAR(n[i] * t1[j] - n[j] * t1[i], t2[k], 1e-14);
    }
  }
}

// Breaks when scratch memory survives from one product to the next, or is shared by operators of other sizes.
TEST(products_do_not_remember) {
  const ContactSystem big = random_contacts(1, 9, 5, 6), tiny = random_contacts(2, 2, 1, 3);
  const Vector x = small::Random(1).vector(big.rows()), y = small::Random(2).vector(tiny.rows());
  const Vector first = multiply(big, x), second = multiply(tiny, y);
  CHECK(multiply(big, x) == first);
  CHECK(multiply(tiny, y) == second);
  CHECK(multiply(big, Vector(big.rows(), 0.0)) == Vector(big.rows(), 0.0));
}

// Breaks when a matrix with explicit zeros, repeated entries or empty rows is read wrongly.
TEST(sparse_oddities) {
  const std::vector<Index> indptr{0, 3, 4, 4}, indices{0, 1, 0, 0};
  const Vector data{1, 0, 2, 0};
  const SparseOperator A{indptr, indices, data, nullptr};
  CHECK(multiply(A, {5, 7, 11}) == (Vector{15, 0, 0}));
  CHECK(diagonal_of(A) == (Vector{3, 0, 0}));
}

// Breaks when a matrix that is not symmetric is taken, whatever the order of its columns, or one is refused
// whose halves differ by rounding, or only in the parts (1 + 1) in which an entry is stored.
TEST(symmetry_of_matrices) {
  SetProduct K;
  K.add_count<Bilateral>(2);
  const std::vector<Index> indptr{0, 2, 4}, ascending{0, 1, 0, 1}, descending{1, 0, 1, 0};
  const std::vector<Index> split_indptr{0, 3, 5}, split{0, 1, 1, 0, 1};
  for (const double difference : {0.0, 0.9e-10, 1.1e-10, 1.0}) {
    const double mirror = 2 - 4 * difference;  // 4 is the largest entry
    const Vector up{4, 2, mirror, 4}, down{2, 4, 4, mirror}, parts{4, 1, 1, mirror, 4};
    const Operator matrices[] = {DenseOperator{up, 2, nullptr},
                                 SparseOperator{indptr, ascending, up, nullptr},
                                 SparseOperator{indptr, descending, down, nullptr},
                                 SparseOperator{split_indptr, split, parts, nullptr}};
    for (const Operator& A : matrices)
      if (difference < 1e-10)
        CHECK(make_problem(A, {0, 0}, K).rows() == 2);
      else
        CHECK_THROWS(make_problem(A, {0, 0}, K), "A[0, 1] and A[1, 0] differ by 1");
  }
}

// Breaks when an operator without rows reads the first entry of an empty array.
TEST(empty_operators) {
  const std::vector<Index> indptr{0};
  const std::vector<Operator> operators{ContactSystem{}, ContactSystem{}, DenseOperator{},
                                        SparseOperator{indptr, {}, {}, nullptr}};
  for (const Operator& A : operators) {
    CHECK(rows(A) == 0);
    CHECK(multiply(A, {}).empty());
    CHECK(diagonal_of(A).empty());
  }
}

// The diagonal preconditioner is the mean of diag(A) over each block, positive also where A has zero rows.
// Breaks when a block averages its neighbour's rows, or a zero gets through, by which methods divide.
TEST(preconditioner_is_the_mean_diagonal_of_a_block) {
  for (const small::Case& c : small::contact_cases()) {
    const Problem& p = c.problem;
    const Vector d = diagonal_of(p.A);
    for_each_block(p.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      double mean = 0;
      for (int k = 0; k < S::dim; ++k) mean += d[row + k] / S::dim;
      if (mean > 1e-12)
        CHECK_NEAR(p.P[block], mean, 1e-14 * mean);
      else
        CHECK(p.P[block] > 0);
    });
  }
}
