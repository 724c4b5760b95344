// A tree by its coordinates. Coordinate k moves the bodies beyond it with the twist column[k] per unit rate,
// on top of the motion of parent[k]. So the velocity of a body is a sum of columns along its way from the
// root, and impulses on bodies are summed along the same paths towards it. All sums run over one array,
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

Linkage::Paths Linkage::append_paths(const JacobianRow& row, std::vector<Index>& coordinate) const {
  const auto start = [&](Index i) { return number_of(i) < 0 ? -1 : last[number_of(i)]; };
  const bool along = row.coordinate >= 0;
  const Index a = along ? row.coordinate : start(row.body_a), b = along ? -1 : start(row.body_b);
  // Parents have smaller numbers, so that the larger one cannot be of both.
  Index of_both = a;
  for (Index other = b; of_both != other;) {
    Index& later = of_both > other ? of_both : other;
    later = parent[later];
  }
  const auto append = [&](Index k, Index end) {
    const std::size_t before = coordinate.size();
    for (; k != end; k = parent[k]) coordinate.push_back(k);
    return coordinate.size() - before;
  };
  Paths paths;
  paths.first = append(a, of_both);
  paths.second = append(b, of_both);
  paths.both = append(of_both, -1);
  return paths;
}

// to[0..n) -= a x[0..n), for few numbers: two at a time, as one vector.
static void subtract_scaled(double a, const double* __restrict x, std::size_t n, double* __restrict to) {
  std::size_t i = 0;
  for (; i + 2 <= n; i += 2) {
    to[i] -= a * x[i];
    to[i + 1] -= a * x[i + 1];
  }
  if (i < n) to[i] -= a * x[i];
}

// Where both paths meet, the wrenches add. Those of a row between bodies of one tree cancel there. A row
// along a coordinate has one entry to begin with: no sum over the bodies beyond it is needed.
//
// L^-T carries the entries below to the ancestors: forces between two links of a robot move its base. A row
// of L lies in memory as a path does, but for the coordinates of the other body.
void Linkage::half_solve(const JacobianRow& row, const Paths& paths, const Index* coordinate,
                         double* y) const {
  const std::size_t of_first = paths.first, of_both = paths.first + paths.second, size = paths.size();
  if (row.coordinate >= 0) {
    std::fill_n(y, size, 0.0);
    y[0] = row.scale;
  } else {
    const Index a = number_of(row.body_a), b = number_of(row.body_b);
    Six on_a{}, on_b{};
    if (a >= 0) on_a = at_reference(row.a, arm[a]);
    if (b >= 0) on_b = at_reference(row.b, arm[b]);
    std::size_t s = 0;
    for (; s < of_first; ++s) y[s] = power(column[coordinate[s]], on_a.data());
    for (; s < of_both; ++s) y[s] = power(column[coordinate[s]], on_b.data());
    for (int c = 0; c < 6; ++c) on_a[c] += on_b[c];
    for (; s < size; ++s) y[s] = power(column[coordinate[s]], on_a.data());
  }
  // Entries between those of the first body and those of both.
  const std::size_t apart = paths.second > 0 ? of_first : 0;
  for (std::size_t s = 0; s < size; ++s) {
    const Index k = coordinate[s];
    const double* L = &rows[first[k]] + 1;
    const std::size_t near = (s < apart ? apart : size) - s - 1;
    subtract_scaled(y[s], L, near, y + s + 1);
    if (s < apart) subtract_scaled(y[s], L + near, paths.both, y + of_both);
    y[s] *= inverse_root[k];
  }
}

// row J M^-1 J' row' = |D^-1/2 L^-T (row J)'|^2.
double Linkage::inverse_mass(const JacobianRow& row) const {
  static thread_local std::vector<double> y;
  static thread_local std::vector<Index> coordinate;
  coordinate.clear();
  const Paths paths = append_paths(row, coordinate);
  y.resize(paths.size());
  half_solve(row, paths, coordinate.data(), y.data());
  double sum = 0;
  for (const double entry : y) sum += entry * entry;
  return sum;
}

}  // namespace amontons
