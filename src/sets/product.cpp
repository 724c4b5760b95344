#include "amontons/sets/product.hpp"

#include <cmath>

namespace amontons {

std::size_t kind_of_name(std::string_view name) {
  std::size_t found = set_kinds;
  for (std::size_t kind = 0; kind < set_kinds; ++kind)
    visit_kind(kind, [&]<class S>() {
      if (name == S::name) found = kind;
    });
  return found;
}

void SetProduct::append(const SetProduct& other) {
  for (const SetRun& run : other.runs_)
    visit_kind(run.kind, [&]<class S>() { append(std::span(other.all<S>()).subspan(run.first, run.count)); });
}

void SetProduct::clear() {
  runs_.clear();
  for (std::size_t kind = 0; kind < set_kinds; ++kind)
    visit_kind(kind, [&]<class S>() { std::get<std::vector<S>>(sets_).clear(); });
  rows_ = blocks_ = contacts_ = 0;
}

bool SetProduct::all_bilateral() const {
  for (const SetRun& run : runs_)
    if (run.kind != kind_of<Bilateral>) return false;
  return true;
}

bool SetProduct::has_friction() const {
  bool any = false;
  for_each_block(*this, [&]<class S>(const S& set, std::size_t, std::size_t) {
    if constexpr (S::frictional) any = any || set.has_friction();
  });
  return any;
}

void project(const SetProduct& K, std::span<const double> x, std::span<double> out) {
  for_each_block(K, [&](const auto& set, std::size_t, std::size_t row) { set.project(&x[row], &out[row]); });
}

double distance(const SetProduct& K, std::span<const double> x) {
  double sum = 0;
  for_each_block(K, [&]<class S>(const S& set, std::size_t, std::size_t row) {
    double foot[S::dim];
    set.project(&x[row], foot);
    for (int k = 0; k < S::dim; ++k) sum += (x[row + k] - foot[k]) * (x[row + k] - foot[k]);
  });
  return std::sqrt(sum);
}

}  // namespace amontons
