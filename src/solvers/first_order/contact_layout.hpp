// Private: where contacts, joint rows and bodies go in the memory of the fused passes.
#pragma once
#include <cstdint>
#include <vector>

#include "amontons/problem/problem.hpp"
#include "solvers/first_order/pass_data.hpp"

namespace amontons {

// The assignment. Chunks, batches and lines follow from the problem alone, never from the number of threads:
// the order of every sum, and with it each bit of a result, depends on them.
//
// A lane is one place of a batch of eight; lane l of batch i has the number 8 i + l. A line is the place of
// one body in the working velocities `lines`; a chunk has lines of its own for all bodies that it touches,
// so that a body at the border of chunks, or a hub, has several, its copies.
struct ContactLayout {
  std::vector<Chunk> chunks;
  std::vector<Index> contact;                 // of each lane, 8 per batch; -1 for an inert lane
  std::vector<std::uint32_t> line_a, line_b;  // of each lane
  // Rows of the joint operator in the order of the passes, 8 per batch, and their lines; -1 for an inert one.
  std::vector<Index> joint_row;
  std::vector<std::uint32_t> joint_line_a, joint_line_b;
  std::vector<Index> body;  // of each line; -1 for the dummy of a chunk and for filling
  // Bodies with more than one line: lines copies[first_copy[i]] .. copies[first_copy[i + 1] - 1], ascending.
  std::vector<std::uint32_t> first_copy, copies;

  std::size_t batches() const { return contact.size() / lanes; }
  std::size_t joint_batches() const { return joint_row.size() / lanes; }
};

// `contacts`: how many of the blocks, the first, are contacts, whether given as such or as rows of D.
ContactLayout lay_out(const ContactSystem& A, const ContactGraph& graph, std::size_t contacts);

}  // namespace amontons
