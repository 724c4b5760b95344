#include "amontons/solvers/choice/islands.hpp"

#include <algorithm>
#include <chrono>

#include "amontons/problem/residual.hpp"

namespace amontons {

namespace {

// Islands of fewer blocks are gathered until there are so many: a solve costs some microseconds to set up.
constexpr std::size_t few = 64;

// Turns islands into groups: large ones alone, small ones together, with and without joints apart.
std::size_t gather(std::size_t contacts, std::size_t islands, std::vector<Index>& island) {
  std::vector<std::size_t> size(islands, 0);
  std::vector<unsigned char> jointed(islands, 0);
  for (std::size_t block = 0; block < island.size(); ++block) {
    ++size[island[block]];
    if (block >= contacts) jointed[island[block]] = 1;
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
    if (open[kind] < 0 || filled[kind] >= few) {
      open[kind] = count++;
      filled[kind] = 0;
    }
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

// The problem of some blocks, its bodies numbered in the order of their appearance. What is copied was
// checked with the whole. `body_number` is scratch, -1 before and after.
class Extraction {
 public:
  Extraction(const Problem& whole, std::vector<Index>& body_number)
      : whole_(whole), A_(std::get<ContactSystem>(whole.A)), number_(body_number) {}

  Part operator()(const std::vector<std::size_t>& members) {
    for (const SetRun& run : whole_.K.runs())
      visit_kind(run.kind, [&]<class S>() { take_run<S>(run, members); });
    for (Index body : bodies_) {
      sub_.bodies.inverse_mass.push_back(A_.bodies.inverse_mass[body]);
      sub_.bodies.inverse_inertia.push_back(A_.bodies.inverse_inertia[body]);
      if (!A_.bodies.centre.empty()) sub_.bodies.centre.push_back(A_.bodies.centre[body]);
      number_[body] = -1;
    }
    part_.problem.graph = contact_graph(sub_, part_.problem.K);
    part_.problem.A = std::move(sub_);
    return std::move(part_);
  }

 private:
  // The members, ascending, that lie in one run of one set.
  template <class S>
  void take_run(const SetRun& run, const std::vector<std::size_t>& members) {
    const auto first = std::lower_bound(members.begin(), members.end(), run.block);
    const auto last = std::lower_bound(first, members.end(), run.block + run.count);
    for (auto block = first; block != last; ++block) {
      const std::size_t i = *block - run.block;
      part_.problem.K.append(whole_.K.all<S>()[run.first + i]);
      part_.problem.P.push_back(whole_.P[*block]);
      take_rows(*block, run.row + S::dim * i, S::dim);
    }
  }

  void take_rows(std::size_t block, std::size_t row, std::size_t dim) {
    const ContactGraph::Link& link = whole_.graph.links[block];
    for (std::size_t i = row; i < row + dim; ++i) {
      part_.rows.push_back(i);
      part_.problem.b.push_back(whole_.b[i]);
    }
    if (block < A_.contacts.size()) {
      Contact contact = A_.contacts[block];
      contact.body_a = local(link.a);
      contact.body_b = local(link.b);
      sub_.contacts.push_back(contact);
      sub_.contact_compliance.push_back(A_.contact_compliance[block]);
      return;
    }
    const std::size_t first_stored = whole_.rows() - A_.jacobian.size();
    for (std::size_t i = row - first_stored; i < row - first_stored + dim; ++i) {
      JacobianRow jacobian = A_.jacobian[i];
      jacobian.body_a = local(link.a);
      jacobian.body_b = local(link.b);
      sub_.jacobian.push_back(jacobian);
      sub_.compliance.push_back(A_.compliance[i]);
    }
  }

  Index local(Index body) {
    if (body < 0) return body;
    if (number_[body] < 0) {
      number_[body] = static_cast<Index>(bodies_.size());
      bodies_.push_back(body);
    }
    return number_[body];
  }

  const Problem& whole_;
  const ContactSystem& A_;
  std::vector<Index>& number_;
  std::vector<Index> bodies_;
  ContactSystem sub_;
  Part part_;
};

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

// What is said of the whole: the sums, and the words of its hardest part.
void add_part(Solution& total, const Solution& s, const Part& part, double tolerance, double& worst) {
  for (std::size_t k = 0; k < part.rows.size(); ++k) total.x[part.rows[k]] = s.x[k];
  total.iterations += s.iterations;
  total.products += s.products;
  total.factorizations += s.factorizations;
  if (severity(s.status) > severity(total.status)) total.status = s.status;
  const double weight = s.residual > tolerance ? 1 + s.residual : 0;
  if (!(weight > worst)) return;
  worst = weight;
  total.method = s.method;
  total.reason = s.reason;
  total.phases = s.phases;
}

}  // namespace

Solution solve_by_islands(const Problem& problem, const Options& options, Method method) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || options.history || options.callback) return method(problem, options);
  std::vector<Index> island;
  std::size_t count = find_islands(problem.graph, island);
  if (count > 1) count = gather(A->contacts.size(), count, island);
  if (count <= 1) return method(problem, options);

  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  std::vector<std::vector<std::size_t>> members(count);
  for (std::size_t block = 0; block < island.size(); ++block) members[island[block]].push_back(block);
  std::vector<Index> body_number(A->bodies.size(), -1);
  Solution total;
  total.x.assign(problem.rows(), 0.0);
  if (!options.x0.empty()) project(problem.K, options.x0, total.x);
  total.status = Status::converged;
  std::size_t left = island.size();
  double worst = -1;
  std::vector<double> x0;
  for (std::size_t i = 0; i < count && total.status != Status::interrupted; ++i) {
    const Part part = Extraction(problem, body_number)(members[i]);
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
    add_part(total, method(part.problem, o), part, options.tolerance, worst);
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
