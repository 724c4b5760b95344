// A row of the problem holds two bodies. A wider one, sum_i J_i v_i with n > 2 bodies, is split over an
// auxiliary body, whose velocity components z_i follow the parts:
//   J_i v_i - z_i = 0 (i < n),   D v = J_n v_n + z_1 + ... + z_(n-1).
// An auxiliary body has six components; if they are used up, their sum is the first component of another one.
// The inertia of z_i, that of the lightest part times `auxiliary_mass`, is added to the
// mechanism, so that each helper has nearly the impulse of the row. z starts at the free J_i v_i, so that it
// only opposes changes by impulses.
//
// Eliminating z shows the error. With M_z = 1 / w the impulses of the parts differ from each other by M_z
// (z_i+ - z_i), at most auxiliary_mass times the impulse of the row. This is the error of the
// momentum. The problem contains only changes of z: c of a link is -z_i, and the row itself has their sum as
// an offset. So a motion that satisfies the row needs no impulse.
#include "multibody/joints/wide_rows.hpp"

#include <algorithm>

#include "multibody/joints/policy.hpp"

namespace amontons {
namespace {

// Velocity components of an auxiliary body.
constexpr std::size_t components = 6;

}  // namespace

void WideRow::add(Index which, const std::array<double, 6>& part, double factor) {
  if (which < 0) return;
  const auto at = static_cast<std::size_t>(std::find(body.begin(), body.end(), which) - body.begin());
  if (at == body.size()) {
    body.push_back(which);
    j.emplace_back();
  }
  for (int k = 0; k < 6; ++k) j[at][k] += factor * part[k];
}

void WideRow::add(const JacobianRow& row, double factor) {
  add(row.body_a, row.a, factor);
  add(row.body_b, row.b, factor);
}

void WideRow::add(const WideRow& row, double factor) {
  for (std::size_t i = 0; i < row.body.size(); ++i) add(row.body[i], row.j[i], factor);
}

void WideRow::scale(double s) {
  for (auto& part : j)
    for (double& x : part) x *= s;
}

double row_velocity(const WideRow& wide, const BodyVelocities& v) {
  double u = 0;
  for (std::size_t i = 0; i < wide.body.size(); ++i) u += power(wide.j[i], v[wide.body[i]]);
  return u;
}

double inverse_effective_mass(const WideRow& wide, const BodyMobilities& bodies) {
  double w = 0;
  for (std::size_t i = 0; i < wide.body.size(); ++i) w += side_inverse_mass(wide.j[i], bodies[wide.body[i]]);
  return w;
}

NarrowRow narrowed(const WideRow& wide, const StepBodies& bodies, double x0, RowTag tag, JointRows& rows) {
  NarrowRow narrow;
  const std::size_t n = wide.body.size();
  if (n == 0) return narrow;
  narrow.row = wide.part(n > 2 ? n - 1 : 0);
  if (n == 2) {
    narrow.row.body_b = wide.body[1];
    narrow.row.b = wide.j[1];
  }
  if (n <= 2) return narrow;
  tag.dof = -1;
  double heaviest = 0;
  for (std::size_t i = 0; i < n; ++i)
    heaviest = std::max(heaviest, side_inverse_mass(wide.j[i], bodies.mobility[wide.body[i]]));
  const auto new_body = [&] {
    rows.auxiliary_inverse_mass.push_back(heaviest / joints::policy.auxiliary_mass);
    return static_cast<Index>(bodies.frames.size() + rows.auxiliary_inverse_mass.size() - 1);
  };
  Index auxiliary = new_body();
  std::size_t used = 0;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    if (used == components) {  // their sum continues in another body
      JacobianRow sum{auxiliary, new_body(), {1, 1, 1, 1, 1, 1}, {-1, 0, 0, 0, 0, 0}};
      auxiliary = sum.body_b;
      used = 1;
      rows.append(Bilateral{}, sum, {0, 0, Restraint::held}, x0, tag);
    }
    JacobianRow link = wide.part(i);
    const double free = row_velocity(link, bodies.free);
    link.body_b = auxiliary;
    link.b[used++] = -1;
    narrow.offset += free;
    rows.append(Bilateral{}, link, {0, -free, Restraint::held}, x0, tag);
  }
  narrow.row.body_b = auxiliary;
  std::fill_n(narrow.row.b.begin(), used, 1.0);
  return narrow;
}

}  // namespace amontons
