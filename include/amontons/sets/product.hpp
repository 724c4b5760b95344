#pragma once
#include <cstddef>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "amontons/base/error.hpp"
#include "amontons/sets/sets.hpp"

namespace amontons {

// Consecutive blocks of one kind (the index of the set in `Sets`). Blocks [block, block + count) cover rows
// from `row`; `first` is the index of the first of them among all sets of the kind.
struct SetRun {
  std::size_t kind, count, row, block, first;
};

namespace detail {

template <class List>
struct Storage;
template <class... S>
struct Storage<SetList<S...>> {
  using Tuple = std::tuple<std::vector<S>...>;
  static constexpr std::size_t kinds = sizeof...(S);
  template <class Wanted>
  static constexpr std::size_t kind_of() {
    std::size_t kind = 0, found = kinds;
    ((std::is_same_v<S, Wanted> ? found = kind : 0, ++kind), ...);
    return found;
  }
  // Calls f.template operator()<Set>() for the set with index `kind`.
  template <class F>
  static void visit(std::size_t kind, F&& f) {
    std::size_t k = 0;
    ((k++ == kind ? f.template operator()<S>() : void()), ...);
  }
};

}  // namespace detail

// Calls f.template operator()<S>() with the set of a kind.
template <class F>
void visit_kind(std::size_t kind, F&& f) {
  detail::Storage<Sets>::visit(kind, std::forward<F>(f));
}
template <class S>
inline constexpr std::size_t kind_of = detail::Storage<Sets>::kind_of<S>();
inline constexpr std::size_t set_kinds = detail::Storage<Sets>::kinds;
// The kind with that name, or `set_kinds` if there is none.
std::size_t kind_of_name(std::string_view name);

// K = a product of small sets in the order in which they were added. A block is one set: one row of R, R+ or
// [lo, hi], the rows of a contact (normal, tangent 1, tangent 2, moments).
class SetProduct {
 public:
  // Adds one block with parameters of the user: throws InputError naming the block if they are invalid.
  template <Set S>
  void add(const S& set) {
    const std::string complaint = set.complaint(all<S>().size());
    AMONTONS_REQUIRE(complaint.empty(), complaint);
    append(std::span(&set, 1));
  }
  // The same for many blocks: their parameters in columns of one length, in their order in the set.
  template <Set S, class... Columns>
  void add_each(const Columns&... columns) {
    const std::array<std::span<const double>, sizeof...(columns)> all{columns...};
    add_columns<S>(all);
  }
  template <Set S>
  void add_columns(std::span<const std::span<const double>> columns) {
    std::vector<S> sets;
    for (std::size_t i = 0; i < columns[0].size(); ++i) {
      std::array<double, parameter_count<S>> values;
      for (std::size_t k = 0; k < values.size(); ++k) {
        AMONTONS_REQUIRE(columns[k].size() == columns[0].size(),
                         std::string(S::name) + ": the parameters have " + std::to_string(columns[0].size()) +
                             " and " + std::to_string(columns[k].size()) +
                             " entries; give one of each per block");
        values[k] = columns[k][i];
      }
      sets.push_back(from_parameters<S>(values));
      const std::string complaint = sets.back().complaint(all<S>().size() + i);
      AMONTONS_REQUIRE(complaint.empty(), complaint);
    }
    append(std::span<const S>(sets));
  }
  // Adds blocks without parameters.
  template <Set S>
  void add_count(std::size_t count) {
    static_assert(parameter_count<S> == 0);
    append(std::span<const S>(std::vector<S>(count)));
  }
  // Adds a block without checks, for trusted parameters.
  template <Set S>
  void append(std::span<const S> sets) {
    if (sets.empty()) return;
    std::vector<S>& mine = std::get<std::vector<S>>(sets_);
    if (!runs_.empty() && runs_.back().kind == kind_of<S>)
      runs_.back().count += sets.size();
    else
      runs_.push_back({kind_of<S>, sets.size(), rows_, blocks_, mine.size()});
    mine.insert(mine.end(), sets.begin(), sets.end());
    rows_ += S::dim * sets.size();
    blocks_ += sets.size();
    if (S::frictional) contacts_ += sets.size();
  }
  template <Set S>
  void append(const S& set) {
    append(std::span(&set, 1));
  }
  void append(const SetProduct& other);
  void clear();

  std::size_t rows() const { return rows_; }
  std::size_t blocks() const { return blocks_; }
  std::size_t contacts() const { return contacts_; }  // blocks with friction
  bool all_bilateral() const;                         // K = R^m: the VI is a linear system
  bool has_friction() const;                          // any friction coefficient above zero
  const std::vector<SetRun>& runs() const { return runs_; }
  // All sets of one type, in order.
  template <Set S>
  const std::vector<S>& all() const {
    return std::get<std::vector<S>>(sets_);
  }

 private:
  std::vector<SetRun> runs_;
  detail::Storage<Sets>::Tuple sets_;
  std::size_t rows_ = 0, blocks_ = 0, contacts_ = 0;
};

// Calls f(set, block, row) for every block in order, with the static type of the set, so that the loop over a
// run is compiled for its kind.
template <class F>
inline void for_each_block(const SetProduct& K, F&& f) {
  for (const SetRun& run : K.runs())
    visit_kind(run.kind, [&]<class S>() {
      const S* sets = K.all<S>().data() + run.first;
      for (std::size_t i = 0; i < run.count; ++i) f(sets[i], run.block + i, run.row + S::dim * i);
    });
}

// out = Pi_K(x). x and out may be the same memory; both of K.rows() entries.
void project(const SetProduct& K, std::span<const double> x, std::span<double> out);
// |x - Pi_K(x)|_2, the Euclidean distance to K.
double distance(const SetProduct& K, std::span<const double> x);

}  // namespace amontons
