// A part has the data of the whole in other places. Nothing is computed, and nothing needs a check, because
// the whole was checked.
#include "amontons/problem/island_part.hpp"

#include <algorithm>

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
    // A part has some of the rows of the whole. So if those move bodies of trees alone, these do too, and the
    // product of the part needs no sweep over bodies either.
    half.whole = A_.half.whole;
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

}  // namespace

void extract(const Problem& whole, std::span<const std::size_t> members, std::vector<Index>& body_number,
             IslandPart& part) {
  Extraction(whole, body_number, part).take(members);
}

}  // namespace amontons
