// A part has the data of the whole in other places. Nothing is computed, and nothing needs a check, because
// the whole was checked.
#include "amontons/problem/island_part.hpp"

#include <algorithm>

#include "amontons/problem/linkage.hpp"

namespace amontons {

namespace {

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
    sub_->constrained.reset();
    sub_->half.first.clear();
    sub_->half.coordinate.clear();
    sub_->half.value.clear();
    sub_->half.whole = false;
  }

  void take(std::span<const std::size_t> members) {
    for (const SetRun& run : whole_.K.runs())
      visit_kind(run.kind, [&]<class S>() { take_run<S>(run, members); });
    for (Index body : part_.bodies) {
      sub_->bodies.inverse_mass.push_back(A_.bodies.inverse_mass[body]);
      sub_->bodies.inverse_inertia.push_back(A_.bodies.inverse_inertia[body]);
      if (!A_.bodies.centre.empty()) sub_->bodies.centre.push_back(A_.bodies.centre[body]);
      number_[body] = -1;
    }
    if (A_.constrained) take_trees(*A_.constrained->linkage);
    part_.problem.law = whole_.law;
    make_contact_graph(*sub_, part_.problem.K, part_.problem.graph);
  }

 private:
  // The trees of the part: of M = L'DL only the coordinates between its bodies and the roots. With P for the
  // columns of these coordinates, J' of the part is P J_p', because a body moves with them alone. A row of L
  // has entries at the coordinate and its ancestors, so that these rows are zero elsewhere: L_p = P'L P is
  // triangular too, and L^-T P = P L_p^-T. Hence
  //
  //   J M^-1 J' = J_p P' L^-1 D^-1 L^-T P J_p' = J_p (L_p' D_p L_p)^-1 J_p',
  //
  // without a new factorisation. L_p is that of the whole entry by entry, since the entries of a row keep
  // their order and runs of coordinates stay whole. The bits of rows of D M^-1/2 stay, too.
  //
  // A part without a body of a tree has free bodies alone, and all factorisations serve it.
  void take_trees(const Linkage& whole) {
    static thread_local std::vector<Index> number, reached;
    find_coordinates(whole, number, reached);
    const auto in_trees = [&](Index body) { return whole.number_of(body) >= 0; };
    if (std::any_of(part_.bodies.begin(), part_.bodies.end(), in_trees)) {
      copy_trees(whole, number, reached);
      take_half_rows(number);
    }
    for (const Index k : reached) number[k] = -1;
  }

  // Numbers the coordinates between bodies of the part and the roots in their order: parents keep smaller
  // numbers. `number` is -1 elsewhere.
  void find_coordinates(const Linkage& whole, std::vector<Index>& number, std::vector<Index>& reached) const {
    number.resize(std::max(number.size(), whole.coordinates()), -1);
    reached.clear();
    const auto reach = [&](Index k) {
      for (; k >= 0 && number[k] < 0; k = whole.parent[k]) {
        number[k] = 0;
        reached.push_back(k);
      }
    };
    for (const Index body : part_.bodies)
      if (const Index own = whole.number_of(body); own >= 0) reach(whole.last[own]);
    std::sort(reached.begin(), reached.end());
    for (std::size_t i = 0; i < reached.size(); ++i) number[reached[i]] = static_cast<Index>(i);
  }

  void copy_trees(const Linkage& whole, const std::vector<Index>& number, const std::vector<Index>& reached) {
    const auto local_coordinate = [&](Index k) { return k < 0 ? k : number[k]; };
    Linkage& trees = own_linkage();
    for (const Index k : reached) {
      trees.parent.push_back(local_coordinate(whole.parent[k]));
      trees.run.push_back(whole.run[k]);
      trees.column.push_back(whole.column[k]);
      trees.inverse_root.push_back(whole.inverse_root[k]);
      trees.rows.insert(trees.rows.end(), &whole.rows[whole.first[k]],
                        &whole.rows[whole.first[k]] + (whole.first[k + 1] - whole.first[k]));
      trees.first.push_back(trees.rows.size());
    }
    trees.number.assign(part_.bodies.size(), -1);
    for (std::size_t i = 0; i < part_.bodies.size(); ++i) {
      const Index own = whole.number_of(part_.bodies[i]);
      if (own < 0) continue;
      trees.number[i] = static_cast<Index>(trees.body.size());
      trees.body.push_back(static_cast<Index>(i));
      trees.last.push_back(local_coordinate(whole.last[own]));
      trees.arm.push_back(whole.arm[own]);
    }
    part_.trees->body = trees.body;
    sub_->constrained = part_.trees;
    // If its rows move bodies of trees alone, the product of the part needs no sweep over bodies.
    sub_->half.whole = trees.body.size() == part_.bodies.size();
  }

  // Empty, with the memory of the part before, unless a problem still shares that.
  Linkage& own_linkage() {
    if (part_.trees.use_count() != 1) {
      const auto fresh = std::make_shared<Linkage>();
      part_.trees = std::make_shared<ConstrainedBodies>(
          ConstrainedBodies{{}, [of = fresh.get()](double* w) { of->move(w); }, fresh});
    }
    Linkage& trees = const_cast<Linkage&>(*part_.trees->linkage);  // no problem holds it
    trees.body.clear();
    trees.last.clear();
    trees.arm.clear();
    trees.parent.clear();
    trees.run.clear();
    trees.column.clear();
    trees.first.assign(1, 0);
    trees.rows.clear();
    trees.inverse_root.clear();
    return trees;
  }

  // Rows of D M^-1/2 depend on nothing but the row and its tree: they are copied and not made again.
  void take_half_rows(const std::vector<Index>& number) {
    HalfRows& half = sub_->half;
    half.first.assign(1, 0);
    for (const std::size_t row : part_.rows) {
      for (std::size_t i = A_.half.first[row]; i < A_.half.first[row + 1]; ++i) {
        half.coordinate.push_back(number[A_.half.coordinate[i]]);
        half.value.push_back(A_.half.value[i]);
      }
      half.first.push_back(half.value.size());
    }
    for (JacobianRow& row : sub_->jacobian)
      if (row.coordinate >= 0) row.coordinate = number[row.coordinate];
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
      ContactGeometry contact = A_.contacts[block];
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
    if (body < 0) return body;
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

}  // namespace

void extract(const Problem& whole, std::span<const std::size_t> members, std::vector<Index>& body_number,
             IslandPart& part) {
  Extraction(whole, body_number, part).take(members);
}

}  // namespace amontons
