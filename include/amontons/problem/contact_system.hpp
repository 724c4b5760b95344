#pragma once
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "amontons/base/parts.hpp"
#include "amontons/problem/contact.hpp"
#include "amontons/problem/jacobian_row.hpp"

namespace amontons {

// Inverse masses, block-diagonal. Per body: 1/m (1/kg), and the inverse inertia tensor at the centre of mass
// in the frame of the angular velocity (1/(kg m^2)), stored xx, yy, zz, xy, xz, yz. The six numbers of a body
// are (linear, angular) everywhere: velocities (v, omega) of the centre of mass, impulses (f, tau) at it.
struct Bodies {
  std::vector<double> inverse_mass;
  std::vector<std::array<double, 6>> inverse_inertia;
  std::vector<Vec3> centre;  // of mass, world, m; empty if positions are unknown

  std::size_t size() const { return inverse_mass.size(); }
  // Whether impulses move the body. The world (-1) and bodies with only zeros are fixed.
  bool moves(Index body) const;
  // v[6] = M_i^-1 f[6], (linear, angular)
  void apply(std::size_t body, const double* f, double* v) const;
};

struct Linkage;  // bodies in coordinates of the joints between them, problem/linkage.hpp

// Bodies connected by rigid joints that have no rows, or whose rows have been eliminated: an impulse at one
// of them moves all, docs/algorithm.md (31).
struct ConstrainedBodies {
  std::vector<Index> body;  // ascending
  // In place, six numbers per body: from impulses to velocities, a symmetric positive semidefinite map.
  // Called by one thread at a time.
  std::function<void(double* w)> apply;
  // If the bodies are those of trees; null if `apply` is any other map.
  std::shared_ptr<const Linkage> linkage = {};
};

// Rows of D M^-1/2 on trees (Linkage::half_solve), row by row: nonzeros of row i are [first[i], first[i +
// 1]). `whole`: all bodies that these rows move are of trees, so that A = Y'Y + E with the rows of Y.
struct HalfRows {
  std::vector<std::size_t> first;
  std::vector<Index> coordinate;
  std::vector<double> value;
  bool whole = false;
};

// The factored Delassus operator A = D M^-1 D' + E of bodies, contacts and rows. The rows of the contacts
// come first, stored as arms and normals in world coordinates, then stored rows of D. A is never formed: it
// would couple all contacts of a body, while a row of D has two bodies. Rows of one block of the sets share
// their bodies. E >= 0 is the compliance divided by h^2 (1/kg, as the rest of A).
struct ContactSystem {
  Bodies bodies;
  std::vector<ContactGeometry> contacts;
  std::vector<double> contact_compliance;  // one E per contact, isotropic
  std::vector<JacobianRow> jacobian;
  std::vector<double> compliance;  // E, one per stored row
  // Replaces M^-1 for some bodies; null if all are free. Without a linkage, diagonal() is that of free
  // bodies, an upper bound for these. First-order methods and the direct way support it, other factorisations
  // do not.
  std::shared_ptr<const ConstrainedBodies> constrained;
  HalfRows half;  // of all rows, by renew(); empty without a linkage

  std::size_t contact_rows() const;
  std::size_t rows() const { return contact_rows() + jacobian.size(); }
  void product(std::span<const double> x, std::span<double> y) const;
  void diagonal(std::span<double> d) const;
  // Makes `half` after rows, bodies or the linkage have changed.
  void renew();
  // The same operator with all rows stored, for methods that process row by row.
  ContactSystem stored() const;
};

// The trees of a system; null if it has none.
inline const Linkage* linkage_of(const ContactSystem& A) {
  return A.constrained ? A.constrained->linkage.get() : nullptr;
}

// Row k of a contact as a row of D.
JacobianRow jacobian_row(const ContactGeometry& contact, const ContactBasis& basis, int k);

// w += D'x, w six numbers per body: the impulses at the centres of mass.
void add_impulses(const ContactSystem& A, std::span<const double> x, std::span<double> w);

// w = M^-1 w in place: velocities that impulses at the centres of mass cause.
// `rates`: M^-1 J'w along the coordinates of the trees, if they are known already. Those of trees are all
// moved, of the others those visited.
void apply_masses(const ContactSystem& A, std::span<double> w, const double* rates = nullptr,
                  const Subset& visited = {});

}  // namespace amontons
