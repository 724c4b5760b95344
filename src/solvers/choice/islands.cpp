#include "amontons/solvers/choice/islands.hpp"

#include <algorithm>
#include <chrono>
#include <numeric>

#include "amontons/problem/residual.hpp"

namespace amontons {

namespace {

// Islands of fewer blocks are gathered until there are so many: a solve costs some microseconds to set up.
constexpr std::size_t few = 64;

struct Block {
  std::size_t row, dim;
  Index body_a, body_b;  // world where a body cannot move
  SetKind kind;
  double first, second;  // mu, or lo and hi
};

Block with_cone(const Free&) { return {0, 1, 0, 0, SetKind::free, 0, 0}; }
Block with_cone(const NonNegative&) { return {0, 1, 0, 0, SetKind::nonnegative, 0, 0}; }
Block with_cone(const Interval& set) { return {0, 1, 0, 0, SetKind::interval, set.lo, set.hi}; }
Block with_cone(const Friction& set) { return {0, 3, 0, 0, SetKind::friction, set.mu, 0}; }

void add_cone(const Block& block, SetProduct& K) {
  switch (block.kind) {
    case SetKind::free:
      return K.add_free(1);
    case SetKind::nonnegative:
      return K.add_nonnegative(1);
    case SetKind::interval:
      return K.add_interval({&block.first, 1}, {&block.second, 1});
    case SetKind::friction:
      return K.add_friction({&block.first, 1});
  }
}

std::vector<Block> blocks_of(const ContactOperator& A, const SetProduct& K) {
  const InverseMass& mass = A.joints.inverse_mass;
  const auto moving = [&](Index body) {
    if (body < 0) return body;
    double size = mass.translation[body];
    for (double value : mass.inertia[body]) size += std::abs(value);
    return size > 0 ? body : Index{-1};
  };
  const std::size_t n = A.contacts.size();
  std::vector<Block> blocks;
  blocks.reserve(K.blocks());
  for_each_block(K, [&](const auto& set, std::size_t, std::size_t row) {
    Block block = with_cone(set);
    block.row = row;
    const bool contact = row < 3 * n;
    block.body_a = moving(contact ? A.contacts[row / 3].body_a : A.joints.jacobian[row - 3 * n].body_a);
    block.body_b = moving(contact ? A.contacts[row / 3].body_b : A.joints.jacobian[row - 3 * n].body_b);
    blocks.push_back(block);
  });
  return blocks;
}

// The island of every block, numbered in the order of their first blocks; returns how many there are.
std::size_t find_islands(const std::vector<Block>& blocks, std::size_t bodies, std::vector<Index>& island) {
  std::vector<Index> parent(bodies + 1);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index body) {
    Index i = body < 0 ? static_cast<Index>(bodies) : body;  // blocks without a moving body are one island
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const Block& block : blocks)
    if (block.body_a >= 0 && block.body_b >= 0) parent[root(block.body_a)] = root(block.body_b);
  std::vector<Index> number(bodies + 1, -1);
  Index count = 0;
  island.resize(blocks.size());
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Index& mine = number[root(blocks[k].body_a >= 0 ? blocks[k].body_a : blocks[k].body_b)];
    if (mine < 0) mine = count++;
    island[k] = mine;
  }
  return static_cast<std::size_t>(count);
}

// Turns the islands into groups: large ones alone, small ones together, with and without joints apart.
std::size_t gather(const std::vector<Block>& blocks, std::size_t first_joint_row, std::size_t islands,
                   std::vector<Index>& island) {
  std::vector<std::size_t> size(islands, 0);
  std::vector<unsigned char> jointed(islands, 0);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    ++size[island[k]];
    if (blocks[k].row >= first_joint_row) jointed[island[k]] = 1;
  }
  std::vector<Index> group(islands);
  Index count = 0, open[2] = {-1, -1};
  std::size_t filled[2] = {0, 0};
  for (std::size_t i = 0; i < islands; ++i) {
    const int kind = jointed[i];
    if (size[i] >= few) {
      group[i] = count++;
      continue;
    }
    if (open[kind] < 0 || filled[kind] >= few) open[kind] = count++, filled[kind] = 0;
    group[i] = open[kind];
    filled[kind] += size[i];
  }
  for (Index& i : island) i = group[i];
  return static_cast<std::size_t>(count);
}

struct Part {
  Problem problem;
  std::vector<std::size_t> rows;  // of the whole
};

// The problem of some blocks, its bodies numbered in the order of their appearance.
Part extract(const Problem& whole, const std::vector<Block>& blocks, const std::vector<std::size_t>& members,
             std::vector<Index>& body_number) {
  const auto& A = std::get<ContactOperator>(whole.A);
  const std::size_t first_joint_row = 3 * A.contacts.size();
  Part part;
  ContactOperator sub;
  SetProduct K;
  std::vector<double> b;
  std::vector<Index> bodies;
  const auto local = [&](Index body) {
    if (body < 0) return body;
    if (body_number[body] < 0) {
      body_number[body] = static_cast<Index>(bodies.size());
      bodies.push_back(body);
    }
    return body_number[body];
  };
  for (std::size_t k : members) {
    const Block& block = blocks[k];
    add_cone(block, K);
    for (std::size_t i = 0; i < block.dim; ++i) {
      const std::size_t row = block.row + i;
      part.rows.push_back(row);
      b.push_back(whole.b[row]);
      if (row < first_joint_row) continue;
      JacobianRow jacobian = A.joints.jacobian[row - first_joint_row];
      jacobian.body_a = jacobian.body_a == block.body_a ? local(block.body_a) : Index{-1};
      jacobian.body_b = jacobian.body_b == block.body_b ? local(block.body_b) : Index{-1};
      sub.joints.jacobian.push_back(jacobian);
      sub.joints.compliance.push_back(A.joints.compliance[row - first_joint_row]);
    }
    if (block.row < first_joint_row) {
      ContactFrame contact = A.contacts[block.row / 3];
      contact.body_a = local(block.body_a), contact.body_b = local(block.body_b);
      sub.contacts.push_back(contact);
      sub.contact_compliance.push_back(A.contact_compliance[block.row / 3]);
    }
  }
  for (Index body : bodies) {
    sub.joints.inverse_mass.translation.push_back(A.joints.inverse_mass.translation[body]);
    sub.joints.inverse_mass.inertia.push_back(A.joints.inverse_mass.inertia[body]);
    body_number[body] = -1;
  }
  part.problem = make_problem(std::move(sub), std::move(b), std::move(K));
  return part;
}

// How bad a status is for the whole.
int severity(Status status) {
  switch (status) {
    case Status::converged:
      return 0;
    case Status::iteration_limit:
      return 1;
    case Status::stalled:
      return 2;
    case Status::deadline:
      return 3;
    case Status::infeasible:
      return 4;
    case Status::interrupted:
      return 5;
  }
  return 2;
}

}  // namespace

Solution solve_by_islands(const Problem& problem, const Options& options, Method method) {
  const auto* A = std::get_if<ContactOperator>(&problem.A);
  if (!A || options.history || options.callback) return method(problem, options);
  const std::vector<Block> blocks = blocks_of(*A, problem.K);
  std::vector<Index> island;
  std::size_t count = find_islands(blocks, A->joints.inverse_mass.bodies(), island);
  if (count > 1) count = gather(blocks, 3 * A->contacts.size(), count, island);
  if (count <= 1) return method(problem, options);

  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  std::vector<std::vector<std::size_t>> members(count);
  for (std::size_t k = 0; k < blocks.size(); ++k) members[island[k]].push_back(k);
  std::vector<Index> body_number(A->joints.inverse_mass.bodies(), -1);
  Solution total;
  total.x.assign(problem.rows(), 0.0);
  if (!options.x0.empty()) project(problem.K, options.x0, total.x);
  total.status = Status::converged;
  std::size_t left = blocks.size();
  double worst = -1;
  std::vector<double> x0;
  for (std::size_t i = 0; i < count && total.status != Status::interrupted; ++i) {
    const Part part = extract(problem, blocks, members[i], body_number);
    Options o = options;
    if (!options.x0.empty()) {
      x0.clear();
      for (std::size_t row : part.rows) x0.push_back(options.x0[row]);
      o.x0 = x0;
    }
    // What is left of the time is shared by size.
    o.deadline = std::max(1e-9, options.deadline - elapsed()) * static_cast<double>(members[i].size()) /
                 static_cast<double>(left);
    left -= members[i].size();
    const Solution s = method(part.problem, o);
    for (std::size_t k = 0; k < part.rows.size(); ++k) total.x[part.rows[k]] = s.x[k];
    total.iterations += s.iterations, total.products += s.products;
    total.factorizations += s.factorizations;
    if (severity(s.status) > severity(total.status)) total.status = s.status;
    const double weight = s.residual > options.tolerance ? 1 + s.residual : 0;
    if (weight > worst) worst = weight, total.method = s.method, total.reason = s.reason;
  }
  total.u.resize(problem.rows());
  product(problem.A, total.x, total.u);
  for (std::size_t i = 0; i < total.u.size(); ++i) {
    total.objective += total.x[i] * (0.5 * total.u[i] + problem.b[i]);
    total.u[i] += problem.b[i];
  }
  total.residual = residual(problem, options.law, total.x, total.u);
  if (total.residual <= options.tolerance) total.status = Status::converged;
  total.reason += "; the hardest of " + std::to_string(count) + " groups of islands";
  total.time = elapsed();
  return total;
}

}  // namespace amontons
