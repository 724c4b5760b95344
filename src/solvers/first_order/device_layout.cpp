// From a problem to the arrays of a device, in linear time except for the order of the bodies:
//   places   bodies along the curve of the fused passes (body_order), contacts and rows sorted by them
//   lists    the summands of a body: one entry for every side of a contact or row, in ascending order, the
//            order of the sum. The device itself copies arms and rows of D into the order of the lists
//   parts    a list of more than `most_entries` would keep one work item busy while all others wait. Its
//            parts are summed in parallel, and their sums by a tree
//   numbers  the data of contacts, rows and bodies that a pass reads, component by component
// Places and lists follow from the bodies of the blocks and their order alone, and are kept with these.
// Threads take parts of the places, and in sorts ranges of the keys: no bit depends on their number.
#include "amontons/solvers/first_order/device_layout.hpp"

#include <algorithm>
#include <limits>

#include "amontons/problem/contact_diagonal.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/metric.hpp"
#include "solvers/first_order/contact_rows.hpp"
#include "solvers/first_order/link_order.hpp"

namespace amontons {

namespace {

using Layout = DeviceLayout;
using Writer = HostArray<double>::Writer;

// Places that a thread takes at a time: some 0.1 ms of work, long beside the hand-over to a thread.
constexpr std::size_t places_per_part = 4096;
// The processor does not foresee the order along the curve. So contacts are fetched so many ahead.
constexpr std::size_t contacts_ahead = 16;
// The key of an entry that is in no list.
constexpr std::uint32_t no_key = std::numeric_limits<std::uint32_t>::max();

std::size_t padded(std::size_t n) { return (n + 31) / 32 * 32; }

std::size_t parts_of(std::size_t n) { return (n + places_per_part - 1) / places_per_part; }

// f(begin, end) for parts of 0 .. n - 1.
template <class F>
void in_parts(ThreadPool& pool, std::size_t n, const F& f) {
  pool.run(parts_of(n),
           [&](std::size_t part) { f(part * places_per_part, std::min(n, (part + 1) * places_per_part)); });
}

// Entries 0 .. n - 1 by key, ties in their order: list[first[k]] .. are value(entry) of key k. Every thread
// reads all entries and owns the keys of a range, so that it counts and places without the others.
// make_list(size) returns the memory of the list.
struct KeyedEntries {
  std::size_t n, keys;
  std::vector<std::uint32_t>&first, &place;
};
template <class Key, class Value, class MakeList>
void sort_by_key(ThreadPool& pool, const KeyedEntries& entries, const Key& key, const Value& value,
                 const MakeList& make_list) {
  const auto& [n, keys, first, place] = entries;
  const std::size_t owners = std::min<std::size_t>(pool.threads(), keys);
  const auto own_keys = [&](const auto& f) {
    pool.run(owners, [&](std::size_t owner) {
      const auto low = static_cast<std::uint32_t>(owner * keys / owners);
      const auto count = static_cast<std::uint32_t>((owner + 1) * keys / owners) - low;
      for (std::size_t e = 0; e < n; ++e)
        if (const std::uint32_t k = key(e); k - low < count) f(e, k);
    });
  };
  first.assign(keys + 1, 0);
  own_keys([&](std::size_t, std::uint32_t k) { ++first[k + 1]; });
  for (std::size_t k = 0; k < keys; ++k) first[k + 1] += first[k];
  place.assign(first.begin(), first.end());
  std::uint32_t* list = make_list(first[keys]);
  own_keys([&](std::size_t e, std::uint32_t k) { list[place[k]++] = value(e); });
}

void fill_padding(HostArray<double>& array, std::size_t fields, std::size_t from, std::size_t stride) {
  Writer put(array);
  for (std::size_t k = 0; k < fields; ++k)
    for (std::size_t i = from; i < stride; ++i) put(k * stride + i, 0);
}

void prefetch(const ContactGeometry& contact) {
  for (std::size_t at = 0; at <= sizeof contact; at += 64)
    __builtin_prefetch(reinterpret_cast<const char*>(&contact) + at);
}

bool equal(const std::vector<ContactGraph::Link>& a, const std::vector<ContactGraph::Link>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return x.a == y.a && x.b == y.b; });
}

}  // namespace

bool DeviceLayout::fits(const Problem& problem) {
  return ContactIterate::fits(problem) && !std::get<ContactSystem>(problem.A).constrained;
}

DeviceLayout::DeviceLayout(const Problem& problem, unsigned threads, HostMemory memory)
    : memory_(std::move(memory)) {
  fill(problem, threads);
}

void DeviceLayout::fill(const Problem& problem, unsigned threads) {
  const auto& A = std::get<ContactSystem>(problem.A);
  threads_ = automatic_threads(threads, parts_of(problem.K.blocks()));
  PoolLease pool(threads_);
  const bool moved = find_places(problem, *pool);
  contact.resize((stored ? 8 : 14) * stride, memory_);
  row.resize(4 * row_stride, memory_);
  jacobian.resize(12 * jacobian_stride(), memory_);
  mass.resize(7 * line_stride, memory_);
  b.resize(size(), memory_);
  x.resize(size(), memory_);
  if (moved) {
    make_lists(*pool);
    cut_long_lists();
  }
  for (HostArray<std::uint32_t>* array :
       {&line, &first, &contact_list, &first_row, &row_list, &parts, &large})
    array->changed = moved;
  fill_contacts(problem, *pool);
  fill_rows(problem, *pool);
  fill_masses(A.bodies, *pool);
  to_passes(problem.b, false, b, *pool);
}

// Places
// ------------------------------------------------------------------------------------------------------

bool DeviceLayout::find_places(const Problem& problem, ThreadPool& pool) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const ContactGraph& graph = problem.graph;
  const std::size_t n = problem.K.contacts(), m = problem.rows() - 3 * n;
  const std::vector<bool> is_hub = find_hubs(A.bodies.size(), graph.links, n);
  BodyOrder order = order_bodies(A, graph, is_hub, pool);
  const bool as_before = n == contacts && m == rows && stored == A.contacts.empty() &&
                         line_of_.size() == A.bodies.size() && order.moving == moving_ &&
                         equal(graph.links, links_);
  if (as_before) return false;
  contacts = n;
  rows = m;
  bodies = order.moving.size();
  stored = A.contacts.empty();
  stride = padded(contacts);
  row_stride = padded(rows);
  line_stride = padded(bodies + 1);
  links_ = graph.links;
  key_.resize(links_.size());
  in_parts(pool, links_.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) key_[k] = sort_rank(links_[k], order, is_hub);
  });
  const auto sort = [&](std::size_t from, std::size_t count, std::vector<Index>& of) {
    of.resize(count);
    sort_by_key(
        pool, {count, bodies + 1, starts_, place_}, [&](std::size_t e) { return key_[from + e]; },
        [](std::size_t e) { return static_cast<std::uint32_t>(e); },
        [&](std::size_t) { return reinterpret_cast<std::uint32_t*>(of.data()); });
  };
  sort(0, contacts, contact_of);
  sort(contacts, rows, row_of);
  line_of_.assign(A.bodies.size(), 0);
  moving_ = std::move(order.moving);
  for (std::size_t i = 0; i < bodies; ++i) line_of_[moving_[i]] = static_cast<std::uint32_t>(i + 1);
  return true;
}

// Lists
// -------------------------------------------------------------------------------------------------------

// The lines of all places, and the lists by line. Line 0 has no list.
void DeviceLayout::make_lists(ThreadPool& pool) {
  line.resize(2 * stride + 2 * row_stride, memory_);
  const auto line_at = [&](Index body) { return body < 0 ? 0 : line_of_[body]; };
  const auto write = [&](std::size_t n, const std::vector<Index>& of, std::size_t ahead, std::size_t at,
                         std::size_t apart) {
    in_parts(pool, apart, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const ContactGraph::Link link =
            i < n ? links_[ahead + static_cast<std::size_t>(of[i])] : ContactGraph::Link{-1, -1};
        line[at + i] = line_at(link.a);
        line[at + apart + i] = line_at(link.b);
      }
    });
  };
  write(contacts, contact_of, 0, 0, stride);
  write(rows, row_of, contacts, 2 * stride, row_stride);
  const auto key_of = [&](std::size_t at) { return line[at] == 0 ? no_key : line[at]; };
  // Contacts with arms: entry 2 c + side.
  sort_by_key(
      pool, {stored ? 0 : 2 * contacts, bodies + 1, starts_, place_},
      [&](std::size_t e) { return key_of(e % 2 * stride + e / 2); },
      [](std::size_t e) { return static_cast<std::uint32_t>(e); },
      [&](std::size_t n) { return contact_list.resize(n, memory_), contact_list.data(); });
  // Rows of D: those of stored contacts, three each, then the single rows; entry 2 place + side.
  const std::size_t of_contacts = stored ? 6 * contacts : 0;
  sort_by_key(
      pool, {of_contacts + 2 * rows, bodies + 1, row_starts_, place_},
      [&](std::size_t e) {
        return e < of_contacts ? key_of(e % 2 * stride + e / 6)
                               : key_of(2 * stride + e % 2 * row_stride + (e - of_contacts) / 2);
      },
      [&](std::size_t e) {
        const std::size_t component =
            e < of_contacts ? e / 2 % 3 * stride + e / 6 : 3 * stride + (e - of_contacts) / 2;
        return static_cast<std::uint32_t>(2 * component + e % 2);
      },
      [&](std::size_t n) { return row_list.resize(n, memory_), row_list.data(); });
}

// Long lists are divided into parts, and their bodies get empty lists.
void DeviceLayout::cut_long_lists() {
  const std::size_t lines = bodies + 1;
  constexpr auto most = static_cast<std::uint32_t>(most_entries);
  std::vector<std::uint32_t> cut, long_ones;
  first.resize(2 * lines, memory_);
  first_row.resize(2 * lines, memory_);
  for (std::size_t i = 0; i < lines; ++i) {
    const std::uint32_t c0 = starts_[i], c1 = starts_[i + 1], r0 = row_starts_[i], r1 = row_starts_[i + 1];
    const bool is_short = (c1 - c0) + (r1 - r0) <= most;
    first[2 * i] = is_short ? c0 : 0, first[2 * i + 1] = is_short ? c1 : 0;
    first_row[2 * i] = is_short ? r0 : 0, first_row[2 * i + 1] = is_short ? r1 : 0;
    if (is_short) continue;
    const auto begin = static_cast<std::uint32_t>(cut.size() / 4);
    for (std::uint32_t e = c0; e < c1; e += most) cut.insert(cut.end(), {e, std::min(e + most, c1), 0, 0});
    for (std::uint32_t e = r0; e < r1; e += most) cut.insert(cut.end(), {0, 0, e, std::min(e + most, r1)});
    long_ones.insert(long_ones.end(),
                     {static_cast<std::uint32_t>(i), begin, static_cast<std::uint32_t>(cut.size() / 4)});
  }
  parts.resize(cut.size(), memory_);
  large.resize(long_ones.size(), memory_);
  std::copy(cut.begin(), cut.end(), parts.data());
  std::copy(long_ones.begin(), long_ones.end(), large.data());
}

// Numbers
// -----------------------------------------------------------------------------------------------------

// Contacts of files have no arms: their normal is the first axis of their own frame, as in ContactIterate.
void DeviceLayout::fill_contacts(const Problem& problem, ThreadPool& pool) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::vector<Friction>& cones = problem.K.all<Friction>();
  // Where contacts are rows, a block at a time does not know its diagonal.
  const std::vector<BlockMetric> metrics = stored ? block_metrics(problem) : std::vector<BlockMetric>();
  std::atomic<bool> any_compliance{false};
  in_parts(pool, contacts, [&](std::size_t begin, std::size_t end) {
    Writer put(contact);
    bool has_compliance = false;
    for (std::size_t c = begin; c < end; ++c) {
      const auto index = static_cast<std::size_t>(contact_of[c]);
      if (!stored && c + contacts_ahead < end)
        prefetch(A.contacts[static_cast<std::size_t>(contact_of[c + contacts_ahead])]);
      const auto put_vector = [&](int field, const Vec3& v) {
        for (int k = 0; k < 3; ++k) put(static_cast<std::size_t>(field + k) * stride + c, v[k]);
      };
      BlockMetric metric;
      if (stored) {
        put_vector(normal, {1, 0, 0});
        metric = metrics[index];
      } else {
        put_vector(normal, A.contacts[index].normal);
        put_vector(arm_a, A.contacts[index].r_a);
        put_vector(arm_b, A.contacts[index].r_b);
        double d[3];
        contact_diagonal(A, index, d);
        metric = friction_metric(d, problem.P[index]);
      }
      const double E = compliance_of(A, index);
      has_compliance |= E != 0;
      put(mu * stride + c, std::min(cones[index].mu, largest_mu));
      put(p * stride + c, problem.P[index]);
      put(aspect * stride + c, metric.aspect);
      put(p_t * stride + c, metric.tangent);
      put(compliance * stride + c, E);
    }
    if (has_compliance) any_compliance.store(true, std::memory_order_relaxed);
  });
  compliant = any_compliance;
  fill_padding(contact, stored ? 8 : 14, contacts, stride);
}

// Single rows, and the three rows of every stored contact, which precede the single ones in D as in x.
void DeviceLayout::fill_rows(const Problem& problem, ThreadPool& pool) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::vector<Interval> bounds = row_bounds(problem.K);
  const std::size_t ahead = stored ? 3 * stride : 0, apart = jacobian_stride();
  const auto put_row = [apart](Writer& put, const JacobianRow& from, std::size_t place) {
    for (std::size_t k = 0; k < 6; ++k) {
      put(k * apart + place, from.a[k]);
      put((6 + k) * apart + place, from.b[k]);
    }
  };
  in_parts(pool, rows, [&](std::size_t begin, std::size_t end) {
    Writer put(row), put_in_D(jacobian);
    for (std::size_t r = begin; r < end; ++r) {
      const auto index = static_cast<std::size_t>(row_of[r]);
      const std::size_t at = index + (stored ? 3 * contacts : 0);
      put(row_p * row_stride + r, problem.P[contacts + index]);
      put(low * row_stride + r, bounds[index].lo);
      put(high * row_stride + r, bounds[index].hi);
      put(row_compliance * row_stride + r, A.compliance[at]);
      put_row(put_in_D, A.jacobian[at], ahead + r);
    }
  });
  fill_padding(row, 4, rows, row_stride);
  const auto pad_rows = [&](std::size_t from, std::size_t to) {
    Writer put(jacobian);
    for (std::size_t place = from; place < to; ++place) put_row(put, {-1, -1, {}, {}}, place);
  };
  pad_rows(ahead + rows, ahead + row_stride);
  if (!stored) return;
  in_parts(pool, contacts, [&](std::size_t begin, std::size_t end) {
    Writer put(jacobian);
    for (std::size_t c = begin; c < end; ++c)
      for (std::size_t k = 0; k < 3; ++k)
        put_row(put, A.jacobian[3 * static_cast<std::size_t>(contact_of[c]) + k], k * stride + c);
  });
  for (std::size_t k = 0; k < 3; ++k) pad_rows(k * stride + contacts, (k + 1) * stride);
}

void DeviceLayout::fill_masses(const Bodies& all, ThreadPool& pool) {
  in_parts(pool, line_stride, [&](std::size_t begin, std::size_t end) {
    Writer put(mass);
    for (std::size_t at = begin; at < end; ++at) {
      const bool moves = at >= 1 && at <= bodies;  // line 0 is the world, and some pad the last ones
      const std::size_t body = moves ? moving_[at - 1] : 0;
      put(at, moves ? all.inverse_mass[body] : 0);
      for (std::size_t k = 0; k < 6; ++k)
        put((1 + k) * line_stride + at, moves ? all.inverse_inertia[body][k] : 0);
    }
  });
}

// Vectors
// -----------------------------------------------------------------------------------------------------

namespace {

// The frame of a contact, made from the normal as by ContactBasis. It equals that of the problem.
ContactBasis basis(const Layout& layout, std::size_t c) {
  const double* normal = &layout.contact[Layout::normal * layout.stride + c];
  return ContactBasis(Vec3{normal[0], normal[layout.stride], normal[2 * layout.stride]});
}

}  // namespace

void DeviceLayout::start(std::span<const double> x0) {
  PoolLease pool(threads_);
  to_passes(x0, true, x, *pool);
}

void DeviceLayout::to_passes(std::span<const double> user, bool project, HostArray<double>& out,
                             ThreadPool& pool) {
  const auto at = [&](std::size_t i) { return user.empty() ? 0 : user[i]; };
  in_parts(pool, stride, [&](std::size_t begin, std::size_t end) {
    Writer put(out);
    for (std::size_t c = begin; c < end; ++c) {
      Vec3 v;
      if (c < contacts) {
        const std::size_t from = 3 * static_cast<std::size_t>(contact_of[c]);
        double own[3] = {at(from), at(from + 1), at(from + 2)};
        if (project) Friction{contact[mu * stride + c]}.project(own, own);
        v = stored ? Vec3{own[0], own[1], own[2]} : basis(*this, c).to_world(own);
      }
      for (int k = 0; k < 3; ++k) put(static_cast<std::size_t>(k) * stride + c, v[k]);
    }
  });
  Writer put(out);
  for (std::size_t r = 0; r < row_stride; ++r) {
    double own = r < rows ? at(3 * contacts + static_cast<std::size_t>(row_of[r])) : 0;
    if (project && r < rows)
      Interval{row[low * row_stride + r], row[high * row_stride + r]}.project(&own, &own);
    put(3 * stride + r, own);
  }
}

void DeviceLayout::to_user(std::span<const double> held, std::span<double> user) const {
  PoolLease pool(threads_);
  in_parts(*pool, contacts, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      double* own = &user[3 * static_cast<std::size_t>(contact_of[c])];
      const Vec3 v{held[c], held[stride + c], held[2 * stride + c]};
      if (stored)
        for (int k = 0; k < 3; ++k) own[k] = v[k];
      else
        basis(*this, c).to_contact(v, own);
    }
  });
  for (std::size_t r = 0; r < rows; ++r)
    user[3 * contacts + static_cast<std::size_t>(row_of[r])] = held[3 * stride + r];
}

}  // namespace amontons
