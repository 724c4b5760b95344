// The fused passes over contacts, eight lanes at a time: see pass_data.hpp for the layout.
//
// Memory traffic of an iteration in bytes; each array counts once per pass that reads or writes it. Per
// contact: 128 for ContactBatch, minus the unread part, 24 for each of x, u, d and (coulomb only) 8 for s =
// mu |u_t|. Per body: 64 for its line and 64 for its masses:
//  direction  batch 104 + x 24 + u 24 + (s 8) read, d 24 written, lines 64 read + 64 written
//  mass       lines 64 read + 64 written, masses 64 read
//  update     batch 104 + x 24 + u 24 + d 24 + (s 8) read, x_next 24 + u 24 + (s 8) written, lines 64 read
// The sum is 400 per contact (424 under coulomb) and 384 per body. The accelerated iteration reads x beside y
// and the metric in its direction, and moves x, u, y and u_y in its last pass: 528 per contact (544 under
// coulomb).
//
// Three rules keep the bits the same on every instruction set. Every function is correctly rounded. There is
// no fused multiply-add (-ffp-contract=off). Every sum runs over eight lanes and then in the order of
// LaneSums.
#include "solvers/first_order/contact_passes.hpp"

#include "solvers/first_order/cone_lanes.hpp"
#include "solvers/first_order/row_lines.hpp"

namespace amontons::AMONTONS_ISA {

namespace {

// Batches are processed in blocks, in two loops: one with access to lines, one without. One loop with both
// has so long a chain of dependent operations that the processor cannot look ahead into the next batch. Four
// batches between the loops are 768 bytes, well within the L1 cache.
constexpr std::size_t block = 4;

// J'f and J v for three rows of three.
AMONTONS_INLINE Vec3 transposed_times(const double (&J)[3][3][lanes], int lane, const Vec3& f) {
  return f.x * load3(J[0], lane) + f.y * load3(J[1], lane) + f.z * load3(J[2], lane);
}
AMONTONS_INLINE Vec3 times(const double (&J)[3][3][lanes], int lane, const Vec3& v) {
  return {dot(load3(J[0], lane), v), dot(load3(J[1], lane), v), dot(load3(J[2], lane), v)};
}

// lines += D'f for contact impulses f in world coordinates: the wrench (f, r_a x f) on A and its opposite
// (-f, -r_b x f) on B. B after A: if the bodies of a contact share a line (two dummies), both are added.
AMONTONS_INLINE void scatter_batch(const PassData& data, std::size_t i, const double* impulses) {
  const ContactBatch& batch = data.batches[i];
  for (int lane = 0; lane < 8; lane += width) {
    Vec3 f = load3(impulses + 24 * i + lane), ma, mb;
    if (data.contact_rows) {
      const ContactRows& rows = data.contact_rows[i];
      ma = transposed_times(rows.moment_a, lane, f);
      mb = transposed_times(rows.moment_b, lane, f);
      f = transposed_times(rows.force, lane, f);
    } else {
      ma = cross(load3(batch.r_a, lane), f);
      mb = cross(f, load3(batch.r_b, lane));
    }
    scatter_add(data.lines, batch.line_a + lane, {f.x, f.y, f.z, ma.x, ma.y, ma.z});
    scatter_add(data.lines, batch.line_b + lane, {-f.x, -f.y, -f.z, mb.x, mb.y, mb.z});
  }
}

// D w: the velocity of A relative to B at the contact, (v_A + w_A x r_A) - (v_B + w_B x r_B).
AMONTONS_INLINE Vec3 relative_velocity(const PassData& data, std::size_t i, int lane) {
  const ContactBatch& batch = data.batches[i];
  const Vec6 a = gather(data.lines, batch.line_a + lane), b = gather(data.lines, batch.line_b + lane);
  const Vec3 va{a.v[0], a.v[1], a.v[2]}, vb{b.v[0], b.v[1], b.v[2]};
  const Vec3 wa{a.v[3], a.v[4], a.v[5]}, wb{b.v[3], b.v[4], b.v[5]};
  if (data.contact_rows) {
    const ContactRows& rows = data.contact_rows[i];
    return times(rows.force, lane, va - vb) +
           (times(rows.moment_a, lane, wa) + times(rows.moment_b, lane, wb));
  }
  return (va - vb) + (cross(wa, load3(batch.r_a, lane)) - cross(wb, load3(batch.r_b, lane)));
}

// Not std::min, which is an inline function of the library.
AMONTONS_INLINE std::size_t end_of_block(const Chunk& chunk, std::size_t first) {
  return first + block < chunk.last_batch ? first + block : chunk.last_batch;
}

// Clears the lines before every scatter, by the thread that owns the chunk.
void clear_lines(const PassData& data, const Chunk& chunk) {
  const Vec zero = {};
  double* const end = data.lines + 8 * chunk.last_line;
  for (double* p = data.lines + 8 * chunk.first_line; p < end; p += width) store(p, zero);
}

// Prefetches the streams of a later batch: the hardware follows too few at a time. metric: includes the data
// that only the direction with momentum reads.
template <bool metric>
AMONTONS_INLINE void prefetch_batch(const PassData& data, const Chunk& chunk, std::size_t i,
                                    double* written) {
  // Eight batches of some 1.5 kB ahead: early enough for the latency of memory, near enough to stay in the L1
  // cache.
  constexpr std::size_t distance = 8;
  if (i + distance >= chunk.last_batch) return;
  const char* batch = reinterpret_cast<const char*>(data.batches + i + distance);
  constexpr std::size_t read = metric ? sizeof(ContactBatch) : offsetof(ContactBatch, aspect);
  for (std::size_t k = 0; k < read; k += 64) __builtin_prefetch(batch + k);
  for (std::size_t k = 24 * (i + distance); k < 24 * (i + distance + 1); k += 8) {
    __builtin_prefetch(data.x + k);
    __builtin_prefetch(data.u + k);
    __builtin_prefetch(data.d + k);
    __builtin_prefetch(written + k, 1);
  }
}

// One batch of the direction, from x, or with momentum from y:
//  g = u + s n,   d = Pi(x - alpha/p g) - x,
// and its part of <d, g>, <d, P d>, <d, E d>. With momentum the metric of metric.hpp replaces p, and <d, P (y
// - x)>, whose sign is uphill or downhill, replaces <d, g>. Here x is the point from which the step starts.
template <bool coulomb, bool compliant, bool momentum>
AMONTONS_INLINE void direction_of_batch(const PassData& data, std::size_t i, double alpha,
                                        LaneSums<4>& sums) {
  const ContactBatch& batch = data.batches[i];
  for (int part = 0; part < 8 / width; ++part) {
    const int lane = part * width;
    const std::size_t at = 24 * i + lane;
    const Vec3 n = load3(batch.normal, lane), x = load3((momentum ? data.y : data.x) + at);
    const Vec3 u = load3((momentum ? data.u_y : data.u) + at);
    Vec3 g = u;
    if constexpr (coulomb) g = u + load(data.de_saxce + 8 * i + lane) * n;
    const Vec mu = load(batch.mu + lane), one = Vec{} + 1.0;
    if constexpr (momentum) {
      // In the metric p_t / aspect^2 replaces p_t along the normal.
      const Vec aspect = load(batch.aspect + lane), squared = aspect * aspect, p = load(batch.p_t + lane);
      const Vec step = alpha * load(batch.p_t_inverse + lane), more = one / squared - one;
      const Vec3 d = project(x - step * (g + ((squared - one) * dot(g, n)) * n), n, mu, aspect) - x;
      const Vec3 m = x - load3(data.x + at);
      const Vec dd = dot(d, d), dn = dot(d, n);
      store3(data.d + at, d);
      sums.v[1][part] += p * (dd + more * (dn * dn));
      sums.v[3][part] += p * (dot(d, m) + more * (dn * dot(m, n)));
      if constexpr (compliant) sums.v[2][part] += load(data.compliance + 8 * i + lane) * dd;
    } else {
      const Vec3 d = project(x - (alpha * load(batch.p_inverse + lane)) * g, n, mu, one) - x;
      const Vec dd = dot(d, d);
      store3(data.d + at, d);
      sums.v[0][part] += dot(d, g);
      sums.v[1][part] += load(batch.p + lane) * dd;
      if constexpr (compliant) sums.v[2][part] += load(data.compliance + 8 * i + lane) * dd;
    }
  }
}

// The direction pass of a chunk: d of a block of batches, then D'd of that block while d is in the cache.
// Contacts come first, then joint rows.
template <bool coulomb, bool compliant, bool momentum>
PassSums direction(const PassData& data, const Chunk& chunk, double alpha) {
  clear_lines(data, chunk);
  LaneSums<4> sums;
  for (std::size_t first = chunk.first_batch; first < chunk.last_batch; first += block) {
    const std::size_t last = end_of_block(chunk, first);
    for (std::size_t i = first; i < last; ++i)
      direction_of_batch<coulomb, compliant, momentum>(data, i, alpha, sums);
    for (std::size_t i = first; i < last; ++i) {
      prefetch_batch<momentum>(data, chunk, i, data.d);
      scatter_batch(data, i, data.d);
    }
  }
  // The same for joint rows, whose step alpha / p g has no De Saxce term: g = u.
  for_each_joint(
      data, chunk,
      [&](const JointBatch& batch, int lane, int part, std::size_t at) __attribute__((always_inline)) {
        const Vec x = load((momentum ? data.y : data.x) + at), u = load((momentum ? data.u_y : data.u) + at);
        const Vec p = load(batch.p + lane);
        const Vec d = clip(x - alpha * load(batch.p_inverse + lane) * u, batch, lane) - x, dd = d * d;
        store(data.d + at, d);
        sums.v[0][part] += d * u;
        sums.v[1][part] += p * dd;
        sums.v[2][part] += load(batch.compliance + lane) * dd;
        if constexpr (momentum) sums.v[3][part] += p * (d * (x - load(data.x + at)));
      });
  scatter_joints(data, chunk, data.d + data.joint_offset);
  return {{sums.total(0), sums.total(1), sums.total(2), sums.total(3)}};
}

// `width` contacts of a batch in the last pass of an iteration. The data are the place of their lane in the
// batch, the place of their x in the vectors, number of their sum, normal, d and A d.
struct StepLanes {
  std::size_t batch, at;
  int part, lane;
  Vec3 n, d, Ad;
};

// Calls f(lanes) for all contacts of a chunk, with A d = D lines + E d. The velocities of a block of batches
// are gathered first into q. Prefetching costs time if the arrays are in the cache, so only large problems
// use it.
template <bool compliant, class F>
AMONTONS_INLINE void for_each_step(const PassData& data, const Chunk& chunk, F f) {
  alignas(64) double q[block][24];
  for (std::size_t first = chunk.first_batch; first < chunk.last_batch; first += block) {
    const std::size_t last = end_of_block(chunk, first);
    for (std::size_t i = first; i < last; ++i) {
      if (data.streaming) prefetch_batch<false>(data, chunk, i, data.x_next);
      for (int lane = 0; lane < 8; lane += width)
        store3(q[i - first] + lane, relative_velocity(data, i, lane));
    }
    for (std::size_t i = first; i < last; ++i)
      for (int part = 0; part < 8 / width; ++part) {
        const int lane = part * width;
        const std::size_t at = 24 * i + lane;
        const Vec3 n = load3(data.batches[i].normal, lane), d = load3(data.d + at);
        Vec3 Ad = load3(q[i - first] + lane);
        if constexpr (compliant) Ad = Ad + load(data.compliance + 8 * i + lane) * d;
        f(StepLanes{i, at, part, lane, n, d, Ad});
      }
  }
}

// x+ = x + lambda d, u+ = u + lambda A d, and the sums over s = x+ - x and y = g+ - g, where under coulomb
//  y = lambda A d + (s(u+) - s(u)) n.
// s(u) is not formed again: the direction read it from data.de_saxce, where s(u+) now replaces it.
template <bool coulomb>
AMONTONS_INLINE void update_lanes(const PassData& data, const StepLanes& l, double lambda,
                                  LaneSums<3>& sums) {
  const ContactBatch& batch = data.batches[l.batch];
  const Vec step = Vec{} + lambda;
  const Vec3 s = step * l.d, x = load3(data.x + l.at) + s;
  Vec3 y = step * l.Ad;
  const Vec3 u = load3(data.u + l.at) + y;
  store3(data.x_next + l.at, x);
  store3(data.u + l.at, u);
  Vec3 g = u;
  if constexpr (coulomb) {
    const Vec de_saxce = load(batch.mu + l.lane) * tangential_speed(u, l.n);
    double* const old = data.de_saxce + 8 * l.batch + l.lane;
    g = u + de_saxce * l.n;
    y = y + (de_saxce - load(old)) * l.n;
    store(old, de_saxce);
  }
  sums.v[0][l.part] += dot(s, y);
  sums.v[1][l.part] += load(batch.p_inverse + l.lane) * dot(y, y);
  sums.v[2][l.part] += natural_map(batch, l.lane, x, g, l.n);
}

// The update pass of a chunk.
template <bool coulomb, bool compliant>
PassSums update(const PassData& data, const Chunk& chunk, double lambda) {
  LaneSums<3> sums;
  for_each_step<compliant>(data, chunk, [&](const StepLanes& l) __attribute__((always_inline)) {
    update_lanes<coulomb>(data, l, lambda, sums);
  });
  for_each_joint(
      data, chunk,
      [&](const JointBatch& batch, int lane, int part, std::size_t at) __attribute__((always_inline)) {
        // For joint rows g = u, so y = lambda A d.
        const Vec d = load(data.d + at), s = lambda * d;
        const Vec y = lambda * (joint_velocities(data, batch, lane) + load(batch.compliance + lane) * d);
        const Vec x = load(data.x + at) + s, u = load(data.u + at) + y;
        store(data.x_next + at, x);
        store(data.u + at, u);
        sums.v[0][part] += s * y;
        sums.v[1][part] += load(batch.p_inverse + lane) * (y * y);
        sums.v[2][part] += natural_map(batch, lane, x, u);
      });
  return {{sums.total(0), sums.total(1), sums.total(2)}};
}

// x+ = y + d, u+ = u_y + A d, y+ = x+ + beta (x+ - x) and u_y+ = u+ + beta (u+ - u), as A x + b is affine.
// The residual and the stored De Saxce term are those of x+; with this term the next direction starts from
// y+.
template <bool coulomb>
AMONTONS_INLINE void accelerate_lanes(const PassData& data, const StepLanes& l, double beta,
                                      LaneSums<1>& sums) {
  const ContactBatch& batch = data.batches[l.batch];
  const Vec momentum = Vec{} + beta;
  const Vec3 x = load3(data.y + l.at) + l.d, u = load3(data.u_y + l.at) + l.Ad;
  const Vec3 u_y = u + momentum * (u - load3(data.u + l.at));
  store3(data.y + l.at, x + momentum * (x - load3(data.x + l.at)));
  store3(data.u_y + l.at, u_y);
  store3(data.x_next + l.at, x);
  store3(data.u + l.at, u);
  Vec3 g = u;
  if constexpr (coulomb) {
    const Vec mu = load(batch.mu + l.lane);
    const Vec de_saxce = mu * tangential_speed(u, l.n);
    g = u + de_saxce * l.n;
    store(data.de_saxce + 8 * l.batch + l.lane, de_saxce);
  }
  sums.v[0][l.part] += natural_map(batch, l.lane, x, g, l.n);
}

// The accelerate pass of a chunk.
template <bool coulomb, bool compliant>
PassSums accelerate(const PassData& data, const Chunk& chunk, double beta) {
  LaneSums<1> sums;
  for_each_step<compliant>(data, chunk, [&](const StepLanes& l) __attribute__((always_inline)) {
    accelerate_lanes<coulomb>(data, l, beta, sums);
  });
  for_each_joint(data, chunk,
                 [&](const JointBatch& batch, int lane, int part, std::size_t at)
                     __attribute__((always_inline)) {
                       const Vec d = load(data.d + at), momentum = Vec{} + beta, x = load(data.y + at) + d;
                       const Vec Ad = joint_velocities(data, batch, lane) + load(batch.compliance + lane) * d;
                       const Vec u = load(data.u_y + at) + Ad;
                       // x and u are read before they are overwritten: both carry the last iterate into the
                       // momentum.
                       store(data.y + at, x + momentum * (x - load(data.x + at)));
                       store(data.u_y + at, u + momentum * (u - load(data.u + at)));
                       store(data.x_next + at, x);
                       store(data.u + at, u);
                       sums.v[0][part] += natural_map(batch, lane, x, u);
                     });
  return {{sums.total(0)}};
}

// u = D lines + E x + b with lines = M^-1 D'x; stores the De Saxce term of u, from which the next direction
// starts. Too rare to be worth the two loops of the other passes.
template <bool coulomb, bool compliant>
PassSums refresh(const PassData& data, const Chunk& chunk) {
  LaneSums<1> sums;
  for (std::size_t i = chunk.first_batch; i < chunk.last_batch; ++i) {
    const ContactBatch& batch = data.batches[i];
    for (int part = 0; part < 8 / width; ++part) {
      const int lane = part * width;
      const std::size_t at = 24 * i + lane;
      const Vec3 n = load3(batch.normal, lane), x = load3(data.x + at);
      Vec3 u = relative_velocity(data, i, lane);
      if constexpr (compliant) u = u + load(data.compliance + 8 * i + lane) * x;
      u = u + load3(data.b + at);
      store3(data.u + at, u);
      Vec3 g = u;
      if constexpr (coulomb) {
        const Vec de_saxce = load(batch.mu + lane) * tangential_speed(u, n);
        store(data.de_saxce + 8 * i + lane, de_saxce);
        g = u + de_saxce * n;
      }
      sums.v[0][part] += natural_map(batch, lane, x, g, n);
    }
  }
  for_each_joint(data, chunk,
                 [&](const JointBatch& batch, int lane, int part, std::size_t at)
                     __attribute__((always_inline)) {
                       const Vec x = load(data.x + at);
                       const Vec u = joint_velocities(data, batch, lane) + load(batch.compliance + lane) * x +
                                     load(data.b + at);
                       store(data.u + at, u);
                       sums.v[0][part] += natural_map(batch, lane, x, u);
                     });
  return {{sums.total(0)}};
}

// Calls f.operator()<coulomb, compliant>() for the problem. Conditions that are constant within a solve are
// tested once per chunk, and the loops have no branch for them.
template <class F>
AMONTONS_INLINE PassSums in_case(const PassData& data, F f) {
  if (data.compliance)
    return data.coulomb ? f.template operator()<true, true>() : f.template operator()<false, true>();
  return data.coulomb ? f.template operator()<true, false>() : f.template operator()<false, false>();
}

}  // namespace

PassSums direction_pass(const PassData& data, const Chunk& chunk, double alpha) {
  return in_case(data, [&]<bool coulomb, bool compliant>() {
    return direction<coulomb, compliant, false>(data, chunk, alpha);
  });
}

PassSums momentum_direction_pass(const PassData& data, const Chunk& chunk, double alpha) {
  return in_case(data, [&]<bool coulomb, bool compliant>() {
    return direction<coulomb, compliant, true>(data, chunk, alpha);
  });
}

PassSums update_pass(const PassData& data, const Chunk& chunk, double lambda) {
  return in_case(
      data, [&]<bool coulomb, bool compliant>() { return update<coulomb, compliant>(data, chunk, lambda); });
}

PassSums accelerate_pass(const PassData& data, const Chunk& chunk, double beta) {
  return in_case(data, [&]<bool coulomb, bool compliant>() {
    return accelerate<coulomb, compliant>(data, chunk, beta);
  });
}

PassSums refresh_pass(const PassData& data, const Chunk& chunk) {
  return in_case(data,
                 [&]<bool coulomb, bool compliant>() { return refresh<coulomb, compliant>(data, chunk); });
}

// D'x for refresh: the first half of A x, as the direction pass does for A d.
PassSums impulse_pass(const PassData& data, const Chunk& chunk) {
  clear_lines(data, chunk);
  for (std::size_t i = chunk.first_batch; i < chunk.last_batch; ++i) scatter_batch(data, i, data.x);
  scatter_joints(data, chunk, data.x + data.joint_offset);
  return {};
}

// w = M^-1 w per line, (v, omega) = (m^-1 f, I^-1 tau), eight lines transposed to lanes and back. With f =
// D'd the sum of <w before, w after> is <D'd, M^-1 D'd>, the curvature without its part of E. The product A d
// need not be formed on the contacts before lambda is known.
PassSums mass_pass(const PassData& data, const Chunk& chunk) {
  LaneSums<1> sums;
  for (std::size_t line = chunk.first_line; line < chunk.last_line; line += lanes) {
    const MassBatch& mass = data.masses[line / lanes];
    for (int part = 0; part < 8 / width; ++part) {
      const int lane = part * width;
      // Consecutive lines: offsets relative to the first.
      std::uint32_t at[width];
      for (int l = 0; l < width; ++l) at[l] = 8 * static_cast<std::uint32_t>(l);
      double* const lines = data.lines + 8 * (line + static_cast<std::size_t>(lane));
      const Vec6 f = gather(lines, at);
      const Vec m = load(mass.translation + lane);
      const Vec xx = load(mass.inertia[0] + lane), yy = load(mass.inertia[1] + lane);
      const Vec zz = load(mass.inertia[2] + lane), xy = load(mass.inertia[3] + lane);
      const Vec xz = load(mass.inertia[4] + lane), yz = load(mass.inertia[5] + lane);
      const Vec3 force{f.v[0], f.v[1], f.v[2]}, moment{f.v[3], f.v[4], f.v[5]};
      const Vec3 v = m * force;
      const Vec3 w{xx * moment.x + xy * moment.y + xz * moment.z,
                   xy * moment.x + yy * moment.y + yz * moment.z,
                   xz * moment.x + yz * moment.y + zz * moment.z};
      sums.v[0][part] += load(mass.weight + lane) * (dot(v, force) + dot(w, moment));
      scatter(lines, at, {v.x, v.y, v.z, w.x, w.y, w.z});
    }
  }
  return {{sums.total(0)}};
}

}  // namespace amontons::AMONTONS_ISA
