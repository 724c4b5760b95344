// Private: the place of contacts, joint rows and bodies in the memory of the fused passes.
#pragma once
#include <cstdint>
#include <vector>

#include "amontons/problem/problem.hpp"
#include "solvers/first_order/pass_data.hpp"

namespace amontons {

// The layout. Chunks, batches and lines depend only on the problem, never on the number of threads, because
// they determine the order of every sum and so each bit of a result.
//
// A lane is one place of a batch of eight; lane l of batch i has the number 8 i + l. A line is the place of
// one body in the working velocities `lines`. A chunk has lines of its own for all bodies that it touches. A
// body at the border of chunks, or a hub, therefore has several lines, its copies.
struct ContactLayout {
  std::vector<Chunk> chunks;
  std::vector<Index> contact;                 // per lane, 8 per batch; -1 for an inert lane
  std::vector<std::uint32_t> line_a, line_b;  // per lane
  // Rows of the joint operator in the order of the passes, 8 per batch, and their lines; -1 for an inert one.
  std::vector<Index> joint_row;
  std::vector<std::uint32_t> joint_line_a, joint_line_b;
  std::vector<Index> body;  // per line; -1 for the dummy of a chunk and for padding
  // Bodies with more than one line: lines copies[first_copy[i]] .. copies[first_copy[i + 1] - 1], ascending.
  std::vector<std::uint32_t> first_copy, copies;

  std::size_t batches() const { return contact.size() / lanes; }
  std::size_t joint_batches() const { return joint_row.size() / lanes; }
};

// `contacts`: number of leading blocks that are contacts, given by geometry or as rows of D.
ContactLayout lay_out(const ContactSystem& A, const ContactGraph& graph, std::size_t contacts);

}  // namespace amontons
