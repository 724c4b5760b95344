#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "amontons/base/host_array.hpp"
#include "amontons/base/threads.hpp"
#include "amontons/problem/problem.hpp"

namespace amontons {

// The arrays of the passes in the layout of a device: component by component, so that neighbouring work items
// read neighbouring numbers. Contacts are in the order of their bodies, bodies along the curve of the fused
// passes. The sum at a body runs over lists of its contacts and rows in ascending order. So no two work items
// add to one number, and every sum has one order.
//
// A vector (x, u, b, d) has size() doubles: component k of contact c at k * stride + c, then the single rows
// from 3 * stride on. Contacts with arms are in world axes, contacts `stored` as rows of D in the frames of
// the file. Strides are multiples of 32 doubles, the lines of a device; padding is zero.
struct DeviceLayout {
  // Fields of `contact` and `row`, `stride` and `row_stride` doubles each: normal, arms from the centres of
  // mass (m; not where stored), mu, P and the metric of accelerated methods (1/kg), compliance E (1/kg).
  enum ContactField { normal = 0, mu = 3, p = 4, aspect = 5, p_t = 6, compliance = 7, arm_a = 8, arm_b = 11 };
  enum RowField { row_p = 0, low = 1, high = 2, row_compliance = 3 };
  // Entries of a list that one work item sums: a body with more entries has several parts.
  static constexpr std::size_t most_entries = 128;

  // Whether the passes support the problem: the sets of ContactIterate, and no constrained bodies.
  static bool fits(const Problem& problem);
  // Copies all data of the passes. threads: as in Options.
  explicit DeviceLayout(const Problem& problem, unsigned threads = 0, HostMemory memory = {});
  // The same of another problem in the same memory. Places and lists stay where the blocks have the same
  // bodies in the same order; each array says whether it changed. No bit depends on the problem before.
  void fill(const Problem& problem, unsigned threads = 0);

  std::size_t contacts = 0, rows = 0, bodies = 0;  // bodies: those that impulses move
  std::size_t stride = 0, row_stride = 0, line_stride = 0;
  bool stored = false, compliant = false;
  std::vector<Index> contact_of, row_of;  // index in the problem, for each place
  HostArray<double> contact, row;
  // The body lines of both sides: contacts A, contacts B (stride each), rows A, rows B (row_stride each).
  // Line 0 is that of the world and of fixed bodies, with zero velocity; bodies have 1, 2, ...
  HostArray<std::uint32_t> line;
  // Rows of D: six components on A, six on B, jacobian_stride() doubles each. For the single rows, or for all
  // components of a vector if contacts are stored.
  HostArray<double> jacobian;
  // 1/m and the inverse inertia (xx yy zz xy xz yz), line_stride doubles each, by line.
  HostArray<double> mass;
  // Lists of the body at line i: contacts contact_list[first[2 i]] .. [first[2 i + 1] - 1], each 2 c + side
  // (1 on B); then rows row_list[first_row[2 i]] .., each twice a component of a vector plus the side. Bodies
  // of several parts have empty lists.
  HostArray<std::uint32_t> first, contact_list, first_row, row_list;
  // Parts: from, to in contact_list and from, to in row_list. Large bodies: line, first part, end part.
  HostArray<std::uint32_t> parts, large;
  // b of the problem, and the x of start(), as vectors of the passes.
  HostArray<double> b, x;

  std::size_t size() const { return 3 * stride + row_stride; }
  std::size_t jacobian_stride() const { return stored ? size() : row_stride; }
  // x = Pi_K(x0) with the mu of the passes; x0 in the order and the frames of the problem, empty: zeros.
  void start(std::span<const double> x0);
  // From the order and frames of the passes to those of the problem.
  void to_user(std::span<const double> held, std::span<double> user) const;

 private:
  // Places of bodies, contacts and rows; whether they differ from those of the last problem.
  bool find_places(const Problem& problem, ThreadPool& pool);
  void make_lists(ThreadPool& pool);
  void cut_long_lists();
  void fill_contacts(const Problem& problem, ThreadPool& pool);
  void fill_rows(const Problem& problem, ThreadPool& pool);
  void fill_masses(const Bodies& bodies, ThreadPool& pool);
  void to_passes(std::span<const double> user, bool project, HostArray<double>& out, ThreadPool& pool);

  HostMemory memory_;
  unsigned threads_ = 0;
  std::vector<std::uint32_t> moving_, line_of_;  // the body of each rank, and the line of each body
  std::vector<ContactGraph::Link> links_;        // of all blocks, those of the problem
  std::vector<std::uint32_t> key_, place_, starts_, row_starts_;  // memory of the sorts
};

}  // namespace amontons
