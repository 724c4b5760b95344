#include "solvers/first_order/contact_rows.hpp"

#include <cmath>

namespace amontons {

bool has_contact_rows(const Problem& problem, const ContactSystem& A) {
  for (std::size_t i = 0; i < problem.K.contacts(); ++i) {
    if (problem.graph.first_row[i + 1] != static_cast<Index>(3 * (i + 1))) return false;
    const JacobianRow& first = A.jacobian[3 * i];
    for (std::size_t k = 3 * i; k < 3 * (i + 1); ++k) {
      const JacobianRow& row = A.jacobian[k];
      if (row.body_a != first.body_a || row.body_b != first.body_b || A.compliance[k] != A.compliance[3 * i])
        return false;
      for (std::size_t j = 0; j < 3 && row.body_a >= 0 && row.body_b >= 0; ++j)
        if (row.a[j] != -row.b[j]) return false;
    }
  }
  return true;
}

namespace {

Interval bounds_of(const Bilateral&) { return {-INFINITY, INFINITY}; }
Interval bounds_of(const NonNegative&) { return {0, INFINITY}; }
Interval bounds_of(const Interval& set) { return set; }

}  // namespace

std::vector<Interval> row_bounds(const SetProduct& K) {
  std::vector<Interval> bounds;
  for_each_block(K, [&]<class S>(const S& set, std::size_t, std::size_t) {
    if constexpr (S::dim == 1) bounds.push_back(bounds_of(set));
  });
  return bounds;
}

double compliance_of(const ContactSystem& A, std::size_t contact) {
  return A.contacts.empty() ? A.compliance[3 * contact] : A.contact_compliance[contact];
}

void fill_rows(const JacobianRow* row, std::size_t lane, ContactRows& rows) {
  for (int i = 0; i < 3; ++i, ++row)
    for (int k = 0; k < 3; ++k) {
      rows.force[i][k][lane] = row->body_a >= 0 ? row->a[k] : -row->b[k];
      rows.moment_a[i][k][lane] = row->a[k + 3];
      rows.moment_b[i][k][lane] = row->b[k + 3];
    }
}

}  // namespace amontons
