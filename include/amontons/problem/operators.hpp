#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <variant>
#include <vector>

namespace amontons {

// The operators A of the VI. All are symmetric positive semidefinite m x m maps from impulses (N s) to
// constraint velocities (m/s). Each offers
//   rows()          m
//   product(x, y)   y = A x, one "product" of the solver's count; x and y do not overlap
//   diagonal(d)     d = diag(A)
// Matrices are viewed, not copied: `owner` keeps the memory alive.

using Index = std::int32_t;  // SciPy's default index type

// Compressed sparse rows of the whole matrix (both triangles).
struct SparseOperator {
  std::span<const Index> indptr, indices;  // m + 1, nnz
  std::span<const double> data;            // nnz
  std::shared_ptr<const void> owner;

  std::size_t rows() const { return indptr.size() - 1; }
  void product(std::span<const double> x, std::span<double> y) const;
  void diagonal(std::span<double> d) const;
};

// Row-major (equivalently column-major: A is symmetric) m x m.
struct DenseOperator {
  std::span<const double> data;  // m * m
  std::size_t m = 0;
  std::shared_ptr<const void> owner;

  std::size_t rows() const { return m; }
  void product(std::span<const double> x, std::span<double> y) const;
  void diagonal(std::span<double> d) const;
};

// A function y = A x of the caller; `diag` is diag(A), or ones when unknown (then P = I).
struct CallbackOperator {
  std::function<void(std::span<const double>, std::span<double>)> function;
  std::vector<double> diag;

  std::size_t rows() const { return diag.size(); }
  void product(std::span<const double> x, std::span<double> y) const { function(x, y); }
  void diagonal(std::span<double> d) const;
};

// Block-diagonal inverse mass: per body 1/m (1/kg) and the inverse inertia tensor at the centre of mass in
// the frame in which the angular velocity is expressed (1/(kg m^2)), stored xx, yy, zz, xy, xz, yz. Zeros
// make a fixed or kinematic body.
struct InverseMass {
  std::vector<double> translation;             // n
  std::vector<std::array<double, 6>> inertia;  // n

  std::size_t bodies() const { return translation.size(); }
  // v[6] = M_i^-1 f[6], (linear, angular)
  void apply(std::size_t body, const double* f, double* v) const;
};

// One row of D: the body-space gradient of a constraint direction, at most two bodies (index -1: the world).
struct JacobianRow {
  Index body_a, body_b;
  std::array<double, 6> a, b;  // (linear, angular) of each body
};

// A = D M^-1 D' + diag(E) from stored rows, never formed. Row i of the operator is rows_[i]; the rows of one
// cone block share their bodies. E >= 0 is the compliance divided by h^2.
struct BodyOperator {
  InverseMass inverse_mass;
  std::vector<JacobianRow> jacobian;
  std::vector<double> compliance;  // m, E

  std::size_t rows() const { return jacobian.size(); }
  void product(std::span<const double> x, std::span<double> y) const;
  void diagonal(std::span<double> d) const;
};

// One frictional contact in world coordinates. A force x_n n + x_t on body A and its opposite on body B; n
// points from B to A. r_a, r_b: from each centre of mass to the contact point (m). body -1 is the world.
struct ContactFrame {
  Index body_a, body_b;
  std::array<double, 3> r_a, r_b, normal;  // normal has unit length
};

// The factored Delassus operator of bodies and contacts: contact blocks of three rows (normal, tangent 1,
// tangent 2) first, then the joint rows. The tangents follow from the normal by contact_tangents().
// Inverse inertias are in world coordinates here.
struct ContactOperator {
  std::vector<ContactFrame> contacts;
  std::vector<double> contact_compliance;  // one E per contact, isotropic
  BodyOperator joints;                     // also holds the bodies; its rows follow the contacts

  std::size_t rows() const { return 3 * contacts.size() + joints.rows(); }
  void product(std::span<const double> x, std::span<double> y) const;
  void diagonal(std::span<double> d) const;
  // The same operator with stored rows, for the methods that factor in body space.
  BodyOperator stored() const;
};

// The two unit tangents that complete `normal` to a right-handed frame (n, t1, t2), a smooth function of n
// except at n_z = 0 sign changes (Duff et al., "Building an orthonormal basis, revisited", JCGT 2017).
void contact_tangents(const std::array<double, 3>& normal, std::array<double, 3>& t1,
                      std::array<double, 3>& t2);

using Operator = std::variant<SparseOperator, DenseOperator, CallbackOperator, BodyOperator, ContactOperator>;

inline std::size_t rows(const Operator& A) {
  return std::visit([](const auto& op) { return op.rows(); }, A);
}
inline void product(const Operator& A, std::span<const double> x, std::span<double> y) {
  std::visit([&](const auto& op) { op.product(x, y); }, A);
}
inline void diagonal(const Operator& A, std::span<double> d) {
  std::visit([&](const auto& op) { op.diagonal(d); }, A);
}

}  // namespace amontons
