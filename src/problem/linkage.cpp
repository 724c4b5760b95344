// A tree by its coordinates. Coordinate k moves the bodies beyond it with the twist column[k] per unit rate,
// on top of the motion of parent[k]. So the velocity of a body is a sum of columns along its way from the
// root, and impulses on bodies are summed along the same ways towards it. All sums run over one array,
// because parent[k] < k: downwards in ascending order, upwards in descending order.
//
// M couples k with the coordinates on its way to the root and with those beyond it. Row k stores the former:
// M_kk, M_k,parent[k], ... The s-th entry after the diagonal belongs to the s-th ancestor.
#include "amontons/problem/linkage.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

namespace {

// Parallel axes of one joint, as of a gimbal in its lock, leave one motion without inertia.
//
// Smallest pivot (relative to its diagonal entry of M), far above the rounding of the terms that cancel
// there.
constexpr double least_pivot = 1e-10;

using Six = std::array<double, 6>;

double power(const Six& a, const double* b) {
  return (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5]);
}

// A wrench about the centre of mass, moved to the reference point at -arm from it: the force gains the moment
// arm x force.
Six at_reference(const Six& w, const Vec3& arm) {
  const Vec3 m = cross(arm, {w[0], w[1], w[2]});
  return {w[0], w[1], w[2], w[3] + m.x, w[4] + m.y, w[5] + m.z};
}

}  // namespace

// L'DL from the leaves to the roots. With k the last coordinate and m its row of M without the diagonal d,
//
//   M = (L' D L) with row k of L: m / d, and the rest of M minus m'm / d.
//
// m has entries at ancestors of k only, and two ancestors of k are ancestors of each other: m'm / d changes
// entries that exist. Nothing fills in, whatever the order of branches (Featherstone 2008, ch. 6.5). The
// ancestors of the s-th ancestor are those after it, so that its row is changed by the tail of row k, which
// lies in memory as it does.
void Linkage::factor() {
  inverse_root.resize(coordinates());
  for (std::size_t k = 0; k < coordinates(); ++k) inverse_root[k] = least_pivot * rows[first[k]];
  for (std::size_t k = coordinates(); k-- > 0;) {
    double* own = &rows[first[k]];
    const std::size_t size = first[k + 1] - first[k];
    own[0] = std::max(own[0], inverse_root[k]);
    inverse_root[k] = 1 / std::sqrt(own[0]);
    Index above = parent[k];
    for (std::size_t s = 1; s < size; ++s, above = parent[above]) {
      const double share = own[s] / own[0];
      double* to = &rows[first[above]];
      for (std::size_t t = s; t < size; ++t) to[t - s] -= share * own[t];
    }
    for (std::size_t s = 1; s < size; ++s) own[s] /= own[0];
  }
}

// J'w. Upwards, the wrenches of all bodies beyond a coordinate are summed; their power on its column is the
// impulse along it. Within a run the sum stays in registers.
void Linkage::gather(double* w, double* along) const {
  static thread_local std::vector<Six> sum;
  sum.assign(coordinates(), Six{});
  for (std::size_t i = 0; i < body.size(); ++i) {
    if (last[i] < 0) continue;
    const double* at = &w[6 * i];
    const Six moved = at_reference({at[0], at[1], at[2], at[3], at[4], at[5]}, arm[i]);
    for (int c = 0; c < 6; ++c) sum[last[i]][c] += moved[c];
  }
  Six beyond{};
  for (std::size_t k = coordinates(); k-- > 0;) {
    for (int c = 0; c < 6; ++c) beyond[c] += sum[k][c];
    along[k] = power(column[k], beyond.data());
    if (run[k] > 1) continue;
    if (parent[k] >= 0)
      for (int c = 0; c < 6; ++c) sum[parent[k]][c] += beyond[c];
    beyond = {};
  }
}

// J q'. Downwards, each coordinate adds its column to the twist of the one before. The velocity of a centre
// of mass follows from the twist at the reference point by the arm between them.
void Linkage::spread(const double* rates, double* v) const {
  static thread_local std::vector<Six> twist;
  twist.resize(coordinates());
  Six t{};
  for (std::size_t k = 0; k < coordinates(); ++k) {
    if (run[k] == 1) t = parent[k] < 0 ? Six{} : twist[parent[k]];
    for (int c = 0; c < 6; ++c) t[c] += rates[k] * column[k][c];
    twist[k] = t;
  }
  for (std::size_t i = 0; i < body.size(); ++i) {
    double* to = &v[6 * i];
    if (last[i] < 0) {
      std::fill_n(to, 6, 0.0);
      continue;
    }
    t = twist[last[i]];
    const Vec3 turn = cross({t[3], t[4], t[5]}, arm[i]);
    for (int c = 0; c < 6; ++c) to[c] = t[c] + (c < 3 ? turn[c] : 0);
  }
}

// L^-T upwards, D^-1, L^-1 downwards. The ancestors of k come in the order of row k.
//
// Downwards the next coordinate waits for this one. So the nearest ancestor comes last in its run, and other
// runs have a sum of their own.
void Linkage::solve(double* along) const {
  for (std::size_t k = coordinates(); k-- > 0;) {
    const double* L = &rows[first[k]] + 1;
    const double x = along[k];
    for (Index above = parent[k]; above >= 0; above = parent[above]) along[above] -= *L++ * x;
  }
  for (std::size_t k = 0; k < coordinates(); ++k) {
    double near = 0, far = 0;
    const double* L = &rows[first[k]] + 1;
    for (Index above = parent[k]; above >= 0;) {
      const Index size = run[above];
      double of_run = 0;
      for (Index i = size; i-- > 0;) of_run += L[i] * along[above - i];
      (above == parent[k] ? near : far) += of_run;
      L += size;
      above = parent[above - size + 1];
    }
    along[k] = (along[k] * (inverse_root[k] * inverse_root[k]) - far) - near;
  }
}

void Linkage::move(double* w) const {
  static thread_local std::vector<double> along;
  along.resize(coordinates());
  gather(w, along.data());
  solve(along.data());
  spread(along.data(), w);
}

// Upwards from both bodies. At a common ancestor the wrenches add. Those of a row between bodies of one tree
// cancel there.
template <std::size_t n>
void Linkage::project(const std::array<JacobianRow, n>& row, std::array<double, n>* y,
                      std::vector<Index>& support) const {
  const Index ia = place_of(row[0].body_a), ib = place_of(row[0].body_b);
  Index a = ia < 0 ? -1 : last[ia], b = ib < 0 ? -1 : last[ib];
  std::array<Six, n> on_a{}, on_b{};
  for (std::size_t r = 0; r < n; ++r) {
    if (a >= 0) on_a[r] = at_reference(row[r].a, arm[ia]);
    if (b >= 0) on_b[r] = at_reference(row[r].b, arm[ib]);
  }
  while (a >= 0 || b >= 0) {
    if (a == b) {
      for (std::size_t r = 0; r < n; ++r)
        for (int c = 0; c < 6; ++c) on_a[r][c] += on_b[r][c];
      b = -1;
    }
    const std::array<Six, n>& on = a > b ? on_a : on_b;
    Index& k = a > b ? a : b;
    support.push_back(k);
    for (std::size_t r = 0; r < n; ++r) y[k][r] = power(column[k], on[r].data());
    k = parent[k];
  }
}

// L^-T carries the entries below to the ancestors: forces between two links of a robot move its base. A row
// along a coordinate has one entry to begin with. No sum over the bodies beyond it is needed.
//
// Rows of one contact go the same way, and share every step on it and every entry of L.
template <std::size_t n>
void Linkage::half_solve(const std::array<JacobianRow, n>& row, std::array<double, n>* y,
                         std::vector<Index>& support) const {
  support.clear();
  if (n == 1 && row[0].coordinate >= 0) {
    for (Index k = row[0].coordinate; k >= 0; k = parent[k]) {
      support.push_back(k);
      y[k].fill(0);
    }
    y[support[0]][0] = row[0].scale;
  } else {
    project(row, y, support);
  }
  for (const Index k : support) {
    const double* L = &rows[first[k]] + 1;
    std::array<double, n>& own = y[k];
    for (Index above = parent[k]; above >= 0; above = parent[above], ++L)
      for (std::size_t r = 0; r < n; ++r) y[above][r] -= *L * own[r];
    for (double& entry : own) entry *= inverse_root[k];
  }
}

template void Linkage::half_solve(const std::array<JacobianRow, 1>&, std::array<double, 1>*,
                                  std::vector<Index>&) const;
template void Linkage::half_solve(const std::array<JacobianRow, 3>&, std::array<double, 3>*,
                                  std::vector<Index>&) const;

// row J M^-1 J' row' = |D^-1/2 L^-T (row J)'|^2.
double Linkage::inverse_mass(const JacobianRow& row) const {
  static thread_local std::vector<std::array<double, 1>> y;
  static thread_local std::vector<Index> support;
  y.resize(coordinates());
  half_solve<1>({row}, y.data(), support);
  double sum = 0;
  for (const Index k : support) sum += y[k][0] * y[k][0];
  return sum;
}

}  // namespace amontons
