#include "solvers/linear/small_roots.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

std::array<double, 6> semidefinite_root(const std::array<double, 6>& s) {
  const auto& [xx, yy, zz, xy, xz, yz] = s;
  const double tiny = 1e-14 * (xx + yy + zz);
  const auto root = [&](double v) { return v > tiny ? std::sqrt(v) : 0.0; };
  const auto ratio = [](double v, double pivot) { return pivot > 0 ? v / pivot : 0.0; };
  const double c00 = root(xx), c10 = ratio(xy, c00), c20 = ratio(xz, c00);
  const double c11 = root(yy - c10 * c10), c21 = ratio(yz - c20 * c10, c11);
  return {c00, c11, root(zz - c20 * c20 - c21 * c21), c10, c20, c21};
}

void times_root(const std::array<double, 6>& j, double translation, const std::array<double, 6>& c,
                double* out) {
  for (int k = 0; k < 3; ++k) out[k] = j[k] * translation;
  out[3] = j[3] * c[0] + j[4] * c[3] + j[5] * c[4];
  out[4] = j[4] * c[1] + j[5] * c[5];
  out[5] = j[5] * c[2];
}

void root_times(double translation, const std::array<double, 6>& c, const double* v, double* out) {
  for (int k = 0; k < 3; ++k) out[k] = translation * v[k];
  out[5] = c[4] * v[3] + c[5] * v[4] + c[2] * v[5];
  out[4] = c[3] * v[3] + c[1] * v[4];
  out[3] = c[0] * v[3];
}

void compliance_root(const double* R, int dim, double e, double* L) {
  std::fill(L, L + dim * dim, 0.0);
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j <= i; ++j) {
      double s = i == j;
      for (int k = 0; k < dim; ++k) s += e * R[dim * k + i] * R[dim * k + j];
      for (int k = 0; k < j; ++k) s -= L[dim * i + k] * L[dim * j + k];
      L[dim * i + j] = i == j ? std::sqrt(s) : s / L[dim * j + j];
    }
}

}  // namespace amontons
