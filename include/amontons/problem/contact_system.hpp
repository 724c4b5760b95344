#pragma once
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "amontons/problem/contact.hpp"

namespace amontons {

// Inverse masses, block-diagonal: per body 1/m (1/kg) and the inverse inertia tensor at the centre of mass
// in the frame in which the angular velocity is expressed (1/(kg m^2)), stored xx, yy, zz, xy, xz, yz. Six
// numbers of a body are (linear, angular) everywhere: velocities (v, omega) of the centre of mass, impulses
// (f, tau) at it.
struct Bodies {
  std::vector<double> inverse_mass;
  std::vector<std::array<double, 6>> inverse_inertia;
  std::vector<Vec3> centre;  // of mass, world, m; empty where positions are not known

  std::size_t size() const { return inverse_mass.size(); }
  // Whether impulses move the body: the world (-1) and bodies with zeros throughout are fixed to a solver.
  bool moves(Index body) const;
  // v[6] = M_i^-1 f[6], (linear, angular)
  void apply(std::size_t body, const double* f, double* v) const;
};

// One row of D: the body-space gradient of a constraint direction, at most two bodies (index -1: the world).
struct JacobianRow {
  Index body_a, body_b;
  std::array<double, 6> a, b;  // (linear, angular) of each body
};

// Bodies that rigid joints hold together where the rows of the joints have been eliminated: an impulse at one
// of them moves all, docs/algorithm.md (32).
struct ConstrainedBodies {
  std::vector<Index> body;  // ascending
  // In place, six numbers for each of them: impulses in, velocities out, a symmetric positive semidefinite
  // map. Called by one thread at a time.
  std::function<void(double* w)> apply;
};

// The factored Delassus operator A = D M^-1 D' + E of bodies, contacts and rows: first the rows of the
// contacts, kept as arms and normals in world coordinates, then stored rows of D. A is never formed: it
// would couple all contacts of a body with each other, where D has two bodies per row. Rows of one block of
// the sets share their bodies. E >= 0 is the compliance divided by h^2 (1/kg, as the rest of A).
struct ContactSystem {
  Bodies bodies;
  std::vector<Contact> contacts;
  std::vector<double> contact_compliance;  // one E per contact, isotropic
  std::vector<JacobianRow> jacobian;
  std::vector<double> compliance;  // E, one per stored row
  // In the place of M^-1 for some bodies; null where all are free. diagonal() is that of free bodies, which
  // is at least that of these. First-order methods know it, factorisations do not.
  std::shared_ptr<const ConstrainedBodies> constrained;

  std::size_t contact_rows() const;
  std::size_t rows() const { return contact_rows() + jacobian.size(); }
  void product(std::span<const double> x, std::span<double> y) const;
  void diagonal(std::span<double> d) const;
  // The same operator with all rows stored, for the methods that work row by row.
  ContactSystem stored() const;
};

// Row k of a contact as a row of D.
JacobianRow jacobian_row(const Contact& contact, const ContactBasis& basis, int k);

// w += D'x, w six numbers per body: the impulses at the centres of mass.
void add_impulses(const ContactSystem& A, std::span<const double> x, std::span<double> w);

}  // namespace amontons
