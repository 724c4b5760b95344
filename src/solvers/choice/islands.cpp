#include "amontons/solvers/choice/islands.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "solvers/choice/policy.hpp"

namespace amontons {

namespace {

// Turns islands into groups: large ones alone, small ones together. Small islands with and without joints are
// separate groups, because different methods suit them. Islands are taken in the order of their first block,
// so that groups, and with them the bits of the result, depend only on the problem.
std::size_t gather(std::size_t contacts, std::size_t islands, std::vector<Index>& island) {
  std::vector<std::size_t> size(islands, 0);
  std::vector<unsigned char> jointed(islands, 0);
  for (std::size_t block = 0; block < island.size(); ++block) {
    ++size[island[block]];
    if (block >= contacts) jointed[island[block]] = 1;
  }
  std::vector<Index> group(islands);
  // The open group for small islands without and with joints, and its number of blocks; at first both are
  // full.
  Index count = 0, open[2] = {};
  std::size_t filled[2] = {choice::small_island, choice::small_island};
  for (std::size_t i = 0; i < islands; ++i) {
    const int kind = jointed[i];
    const bool large = size[i] >= choice::small_island;
    if (!large && filled[kind] >= choice::small_island) {
      open[kind] = count++;
      filled[kind] = 0;
    }
    group[i] = large ? count++ : open[kind];
    if (!large) filled[kind] += size[i];
  }
  for (Index& i : island) i = group[i];
  return static_cast<std::size_t>(count);
}

// Blocks keep their order, contacts before joints, which is the order of the rows of a ContactSystem. The
// data were checked with the whole problem, so make_problem is not called. P is that of the whole, and the
// pattern of rows and bodies is that of its links.
class Extraction {
 public:
  Extraction(const Problem& whole, std::vector<Index>& body_number, IslandPart& part)
      : whole_(whole), A_(std::get<ContactSystem>(whole.A)), number_(body_number), part_(part) {
    number_.resize(A_.bodies.size(), -1);
    part_.rows.clear();
    part_.bodies.clear();
    Problem& p = part_.problem;
    if (!std::holds_alternative<ContactSystem>(p.A)) p.A = ContactSystem{};
    p.b.clear();
    p.K.clear();
    p.P.clear();
    sub_ = &std::get<ContactSystem>(p.A);
    sub_->contacts.clear();
    sub_->contact_compliance.clear();
    sub_->jacobian.clear();
    sub_->compliance.clear();
    sub_->bodies.inverse_mass.clear();
    sub_->bodies.inverse_inertia.clear();
    sub_->bodies.centre.clear();
    sub_->constrained = A_.constrained;
  }

  void take(std::span<const std::size_t> members) {
    for (const SetRun& run : whole_.K.runs())
      visit_kind(run.kind, [&]<class S>() { take_run<S>(run, members); });
    if (A_.constrained) return keep_bodies();
    for (Index body : part_.bodies) {
      sub_->bodies.inverse_mass.push_back(A_.bodies.inverse_mass[body]);
      sub_->bodies.inverse_inertia.push_back(A_.bodies.inverse_inertia[body]);
      if (!A_.bodies.centre.empty()) sub_->bodies.centre.push_back(A_.bodies.centre[body]);
      number_[body] = -1;
    }
    finish();
  }

 private:
  void finish() {
    part_.problem.law = whole_.law;
    make_contact_graph(*sub_, part_.problem.K, part_.problem.graph);
  }

  // The linkage of trees names bodies by their numbers, and the problem shares it. So bodies keep their
  // numbers, and those without a row in the part get no impulse. Rows of D M^-1/2 depend on nothing but the
  // row and its tree: they are copied and not made again.
  void keep_bodies() {
    sub_->bodies = A_.bodies;
    HalfRows& half = sub_->half;
    half.first.assign(1, 0);
    half.coordinate.clear();
    half.value.clear();
    for (const std::size_t row : part_.rows) {
      for (std::size_t i = A_.half.first[row]; i < A_.half.first[row + 1]; ++i) {
        half.coordinate.push_back(A_.half.coordinate[i]);
        half.value.push_back(A_.half.value[i]);
      }
      half.first.push_back(half.value.size());
    }
    finish();
  }

  // The members, ascending, that lie in one run of sets of one kind.
  template <class S>
  void take_run(const SetRun& run, std::span<const std::size_t> members) {
    const auto first = std::lower_bound(members.begin(), members.end(), run.block);
    const auto last = std::lower_bound(first, members.end(), run.block + run.count);
    for (auto block = first; block != last; ++block) {
      const std::size_t i = *block - run.block;
      part_.problem.K.append(whole_.K.all<S>()[run.first + i]);
      part_.problem.P.push_back(whole_.P[*block]);
      take_rows(*block, run.row + S::dim * i, S::dim);
    }
  }

  // Rows of a contact are formed from its geometry; rows of joints are stored behind those of all contacts.
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
      sub_->contacts.push_back(contact);
      sub_->contact_compliance.push_back(A_.contact_compliance[block]);
      return;
    }
    const std::size_t first_stored = whole_.rows() - A_.jacobian.size();
    for (std::size_t i = row - first_stored; i < row - first_stored + dim; ++i) {
      JacobianRow jacobian = A_.jacobian[i];
      jacobian.body_a = local(link.a);
      jacobian.body_b = local(link.b);
      sub_->jacobian.push_back(jacobian);
      sub_->compliance.push_back(A_.compliance[i]);
    }
  }

  // The number of a body within the part; the index of the world stays.
  Index local(Index body) {
    if (body < 0 || A_.constrained) return body;
    if (number_[body] < 0) {
      number_[body] = static_cast<Index>(part_.bodies.size());
      part_.bodies.push_back(body);
    }
    return number_[body];
  }

  const Problem& whole_;
  const ContactSystem& A_;
  std::vector<Index>& number_;
  IslandPart& part_;
  ContactSystem* sub_ = nullptr;
};

// Severity of a status for the whole problem, by the order of Status. A part without enough iterations might
// converge with more; a part that stalled or came too late does not. One infeasible island makes the problem
// infeasible. An interrupt of the user precedes all others.
int severity(Status status) {
  constexpr int order[] = {0, 1, 3, 2, 5, 4, 0};  // not tuned: an order
  return order[static_cast<int>(status)];
}

// Hardness of a part: the factor by which it misses the tolerance; for a converged part its cost.
using Hardness = std::tuple<double, std::size_t>;

// Adds the sums of a part; status and reason are those of the hardest part.
void add_part(Solution& total, const Solution& s, const IslandPart& part, double tolerance, Hardness& worst) {
  for (std::size_t k = 0; k < part.rows.size(); ++k) total.x[part.rows[k]] = s.x[k];
  add_counts(total, s);
  if (severity(s.status) > severity(total.status)) total.status = s.status;
  const Hardness hardness{s.residual > tolerance ? s.residual : 0, s.iterations};
  if (!(hardness > worst)) return;
  worst = hardness;
  total.method = s.method;
  total.reason = s.reason;
  total.phases = s.phases;
}

}  // namespace

void extract(const Problem& whole, std::span<const std::size_t> members, std::vector<Index>& body_number,
             IslandPart& part) {
  Extraction(whole, body_number, part).take(members);
}

Solution solve_by_islands(const Problem& problem, const Options& options, Budget& budget, Method method) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || A->constrained || options.history || options.callback) return method(problem, options, budget);
  std::vector<Index> island;
  // A warm start, options and law go to every part. The parts are solved in turn, so that results do not
  // depend on threads, and only the memory of one part is in use at a time.
  std::size_t count = find_islands(problem.graph, island);
  if (count > 1) count = gather(A->contacts.size(), count, island);
  if (count <= 1) return method(problem, options, budget);

  const Time start = std::chrono::steady_clock::now();
  std::vector<std::vector<std::size_t>> members(count);
  for (std::size_t block = 0; block < island.size(); ++block) members[island[block]].push_back(block);
  std::vector<Index> body_number;
  Solution total;
  // Rows that an interrupt leaves unsolved keep zero impulses.
  total.x.assign(problem.rows(), 0.0);
  if (!options.x0.empty()) project(problem.K, options.x0, total.x);
  total.status = Status::converged;
  std::size_t left = island.size();
  Hardness worst{-1, 0};
  std::vector<double> x0;
  // Small groups first: the unused budget of an easy group is left to those that follow.
  std::stable_sort(members.begin(), members.end(),
                   [](const auto& a, const auto& b) { return a.size() < b.size(); });
  for (std::size_t i = 0; i < count && total.status != Status::interrupted; ++i) {
    IslandPart part;
    extract(problem, members[i], body_number, part);
    Options o = options;
    if (!options.x0.empty()) {
      x0.clear();
      for (std::size_t row : part.rows) x0.push_back(options.x0[row]);
      o.x0 = x0;
    }
    // The remaining time and work are shared by size, so that a hard island cannot take all. A group has at
    // least half of an even share: a few bodies beside a large wall need more than their share of contacts.
    const double part_of_rest = std::max(static_cast<double>(members[i].size()) / static_cast<double>(left),
                                         0.5 / static_cast<double>(count - i));
    Budget share(budget, part_of_rest * budget.left(), part_of_rest * budget.work_left());
    left -= members[i].size();
    add_part(total, method(part.problem, o, share), part, options.tolerance, worst);
  }
  // Measured by a product of the whole problem: the islands together meet the tolerance if each does.
  measure(problem, law_of(problem, options), total);
  if (total.residual <= options.tolerance) total.status = Status::converged;
  total.reason += "; the hardest of " + std::to_string(count) + " groups of islands";
  total.time = seconds_since(start);
  return total;
}

}  // namespace amontons
