#include "amontons/solvers/choice/islands.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/parts.hpp"
#include "solvers/choice/policy.hpp"

namespace amontons {

namespace {

// Turns islands into groups: large ones alone, small ones together. Small islands of contacts alone, with
// rows of joints and with trees are separate groups, because different methods suit them. Islands are taken
// in the order of their first block, so that groups, and with them the bits of the result, depend only on the
// problem.
std::size_t gather(const ContactSystem& A, const Islands& islands, std::vector<Index>& island) {
  island = islands.of_block;
  std::vector<std::size_t> size(islands.count, 0);
  std::vector<unsigned char> kind(islands.count, 0);
  for (std::size_t block = 0; block < island.size(); ++block) {
    ++size[island[block]];
    if (block >= A.contacts.size()) kind[island[block]] = 1;
  }
  if (A.constrained)
    for (const Index body : A.constrained->body)
      if (const Index home = islands.of_body[body]; home >= 0) kind[home] = 2;
  std::vector<Index> group(islands.count);
  // The open group for small islands of a kind, and its number of blocks; at first all are full.
  Index count = 0, open[3] = {};
  std::size_t filled[3];
  std::fill_n(filled, 3, choice::policy.small_island);
  for (std::size_t i = 0; i < islands.count; ++i) {
    const bool large = size[i] >= choice::policy.small_island;
    if (!large && filled[kind[i]] >= choice::policy.small_island) {
      open[kind[i]] = count++;
      filled[kind[i]] = 0;
    }
    group[i] = large ? count++ : open[kind[i]];
    if (!large) filled[kind[i]] += size[i];
  }
  for (Index& i : island) i = group[i];
  return static_cast<std::size_t>(count);
}

}  // namespace

Solution solve_by_islands(const Problem& problem, const Options& options, Budget& budget, Method method) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || (A->constrained && !A->constrained->linkage) || options.history || options.callback)
    return method(problem, options, budget);
  // A warm start, options and law go to every part. The parts are solved in turn, so that results do not
  // depend on threads, and only the memory of one part is in use at a time.
  const Islands& islands = problem.graph.islands;
  std::vector<Index> island;  // its group, per block
  const std::size_t count = islands.count > 1 ? gather(*A, islands, island) : islands.count;
  if (count <= 1) return method(problem, options, budget);

  const Time start = std::chrono::steady_clock::now();
  std::vector<std::vector<std::size_t>> members(count);
  for (std::size_t block = 0; block < island.size(); ++block) members[island[block]].push_back(block);
  std::vector<Index> body_number;
  Solution total;
  // Rows that an interrupt leaves unsolved keep zero impulses.
  total.x.assign(problem.rows(), 0.0);
  if (!options.x0.empty()) project(problem.K, options.x0, total.x);
  Merging merging(total, options.tolerance);
  std::size_t left = island.size();
  // Small groups first: the unused budget of an easy group is left to those that follow.
  std::stable_sort(members.begin(), members.end(),
                   [](const auto& a, const auto& b) { return a.size() < b.size(); });
  for (std::size_t i = 0; i < count && total.status != Status::interrupted; ++i) {
    // The remaining time and work are shared by size, so that a hard island cannot take all. A group has at
    // least half of an even share: a few bodies beside a large wall need more than their share of contacts.
    const std::size_t blocks = members[i].size();
    const double part_of_rest = std::max(static_cast<double>(blocks) / static_cast<double>(left),
                                         0.5 / static_cast<double>(count - i));
    Part part;
    part.blocks = std::move(members[i]);
    part.make(problem, options.x0, body_number);
    Options o = options;
    o.x0 = part.x0;
    Budget share(budget, part_of_rest * budget.left(), part_of_rest * budget.work_left());
    left -= blocks;
    part.solution = method(part.of.problem, o, share);
    merging.add(part);
  }
  // Measured by a product of the whole problem: the islands together meet the tolerance if each does.
  measure(problem, law_of(problem, options), total);
  if (total.residual <= options.tolerance) total.status = Status::converged;
  total.reason += "; the hardest of " + std::to_string(count) + " groups of islands";
  total.time = seconds_since(start);
  return total;
}

}  // namespace amontons
