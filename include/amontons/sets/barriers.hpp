#pragma once
#include <span>
#include <tuple>
#include <vector>

#include "amontons/sets/product.hpp"

namespace amontons {

template <class List>
struct BarrierStorage;
template <class... S>
struct BarrierStorage<SetList<S...>> {
  std::tuple<std::vector<typename S::Barrier>...> of;
};

// The barriers of all blocks of a product, one vector per set, as in the product itself.
class Barriers {
 public:
  // unit: of x, per block (N s).
  void make(const SetProduct& K, std::span<const double> unit) {
    std::apply([](auto&... all) { (all.clear(), ...); }, storage_.of);
    for_each_block(K, [&]<class S>(const S& set, std::size_t block, std::size_t) {
      std::get<kind_of<S>>(storage_.of).emplace_back(set, unit[block]);
    });
  }
  // Calls f(set, barrier, block, row) for every block.
  template <class F>
  void each(const SetProduct& K, F&& f) {
    std::size_t count[set_kinds] = {};
    for_each_block(K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      f(set, std::get<kind_of<S>>(storage_.of)[count[kind_of<S>]++], block, row);
    });
  }

 private:
  BarrierStorage<Sets> storage_;
};

}  // namespace amontons
