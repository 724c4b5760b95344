// From a problem to the arrays of a device, in linear time except for the order of the bodies:
//   places   bodies along the curve of the fused passes (body_order), contacts and rows sorted by them
//   fields   the data of contacts, rows and bodies that a pass reads, component by component
//   lists    the summands of a body: one entry for every side of a contact or row, sorted by counting.
//   Entries
//            are in ascending order of contacts and rows, the order of the sum. Arms and rows of D are stored
//            a second time in the order of the lists, so that a body reads them contiguously
//   parts    a list of more than `most_entries` would keep one work item busy while all others wait. Its
//   parts
//            are summed in parallel, and their sums by a tree
#include "amontons/solvers/first_order/device_layout.hpp"

#include <algorithm>

#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/metric.hpp"
#include "solvers/first_order/contact_rows.hpp"
#include "solvers/first_order/link_order.hpp"

namespace amontons {

namespace {

using Layout = DeviceLayout;

std::size_t padded(std::size_t n) { return (n + 31) / 32 * 32; }

// Places of bodies, contacts and rows, as in the fused passes.
struct Places {
  std::vector<std::uint32_t> line;  // of each body, 0 for fixed bodies
  Sorted contacts, rows;
};
Places places_of(const ContactSystem& A, const ContactGraph& graph, std::size_t contacts,
                 std::size_t& bodies) {
  const std::size_t n = A.bodies.size();
  const std::vector<bool> is_hub = find_hubs(n, graph.links, contacts);
  const BodyOrder order = order_bodies(A, graph, is_hub);
  bodies = order.moving.size();
  std::vector<std::uint32_t> rank(graph.links.size());
  for (std::size_t k = 0; k < rank.size(); ++k) rank[k] = sort_rank(graph.links[k], order, is_hub);
  Places places;
  places.line.assign(n, 0);
  for (std::size_t i = 0; i < bodies; ++i) places.line[order.moving[i]] = static_cast<std::uint32_t>(i + 1);
  places.contacts = sort_by_rank(rank, 0, contacts, bodies + 1);
  places.rows = sort_by_rank(rank, contacts, rank.size(), bodies + 1);
  return places;
}

std::uint32_t line_of(const Places& places, Index body) { return body < 0 ? 0 : places.line[body]; }

// Contacts of files have no arms: their normal is the first axis of their own frame, as in ContactIterate.
void fill_contacts(const Problem& problem, const ContactSystem& A, const Places& places, Layout& out) {
  const std::vector<Friction>& cones = problem.K.all<Friction>();
  const std::vector<BlockMetric> metrics = block_metrics(problem);
  for (std::size_t c = 0; c < out.contacts; ++c) {
    const std::size_t index = places.contacts.index[c];
    out.contact_of[c] = static_cast<Index>(index);
    const auto field = [&](int k) -> double& {
      return out.contact[static_cast<std::size_t>(k) * out.stride + c];
    };
    if (out.stored) {
      field(Layout::normal) = 1;
    } else {
      const Contact& contact = A.contacts[index];
      for (int k = 0; k < 3; ++k) {
        field(Layout::normal + k) = contact.normal[k];
        field(Layout::arm_a + k) = contact.r_a[k];
        field(Layout::arm_b + k) = contact.r_b[k];
      }
    }
    field(Layout::mu) = std::min(cones[index].mu, largest_mu);
    field(Layout::p) = problem.P[index];
    field(Layout::aspect) = metrics[index].aspect;
    field(Layout::p_t) = metrics[index].tangent;
    field(Layout::compliance) = compliance_of(A, index);
    out.compliant = out.compliant || compliance_of(A, index) != 0;
    const ContactGraph::Link& link = problem.graph.links[index];
    out.line[c] = line_of(places, link.a);
    out.line[out.stride + c] = line_of(places, link.b);
  }
}

// Writes a row of D to one of the places of `jacobian`.
void fill_jacobian(const JacobianRow& row, std::size_t place, Layout& out) {
  const std::size_t stride = out.jacobian_stride();
  for (std::size_t k = 0; k < 6; ++k) {
    out.jacobian[k * stride + place] = row.a[k];
    out.jacobian[(6 + k) * stride + place] = row.b[k];
  }
}

// Single rows, and the three rows of every stored contact, which precede the single ones in D as in x.
void fill_rows(const Problem& problem, const ContactSystem& A, const Places& places, Layout& out) {
  const std::vector<Interval> bounds = row_bounds(problem.K);
  const std::size_t ahead = out.stored ? 3 * out.stride : 0;
  for (std::size_t r = 0; r < out.rows; ++r) {
    const std::size_t block = places.rows.index[r], index = block - out.contacts;
    const std::size_t at = index + (out.stored ? 3 * out.contacts : 0);
    out.row_of[r] = static_cast<Index>(index);
    out.row[Layout::row_p * out.row_stride + r] = problem.P[block];
    out.row[Layout::low * out.row_stride + r] = bounds[index].lo;
    out.row[Layout::high * out.row_stride + r] = bounds[index].hi;
    out.row[Layout::row_compliance * out.row_stride + r] = A.compliance[at];
    const ContactGraph::Link& link = problem.graph.links[block];
    out.line[2 * out.stride + r] = line_of(places, link.a);
    out.line[2 * out.stride + out.row_stride + r] = line_of(places, link.b);
    fill_jacobian(A.jacobian[at], ahead + r, out);
  }
  if (!out.stored) return;
  for (std::size_t c = 0; c < out.contacts; ++c)
    for (std::size_t k = 0; k < 3; ++k)
      fill_jacobian(A.jacobian[3 * static_cast<std::size_t>(out.contact_of[c]) + k], k * out.stride + c, out);
}

void fill_masses(const Bodies& bodies, const Places& places, Layout& out) {
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    const std::size_t line = places.line[body];
    if (line == 0) continue;
    out.mass[line] = bodies.inverse_mass[body];
    for (std::size_t k = 0; k < 6; ++k)
      out.mass[(1 + k) * out.line_stride + line] = bodies.inverse_inertia[body][k];
  }
}

// One entry per side: the line of its body, its value in the list, and the place of its numbers.
struct Entry {
  std::uint32_t line, value;
};

// Lists by line from entries in ascending order, by counting: first[i] .. first[i + 1] - 1 are those of line
// i. Line 0 has no entries.
std::vector<std::uint32_t> make_lists(const std::vector<Entry>& entries, std::size_t lines,
                                      std::vector<std::uint32_t>& first) {
  first.assign(lines + 1, 0);
  for (const Entry& e : entries) ++first[e.line + 1];
  for (std::size_t i = 0; i < lines; ++i) first[i + 1] += first[i];
  std::vector<std::uint32_t> place(first.begin(), first.end() - 1), list(entries.size());
  for (const Entry& e : entries) list[place[e.line]++] = e.value;
  return list;
}

std::vector<Entry> contact_entries(const Layout& out) {
  std::vector<Entry> entries;
  if (out.stored) return entries;
  entries.reserve(2 * out.contacts);
  for (std::size_t c = 0; c < out.contacts; ++c)
    for (std::size_t side = 0; side < 2; ++side)
      if (const std::uint32_t line = out.line[side * out.stride + c])
        entries.push_back({line, static_cast<std::uint32_t>(2 * c + side)});
  return entries;
}

// value: twice the place in `jacobian`, plus the side.
std::vector<Entry> row_entries(const Layout& out) {
  std::vector<Entry> entries;
  const auto add = [&](std::size_t place, std::uint32_t line, std::size_t side) {
    if (line) entries.push_back({line, static_cast<std::uint32_t>(2 * place + side)});
  };
  if (out.stored)
    for (std::size_t c = 0; c < out.contacts; ++c)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t side = 0; side < 2; ++side)
          add(k * out.stride + c, out.line[side * out.stride + c], side);
  const std::size_t ahead = out.stored ? 3 * out.stride : 0;
  for (std::size_t r = 0; r < out.rows; ++r)
    for (std::size_t side = 0; side < 2; ++side)
      add(ahead + r, out.line[2 * out.stride + side * out.row_stride + r], side);
  return entries;
}

// One work item reads a list, and neighbours read neighbouring lists, so numbers are in the order of the
// lists.
void fill_list_numbers(Layout& out) {
  const std::size_t n = out.contact_list.size(), m = out.row_list.size(), stride = out.jacobian_stride();
  out.list_arm.resize(3 * n);
  for (std::size_t e = 0; e < n; ++e) {
    const std::size_t c = out.contact_list[e] / 2;
    const int arm = out.contact_list[e] % 2 ? Layout::arm_b : Layout::arm_a;
    for (std::size_t k = 0; k < 3; ++k)
      out.list_arm[k * n + e] = out.contact[(static_cast<std::size_t>(arm) + k) * out.stride + c];
  }
  out.list_row.resize(6 * m);
  const std::size_t ahead = out.stored ? 0 : 3 * out.stride;
  for (std::size_t e = 0; e < m; ++e) {
    const std::size_t place = out.row_list[e] / 2, side = out.row_list[e] % 2;
    for (std::size_t k = 0; k < 6; ++k)
      out.list_row[k * m + e] = out.jacobian[(6 * side + k) * stride + place];
    // From here on the component of a vector.
    out.row_list[e] = static_cast<std::uint32_t>(ahead + place);
  }
}

// Long lists are divided into parts, and their bodies get empty lists: from here on `first` and `first_row`
// hold both ends of a list.
void cut_long_lists(Layout& out) {
  std::vector<std::uint32_t> first = out.first, first_row = out.first_row;
  const std::size_t lines = first.size() - 1;
  out.first.assign(2 * lines, 0);
  out.first_row.assign(2 * lines, 0);
  constexpr auto most = static_cast<std::uint32_t>(Layout::most_entries);
  for (std::size_t i = 0; i < lines; ++i) {
    const std::uint32_t c0 = first[i], c1 = first[i + 1], r0 = first_row[i], r1 = first_row[i + 1];
    if ((c1 - c0) + (r1 - r0) <= most) {
      out.first[2 * i] = c0, out.first[2 * i + 1] = c1;
      out.first_row[2 * i] = r0, out.first_row[2 * i + 1] = r1;
      continue;
    }
    const auto begin = static_cast<std::uint32_t>(out.parts.size() / 4);
    for (std::uint32_t e = c0; e < c1; e += most)
      out.parts.insert(out.parts.end(), {e, std::min(e + most, c1), 0, 0});
    for (std::uint32_t e = r0; e < r1; e += most)
      out.parts.insert(out.parts.end(), {0, 0, e, std::min(e + most, r1)});
    out.large.insert(out.large.end(), {static_cast<std::uint32_t>(i), begin,
                                       static_cast<std::uint32_t>(out.parts.size() / 4)});
  }
}

}  // namespace

bool DeviceLayout::fits(const Problem& problem) {
  return ContactIterate::fits(problem) && !std::get<ContactSystem>(problem.A).constrained;
}

DeviceLayout::DeviceLayout(const Problem& problem)
    : contacts(problem.K.contacts()), rows(problem.rows() - 3 * contacts) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const Places places = places_of(A, problem.graph, contacts, bodies);
  stored = A.contacts.empty();
  stride = padded(contacts);
  row_stride = padded(rows);
  line_stride = padded(bodies + 1);
  contact_of.resize(contacts);
  row_of.resize(rows);
  contact.resize((stored ? 8 : 14) * stride);
  row.resize(4 * row_stride);
  line.resize(2 * stride + 2 * row_stride);
  jacobian.resize(12 * jacobian_stride());
  mass.resize(7 * line_stride);
  fill_contacts(problem, A, places, *this);
  fill_rows(problem, A, places, *this);
  fill_masses(A.bodies, places, *this);
  contact_list = make_lists(contact_entries(*this), bodies + 1, first);
  row_list = make_lists(row_entries(*this), bodies + 1, first_row);
  fill_list_numbers(*this);
  cut_long_lists(*this);
}

namespace {

// The frame of a contact, made from the normal as by ContactBasis. It equals that of the problem.
ContactBasis basis(const Layout& layout, std::size_t c) {
  const double* normal = &layout.contact[Layout::normal * layout.stride + c];
  return ContactBasis(Vec3{normal[0], normal[layout.stride], normal[2 * layout.stride]});
}

}  // namespace

std::vector<double> DeviceLayout::projected(std::span<const double> x0) const {
  std::vector<double> x(3 * contacts + rows);
  std::copy(x0.begin(), x0.end(), x.begin());
  for (std::size_t c = 0; c < contacts; ++c) {
    double* own = &x[3 * static_cast<std::size_t>(contact_of[c])];
    Friction{contact[mu * stride + c]}.project(own, own);
  }
  for (std::size_t r = 0; r < rows; ++r) {
    double* own = &x[3 * contacts + static_cast<std::size_t>(row_of[r])];
    Interval{row[low * row_stride + r], row[high * row_stride + r]}.project(own, own);
  }
  return x;
}

std::vector<double> DeviceLayout::to_passes(std::span<const double> user) const {
  std::vector<double> held(size());
  for (std::size_t c = 0; c < contacts; ++c) {
    const double* own = &user[3 * static_cast<std::size_t>(contact_of[c])];
    const Vec3 v = stored ? Vec3{own[0], own[1], own[2]} : basis(*this, c).to_world(own);
    for (int k = 0; k < 3; ++k) held[static_cast<std::size_t>(k) * stride + c] = v[k];
  }
  for (std::size_t r = 0; r < rows; ++r)
    held[3 * stride + r] = user[3 * contacts + static_cast<std::size_t>(row_of[r])];
  return held;
}

void DeviceLayout::to_user(std::span<const double> held, std::span<double> user) const {
  for (std::size_t c = 0; c < contacts; ++c) {
    double* own = &user[3 * static_cast<std::size_t>(contact_of[c])];
    const Vec3 v{held[c], held[stride + c], held[2 * stride + c]};
    if (stored)
      for (int k = 0; k < 3; ++k) own[k] = v[k];
    else
      basis(*this, c).to_contact(v, own);
  }
  for (std::size_t r = 0; r < rows; ++r)
    user[3 * contacts + static_cast<std::size_t>(row_of[r])] = held[3 * stride + r];
}

}  // namespace amontons
