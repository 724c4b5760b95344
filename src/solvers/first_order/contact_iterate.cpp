// The arrays of the fused passes, filled once per solve from a problem, and the calls of the passes. An
// iteration of P-SPG-FB, with A d = D M^-1 D'd + E d:
//  direction   over contacts   d, <d, g>, <d, P d>, <d, E d>; lines = D'd
//  add_copies  over bodies     each line of a body that has several becomes their sum
//  mass        over bodies     lines = M^-1 lines; <D'd, M^-1 D'd>
//  update      over contacts   x, u, <s, y>, <y, P^-1 y>, the residual
// Threads share the chunks of each pass and wait for each other between passes; nothing else is synchronised.
#include "amontons/solvers/first_order/contact_iterate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "amontons/base/line_array.hpp"
#include "amontons/base/threads.hpp"
#include "amontons/solvers/first_order/metric.hpp"
#include "solvers/first_order/contact_layout.hpp"
#include "solvers/first_order/contact_passes.hpp"
#include "solvers/first_order/contact_rows.hpp"

namespace amontons {

namespace {

// From this size on (32000 contacts, 8 MB of arrays) prefetching gains time in the last pass too.
constexpr std::size_t streaming_batches = 4000;

}  // namespace

struct ContactIterate::State {
  State(const Problem& problem, Law law, unsigned threads, Isa isa);

  ContactLayout layout;
  PoolLease pool;
  Passes passes;
  std::size_t contacts, joints, size;  // size: of x, u, d in the layout of the passes
  bool coulomb, stored;                // stored: contacts are rows of D
  double dEd = 0;                      // <d, E d> of the last direction
  // Indices of the current and the best of the three buffers of x.
  int now = 0, best = 0;
  std::vector<std::uint32_t> lane_of;  // contact -> lane
  // Bodies connected by joints, their impulses and velocities, and their lines: held_line[first_held_line[i]]
  // .. for the i-th body; empty if no row acts on it.
  std::shared_ptr<const ConstrainedBodies> constrained;
  std::vector<double> moved, pushed;
  std::vector<std::uint32_t> held_line, first_held_line;
  // Constant during a solve: batches, rows, masses, compliance, b. `lines` changes within an iteration, u and
  // x between iterations. y and u_y exist only for accelerated methods, de_saxce only under coulomb.
  LineArray<ContactBatch> batches;
  LineArray<ContactRows> contact_rows;
  LineArray<JointBatch> rows;
  LineArray<MassBatch> masses;
  LineArray<double> compliance, lines, b, u, d, de_saxce, y, u_y;
  std::array<LineArray<double>, 3> x;
  LineArray<PassSums> sums;

  std::size_t chunks() const { return layout.chunks.size(); }
  // The first component of a contact in a vector of the passes; the others follow at a distance of 8 doubles.
  double* component(const LineArray<double>& vector, std::size_t contact) const {
    return vector.data() + 24 * (lane_of[contact] / lanes) + lane_of[contact] % lanes;
  }
  // A buffer that may be overwritten: it holds neither the current x nor the best.
  int free_buffer() const { return best == now ? (now + 1) % 3 : 3 - now - best; }
  // The present arrays: x changes its buffer with every iteration.
  PassData data() const;
  // u = A x + b with the x and u of `pass`.
  double refresh(const PassData& pass);

  void fill_contacts(const Problem& problem, const ContactSystem& A);
  void fill_joints(const Problem& problem, const ContactSystem& A);
  void fill_masses(const Bodies& bodies);
  void find_held_lines();
  // Between the order and frames of the problem and the lanes in world coordinates.
  void to_world(std::span<const double> user, const LineArray<double>& held) const;
  void to_user(const LineArray<double>& held, std::span<double> user) const;

  void add_copies();
  double apply_masses();
  void push_held();
  double move_held();
  // Runs pass(data, chunk, ...) over all chunks; adds the sums in the order of the chunks, for any number of
  // threads.
  template <class Pass, class... Step>
  PassSums over_chunks(Pass pass, const PassData& held, Step... step) {
    pool->run(chunks(), [&](std::size_t c) { sums[c] = pass(held, layout.chunks[c], step...); });
    PassSums total{};
    for (std::size_t c = 0; c < chunks(); ++c)
      for (int k = 0; k < 4; ++k) total.v[k] += sums[c].v[k];
    return total;
  }
};

// LineArray zeroes its memory. An array that is not filled below stays an inert lane, a dummy line or an
// absent array.
ContactIterate::State::State(const Problem& problem, Law law, unsigned threads, Isa isa)
    : layout(lay_out(std::get<ContactSystem>(problem.A), problem.graph, problem.K.contacts())),
      pool(automatic_threads(threads, layout.chunks.size())),
      passes(passes_of(isa)),
      contacts(problem.K.contacts()),
      joints(problem.rows() - 3 * contacts),
      size(24 * layout.batches() + lanes * layout.joint_batches()),
      coulomb(law == Law::coulomb),
      stored(std::get<ContactSystem>(problem.A).contacts.empty()),
      lane_of(contacts),
      constrained(std::get<ContactSystem>(problem.A).constrained),
      batches(layout.batches()),
      rows(layout.joint_batches()),
      masses(layout.body.size() / lanes),
      lines(8 * layout.body.size()),
      b(size),
      u(size),
      d(size),
      sums(layout.chunks.size()) {
  const auto& A = std::get<ContactSystem>(problem.A);
  for (LineArray<double>& buffer : x) buffer = LineArray<double>(size);
  // Arrays that the problem does not need are absent; the passes are compiled without them.
  if (stored) contact_rows = LineArray<ContactRows>(layout.batches());
  if (coulomb) de_saxce = LineArray<double>(8 * layout.batches());
  bool compliant = false;
  for (std::size_t i = 0; i < contacts; ++i) compliant = compliant || compliance_of(A, i) != 0;
  if (compliant) compliance = LineArray<double>(8 * layout.batches());
  fill_contacts(problem, A);
  fill_joints(problem, A);
  fill_masses(A.bodies);
  if (constrained) find_held_lines();
  to_world(problem.b, b);
}

// Filled by the threads that will use it, because memory goes to the node of the thread that touches it
// first.
void ContactIterate::State::fill_contacts(const Problem& problem, const ContactSystem& A) {
  const std::vector<Friction>& cones = problem.K.all<Friction>();
  const std::vector<BlockMetric> metrics = block_metrics(problem);
  pool->run(chunks(), [&](std::size_t c) {
    for (std::size_t i = layout.chunks[c].first_batch; i < layout.chunks[c].last_batch; ++i) {
      ContactBatch& batch = batches[i];
      for (std::size_t l = 0; l < lanes; ++l) {
        // Inert lanes too: they read and write the dummy line; their other entries stay zero.
        batch.line_a[l] = 8 * layout.line_a[lanes * i + l];
        batch.line_b[l] = 8 * layout.line_b[lanes * i + l];
        batch.aspect[l] = 1;
        const Index index = layout.contact[lanes * i + l];
        if (index < 0) continue;
        if (stored) {
          batch.normal[0][l] = 1;
          fill_rows(&A.jacobian[3 * static_cast<std::size_t>(index)], l, contact_rows[i]);
        } else {
          const ContactGeometry& contact = A.contacts[index];
          for (int k = 0; k < 3; ++k) {
            batch.r_a[k][l] = contact.r_a[k];
            batch.r_b[k][l] = contact.r_b[k];
            batch.normal[k][l] = contact.normal[k];
          }
        }
        batch.mu[l] = std::min(cones[index].mu, largest_mu);
        batch.p[l] = problem.P[index];
        batch.p_inverse[l] = 1 / problem.P[index];
        batch.aspect[l] = metrics[index].aspect;
        batch.p_t[l] = metrics[index].tangent;
        batch.p_t_inverse[l] = 1 / metrics[index].tangent;
        if (compliance.data()) compliance[lanes * i + l] = compliance_of(A, index);
        lane_of[index] = static_cast<std::uint32_t>(lanes * i + l);
      }
    }
  });
}

// Rows are in the order of the layout, with the rows of one joint adjacent. P and the sets are in the order
// of the problem.
void ContactIterate::State::fill_joints(const Problem& problem, const ContactSystem& A) {
  const std::vector<Interval> bounds = row_bounds(problem.K);
  for (std::size_t i = 0; i < layout.joint_row.size(); ++i) {
    JointBatch& batch = rows[i / lanes];
    const std::size_t l = i % lanes;
    batch.line_a[l] = 8 * layout.joint_line_a[i];
    batch.line_b[l] = 8 * layout.joint_line_b[i];
    const Index k = layout.joint_row[i];
    if (k < 0) continue;
    const std::size_t at = static_cast<std::size_t>(k) + (stored ? 3 * contacts : 0);
    std::copy(A.jacobian[at].a.begin(), A.jacobian[at].a.end(), batch.a[l]);
    std::copy(A.jacobian[at].b.begin(), A.jacobian[at].b.end(), batch.b[l]);
    batch.compliance[l] = A.compliance[at];
    batch.p[l] = problem.P[contacts + k];
    batch.p_inverse[l] = 1 / problem.P[contacts + k];
    batch.lo[l] = bounds[k].lo;
    batch.hi[l] = bounds[k].hi;
  }
}

// In sums over lines the first copy of a body has weight 1, its other copies weight 0.
void ContactIterate::State::fill_masses(const Bodies& bodies) {
  for (std::size_t line = 0; line < layout.body.size(); ++line) {
    const Index body = layout.body[line];
    if (body < 0) continue;
    MassBatch& batch = masses[line / lanes];
    const std::size_t l = line % lanes;
    batch.translation[l] = bodies.inverse_mass[body];
    for (int k = 0; k < 6; ++k) batch.inertia[k][l] = bodies.inverse_inertia[body][k];
    batch.weight[l] = 1;
  }
  for (std::size_t i = 0; i + 1 < layout.first_copy.size(); ++i)
    for (std::uint32_t k = layout.first_copy[i] + 1; k < layout.first_copy[i + 1]; ++k)
      masses[layout.copies[k] / lanes].weight[layout.copies[k] % lanes] = 0;
}

// Masses of held bodies are removed from the mass pass, which then leaves zeros in their lines.
void ContactIterate::State::find_held_lines() {
  const std::vector<Index>& body = constrained->body;
  moved.resize(6 * body.size());
  pushed.resize(6 * body.size());
  std::vector<std::vector<std::uint32_t>> found(body.size());
  for (std::size_t line = 0; line < layout.body.size(); ++line) {
    const auto at = std::lower_bound(body.begin(), body.end(), layout.body[line]);
    if (layout.body[line] < 0 || at == body.end() || *at != layout.body[line]) continue;
    found[static_cast<std::size_t>(at - body.begin())].push_back(static_cast<std::uint32_t>(line));
    MassBatch& batch = masses[line / lanes];
    batch.translation[line % lanes] = 0;
    for (auto& inertia : batch.inertia) inertia[line % lanes] = 0;
  }
  first_held_line.assign(1, 0);
  for (const auto& list : found) {
    held_line.insert(held_line.end(), list.begin(), list.end());
    first_held_line.push_back(static_cast<std::uint32_t>(held_line.size()));
  }
}

PassData ContactIterate::State::data() const {
  return {batches.data(),
          contact_rows.data(),
          rows.data(),
          masses.data(),
          compliance.data(),
          x[now].data(),
          b.data(),
          x[free_buffer()].data(),
          u.data(),
          d.data(),
          de_saxce.data(),
          lines.data(),
          y.data(),
          u_y.data(),
          24 * layout.batches(),
          coulomb,
          layout.batches() >= streaming_batches};
}

namespace {

// The frame of a lane, made from the normal as by ContactBasis. It equals that of the problem, see fits().
ContactBasis basis(const ContactBatch& batch, std::size_t lane) {
  return ContactBasis(Vec3{batch.normal[0][lane], batch.normal[1][lane], batch.normal[2][lane]});
}

}  // namespace

void ContactIterate::State::to_world(std::span<const double> user, const LineArray<double>& held) const {
  for (std::size_t i = 0; i < contacts; ++i) {
    const double* own = &user[3 * i];
    const Vec3 v = stored ? Vec3{own[0], own[1], own[2]}
                          : basis(batches[lane_of[i] / lanes], lane_of[i] % lanes).to_world(own);
    double* out = component(held, i);
    for (int k = 0; k < 3; ++k) out[8 * k] = v[k];
  }
  // Single rows have no frame; only their order changes.
  double* out = held.data() + 24 * layout.batches();
  for (std::size_t i = 0; i < layout.joint_row.size(); ++i)
    if (layout.joint_row[i] >= 0) out[i] = user[3 * contacts + layout.joint_row[i]];
}

void ContactIterate::State::to_user(const LineArray<double>& held, std::span<double> user) const {
  for (std::size_t i = 0; i < contacts; ++i) {
    const double* in = component(held, i);
    if (stored)
      for (std::size_t k = 0; k < 3; ++k) user[3 * i + k] = in[8 * k];
    else
      basis(batches[lane_of[i] / lanes], lane_of[i] % lanes).to_contact({in[0], in[8], in[16]}, &user[3 * i]);
  }
  const double* in = held.data() + 24 * layout.batches();
  for (std::size_t i = 0; i < layout.joint_row.size(); ++i)
    if (layout.joint_row[i] >= 0) user[3 * contacts + layout.joint_row[i]] = in[i];
}

// Replaces every line of a body that has several by their sum. Chunks write to lines of their own, without
// locks, and are combined only here. Copies are added in ascending order, for any number of threads. The
// bodies are divided into as many parts as there are chunks.
void ContactIterate::State::add_copies() {
  const std::size_t shared = layout.first_copy.size() - 1;
  if (shared == 0) return;
  pool->run(chunks(), [&](std::size_t c) {
    for (std::size_t i = shared * c / chunks(); i < shared * (c + 1) / chunks(); ++i) {
      const std::uint32_t first = layout.first_copy[i], last = layout.first_copy[i + 1];
      double sum[6] = {};
      for (std::uint32_t k = first; k < last; ++k)
        for (int j = 0; j < 6; ++j) sum[j] += lines[8 * std::size_t{layout.copies[k]} + j];
      for (std::uint32_t k = first; k < last; ++k)
        for (int j = 0; j < 6; ++j) lines[8 * std::size_t{layout.copies[k]} + j] = sum[j];
    }
  });
}

// Impulses at the bodies that joints hold, read from any line of a body, as each has the sum.
void ContactIterate::State::push_held() {
  for (std::size_t i = 0; i + 1 < first_held_line.size(); ++i) {
    const bool none = first_held_line[i] == first_held_line[i + 1];
    const double* line = none ? nullptr : &lines[8 * std::size_t{held_line[first_held_line[i]]}];
    for (std::size_t k = 0; k < 6; ++k) pushed[6 * i + k] = none ? 0 : line[k];
  }
}

// Velocities of these bodies; returns their part of <lines, M^-1 lines>. They are few: one thread.
double ContactIterate::State::move_held() {
  moved = pushed;
  constrained->apply(moved.data());
  double sum = 0;
  for (std::size_t k = 0; k < moved.size(); ++k) sum += moved[k] * pushed[k];
  for (std::size_t i = 0; i + 1 < first_held_line.size(); ++i)
    for (std::uint32_t k = first_held_line[i]; k < first_held_line[i + 1]; ++k)
      std::copy_n(&moved[6 * i], 6, &lines[8 * std::size_t{held_line[k]}]);
  return sum;
}

// lines := M^-1 lines; <lines, M^-1 lines>, which after a direction is <d, D M^-1 D' d>.
double ContactIterate::State::apply_masses() {
  add_copies();
  if (constrained) push_held();
  const double free = over_chunks(passes.mass, data()).v[0];
  return constrained ? free + move_held() : free;
}

// All contacts must be friction cones of three rows, and single rows intervals. Elliptic cones and moments
// use PlainIterate.
bool ContactIterate::fits(const Problem& problem) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  bool known = A != nullptr && (problem.K.contacts() == A->contacts.size() ||
                                (A->contacts.empty() && has_contact_rows(problem, *A)));
  for (const SetRun& run : problem.K.runs())
    visit_kind(run.kind, [&]<class S>() { known = known && (S::dim == 1 || std::is_same_v<S, Friction>); });
  // The passes assume tangents that follow from the normal alone.
  return known && std::none_of(A->contacts.begin(), A->contacts.end(),
                               [](const ContactGeometry& c) { return !(c.direction == Vec3{}); });
}

ContactIterate::ContactIterate(const Problem& problem, Law law, unsigned threads, Isa isa)
    : state_(std::make_unique<State>(problem, law, threads, isa)) {}
ContactIterate::ContactIterate(ContactIterate&&) noexcept = default;
ContactIterate::~ContactIterate() = default;

// x0 is projected in the frames of the problem, by the sets themselves and with the mu of the passes. So x
// lies in K as the passes see it. An empty x0 means zeros.
double ContactIterate::start(std::span<const double> x0) {
  State& s = *state_;
  const std::size_t m = 3 * s.contacts + s.joints;
  s.best = s.now;
  std::vector<double> x(m);
  std::copy(x0.begin(), x0.end(), x.begin());
  for (std::size_t i = 0; i < s.contacts; ++i)
    Friction{s.batches[s.lane_of[i] / lanes].mu[s.lane_of[i] % lanes]}.project(&x[3 * i], &x[3 * i]);
  for (std::size_t i = 0; i < s.layout.joint_row.size(); ++i) {
    if (s.layout.joint_row[i] < 0) continue;
    double* row = &x[3 * s.contacts + s.layout.joint_row[i]];
    Interval{s.rows[i / lanes].lo[i % lanes], s.rows[i / lanes].hi[i % lanes]}.project(row, row);
  }
  s.to_world(x, s.x[s.now]);
  return refresh();
}

// lines = D'x, lines = M^-1 D'x, u = D lines + E x + b
double ContactIterate::State::refresh(const PassData& held) {
  over_chunks(passes.impulse, held);
  apply_masses();
  return over_chunks(passes.refresh, held).v[0];
}

double ContactIterate::refresh() { return state_->refresh(state_->data()); }

// contact_passes.hpp lists the sums of a pass. <d, E d> is stored for curvature().
Direction ContactIterate::direction(double alpha) {
  const PassSums s = state_->over_chunks(state_->passes.direction, state_->data(), alpha);
  state_->dEd = s.v[2];
  return {s.v[0], s.v[1]};
}

// <d, A d> = <D'd, M^-1 D'd> + <d, E d>; the direction pass summed the second term.
double ContactIterate::curvature() { return state_->apply_masses() + state_->dEd; }

// x_next becomes the current x. The buffer of the old x is free unless it is the best.
Update ContactIterate::update(double lambda) {
  const PassSums s = state_->over_chunks(state_->passes.update, state_->data(), lambda);
  state_->now = state_->free_buffer();
  return {s.v[0], s.v[1], s.v[2]};
}

// Allocates two more vectors, which P-SPG-FB does not need.
void ContactIterate::start_momentum() {
  State& s = *state_;
  if (!s.y.data()) {
    s.y = LineArray<double>(s.size);
    s.u_y = LineArray<double>(s.size);
  }
  std::copy_n(s.x[s.now].data(), s.size, s.y.data());
  std::copy_n(s.u.data(), s.size, s.u_y.data());
}

MomentumDirection ContactIterate::momentum_direction(double alpha) {
  const PassSums s = state_->over_chunks(state_->passes.momentum_direction, state_->data(), alpha);
  state_->dEd = s.v[2];
  return {s.v[1], s.v[3]};
}

double ContactIterate::accelerate(double beta) {
  const double residual_squared = state_->over_chunks(state_->passes.accelerate, state_->data(), beta).v[0];
  state_->now = state_->free_buffer();
  return residual_squared;
}

// x last, because its pass leaves the De Saxce term of x, from which the next direction starts.
double ContactIterate::refresh_momentum() {
  PassData at_y = state_->data();
  at_y.x = state_->y.data();
  at_y.u = state_->u_y.data();
  state_->refresh(at_y);
  return refresh();
}

void ContactIterate::keep_best() { state_->best = state_->now; }

void ContactIterate::extract_best(std::span<double> x) const { state_->to_user(state_->x[state_->best], x); }

void ContactIterate::extract(std::span<double> x) const { state_->to_user(state_->x[state_->now], x); }

void ContactIterate::extract(std::span<double> x, std::span<double> u) const {
  state_->to_user(state_->x[state_->now], x);
  state_->to_user(state_->u, u);
}

// 1/2 x'(u + b) = 1/2 x'Ax + b'x; an inner product does not depend on the frame. Eight partial sums in a
// fixed order.
double ContactIterate::objective() const {
  const State& s = *state_;
  const double *x = s.x[s.now].data(), *u = s.u.data(), *b = s.b.data();
  double sum[8] = {};
  for (std::size_t i = 0; i < s.size; ++i) sum[i % 8] += x[i] * (u[i] + b[i]);
  return 0.5 * (((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7])));
}

}  // namespace amontons
