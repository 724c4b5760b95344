#pragma once
#include <memory>
#include <span>
#include <vector>

#include "amontons/problem/problem.hpp"

namespace amontons {

// Some islands as a problem of their own, with bodies numbered in the order of their appearance. The part
// has the trees on whose bodies its blocks act, with coordinates in their order.
struct IslandPart {
  Problem problem;
  // Row and body of the whole problem for every row and body of the part: x_part[k] = x[rows[k]].
  std::vector<std::size_t> rows;
  std::vector<Index> bodies;
  std::shared_ptr<ConstrainedBodies> trees;  // shared with the problem if it has any

  // Rows of an array of the whole, and back.
  void take(std::span<const double> whole, std::vector<double>& part) const {
    part.resize(rows.size());
    for (std::size_t k = 0; k < part.size(); ++k) part[k] = whole[rows[k]];
  }
  void put(std::span<const double> part, std::span<double> whole) const {
    for (std::size_t k = 0; k < part.size(); ++k) whole[rows[k]] = part[k];
  }
};
// The part of some blocks, ascending, of a ContactSystem, which must be whole islands. Bodies are free or of
// trees. The arrays of `part` keep their memory. `body_number` is scratch, -1 or empty before and -1 after:
// one for all parts, so that the cost of many parts is linear in the whole.
void extract(const Problem& whole, std::span<const std::size_t> members, std::vector<Index>& body_number,
             IslandPart& part);

}  // namespace amontons
