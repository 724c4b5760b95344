// The passes of P-SPG-FB and APGD over contacts, rows and bodies, in the common subset of OpenCL C and CUDA C++. The
// arrays are those of include/amontons/solvers/first_order/device_layout.hpp, the formulas those of
// src/solvers/first_order/contact_passes.isa.cpp and cone_lanes.hpp.
//
// Bits: a work group serves a tile of TILE places, whatever its own size is. Sums go from places to tiles by a tree, from
// tiles to one number by strided chains and the same tree, from lists to bodies in the order of the list. So no bit
// depends on the size of a group or on the order of work items. No contraction; division and square root are correctly
// rounded in double precision. tests/support/numpy_iterate.py does the same operations in the same order.
//
// The methods run here as well: their scalars lie in `state`, which kernels of one group change between the passes
// (decide_*). Its arithmetic is that of solvers/first_order/spg.cpp and apgd.cpp, operation by operation. So the host
// launches many iterations and reads once. A kernel that finds state[STOP] set changes nothing.
//
// Bytes per contact and iteration, each array counted once per pass that reads or writes it:
//   direction  normal 24, mu 8, p 8, x 24, u 24 read, d 24 written                                   112
//   bodies     d 24, two arms 48, two places in lists 8                                               80
//   update     lines 8, arms 48, normal 24, mu 8, p 8, x 24, u 24, d 24 read, x 24, u 24 written     216
// that is 408 for P-SPG-FB. APGD reads the x and u before the last, and the metric: 168 + 80 + 264 = 512. A compliance
// adds 16. A body adds 160: its ends of lists 16, its masses 56, its velocity 48 written and 40 or more read again.

#ifdef __OPENCL_VERSION__
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#pragma OPENCL FP_CONTRACT OFF
#define KERNEL __kernel void
#define GLOBAL __global
#define LOCAL __local
#define LOCAL_ARRAY(name, size) __local double name[size]
#define DEVICE static inline
#define BARRIER barrier(CLK_LOCAL_MEM_FENCE)
#define GROUP ((uint)get_group_id(0))
#define GROUPS ((uint)get_num_groups(0))
#define ITEM ((uint)get_local_id(0))
#define ITEMS ((uint)get_local_size(0))
#else
typedef unsigned int uint;
#define KERNEL extern "C" __global__ void
#define GLOBAL
#define LOCAL
#define LOCAL_ARRAY(name, size) __shared__ double name[size]
#define DEVICE static __device__ __forceinline__
#define BARRIER __syncthreads()
#define GROUP ((uint)blockIdx.x)
#define GROUPS ((uint)gridDim.x)
#define ITEM ((uint)threadIdx.x)
#define ITEMS ((uint)blockDim.x)
#endif

#define TILE 256u
#define COULOMB 1u
#define COMPLIANT 2u
#define STORED 4u
// All places of a tile, by the items of the group.
#define FOR_TILE(i) for (uint i = ITEM; i < TILE; i += ITEMS)

// Sizes that all passes need: contacts, rows, and the lengths that their arrays are padded to.
#define SIZES uint contacts, uint rows, uint stride, uint row_stride, uint flags

// The scalars in `state`, all of them doubles. methods.py lists the same names in this order.
enum {
  STOP,       // 0, or why the host is asked: REFRESH, STATIONARY, ENOUGH
  LEFT,       // iterations that may still be made
  COUNT,      // iterations made, each with a record
  STALE,      // iterations since u was formed from scratch
  PERIOD,     // iterations after which it must be
  TOLERANCE,  // of the residual
  SCALE,      // natural map of zero impulses
  LEAST_MAP,  // the smallest residual so far
  AT_START,   // residual of the start: an iterate must be better to be kept
  VECTOR_D,   // numbers of vectors: d,
  NOW,        // x,
  BEFORE,     // the x before,
  BEST,       // the best x,
  U,          // u,
  U_BEFORE,   // the u before
  SUM,        // of the last `collect`
  INFINITE,
  // P-SPG-FB: spg.cpp
  ALPHA, LAMBDA, DG, DPD, DAD, DIFFERENCE, VALUES, ODD, BACKTRACKS, ALPHA_MIN, ALPHA_MAX, SIGMA_MIN, SIGMA_MAX, GAMMA,
  MEMORY,
  // APGD: apgd.cpp
  L, THETA, BETA, BETA_NEXT, LAST, LEAST, ACCEPTED, TRIALS, RELAXATION, ROUNDING, MOST_RISE,
  SCALARS
};
#define REFRESH 1.0
#define STATIONARY 2.0
#define ENOUGH 3.0
#define MAX_BACKTRACKS 60u
// Records of iterations follow: squared natural map, step, backtracks, objective less that of the start, <d, A d>,
// <d, P d>, trials.
#define RECORD 7u
// Vectors lie one after the other: d, u, three x; of APGD a fourth x and a second u.
#define FIRST_X 2u
#define VECTORS GLOBAL const double* state, GLOBAL double* vectors, uint size
#define VECTOR(which) (vectors + (uint)state[which] * size)
// Kernels with barriers do not return before the last one: some drivers of processors hang there.
#define RUNNING (state[STOP] == 0.0)

typedef struct { double x, y, z; } V3;
typedef struct { double v[6]; } V6;

DEVICE V3 v3(double x, double y, double z) { V3 v; v.x = x; v.y = y; v.z = z; return v; }
DEVICE V3 add(V3 a, V3 b) { return v3(a.x + b.x, a.y + b.y, a.z + b.z); }
DEVICE V3 minus(V3 a, V3 b) { return v3(a.x - b.x, a.y - b.y, a.z - b.z); }
DEVICE V3 times(double s, V3 a) { return v3(s * a.x, s * a.y, s * a.z); }
DEVICE double dot3(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
DEVICE V3 cross3(V3 a, V3 b) { return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }
DEVICE V3 load3(GLOBAL const double* v, uint stride, uint i) { return v3(v[i], v[stride + i], v[2u * stride + i]); }
DEVICE void store3(GLOBAL double* v, uint stride, uint i, V3 a) {
  v[i] = a.x;
  v[stride + i] = a.y;
  v[2u * stride + i] = a.z;
}

// Sums ---------------------------------------------------------------------------------------------------------------

// t[0 .. TILE) and `count` such arrays one after the other, each summed into its first place.
DEVICE void tree(LOCAL double* t, uint count) {
  for (uint half_tile = TILE / 2u; half_tile > 0u; half_tile /= 2u) {
    BARRIER;
    for (uint i = ITEM; i < half_tile; i += ITEMS)
      for (uint s = 0u; s < count; ++s) t[s * TILE + i] += t[s * TILE + i + half_tile];
  }
  BARRIER;
}

// The sums of a tile into `partial`, tiles of one sum side by side; tile `at` of so many.
DEVICE void sum_tile(LOCAL double* t, uint count, GLOBAL double* partial, uint at, uint tiles) {
  tree(t, count);
  for (uint s = ITEM; s < count; s += ITEMS) partial[s * tiles + at] = t[s * TILE];
}

// t[s TILE] = the sum of partial[s n] .. [s n + n - 1] for s < 3, and of n_last numbers from 3 n on for s = 3.
DEVICE void collect_sums(GLOBAL const double* partial, uint n, uint n_last, LOCAL double* t) {
  FOR_TILE(i) {
    for (uint s = 0u; s < 4u; ++s) {
      const uint begin = s * n, count = s < 3u ? n : n_last;
      double sum = 0.0;
      for (uint k = i; k < count; k += TILE) sum += partial[begin + k];
      t[s * TILE + i] = sum;
    }
  }
  tree(t, 4u);
}

// Coulomb's cone about n ---------------------------------------------------------------------------------------------

// The projection, in a metric where tangents count `aspect` times: cone_lanes.hpp derives it.
DEVICE V3 project(V3 z, V3 n, double mu, double aspect) {
  const double zn = dot3(z, n);
  const V3 zt = minus(z, times(zn, n));
  const double t = aspect * sqrt(dot3(zt, zt)), m = aspect * mu;
  if (m * t <= -zn) return v3(0.0, 0.0, 0.0);  // first: with mu = 0 inside is 0 <= -0
  if (t <= m * zn) return z;
  const double k = (zn + m * t) / ((1.0 + m * m) * t);
  return add(times(m * k, z), times(k * (t - m * zn), n));
}

// p |x - Pi_K(x - g / p)|^2, formed without cancellation.
DEVICE double natural_map(V3 x, V3 g, V3 n, double mu, double p) {
  const V3 step = v3(g.x / p, g.y / p, g.z / p), z = minus(x, step);
  const double zn = dot3(z, n);
  const V3 zt = minus(z, times(zn, n));
  const double t = sqrt(dot3(zt, zt));
  V3 e = step;
  if (mu * t <= -zn) {
    e = add(step, add(zt, times(zn, n)));
  } else if (t > mu * zn) {
    const double k = (t - mu * zn) / ((1.0 + mu * mu) * t);
    e = add(step, add(times(k, zt), times(-(mu * k * t), n)));
  }
  return p * dot3(e, e);
}

// The De Saxce term mu |u_t|, and u with it along n.
DEVICE double de_saxce(V3 u, V3 n, double mu, uint flags) {
  const V3 ut = cross3(n, u);
  return flags & COULOMB ? mu * sqrt(dot3(ut, ut)) : 0.0;
}

// Rows: intervals ----------------------------------------------------------------------------------------------------

DEVICE double clip(double z, double low, double high) { return z < low ? low : (z > high ? high : z); }
DEVICE double row_map(double x, double u, double p, double low, double high) {
  const double step = u / p, trial = x - step;
  const double e = trial < low ? x - low : (trial > high ? x - high : step);
  return p * (e * e);
}

// Velocities at contacts and rows ------------------------------------------------------------------------------------

// The line of a body: linear and angular velocity, and two doubles that pad it.
DEVICE V6 load_line(GLOBAL const double* lines, uint line) {
  V6 w;
  for (uint k = 0u; k < 6u; ++k) w.v[k] = lines[8u * line + k];
  return w;
}
DEVICE double row_velocity(GLOBAL const double* jacobian, uint stride, uint at, V6 a, V6 b) {
  double s[6];
  for (uint k = 0u; k < 6u; ++k) s[k] = a.v[k] * jacobian[k * stride + at] + b.v[k] * jacobian[(6u + k) * stride + at];
  return ((s[0] + s[1]) + (s[2] + s[3])) + (s[4] + s[5]);
}
// D v of contact c: (v_A + w_A x r_A) - (v_B + w_B x r_B), or by its rows.
DEVICE V3 contact_velocity(GLOBAL const double* contact, GLOBAL const uint* line, GLOBAL const double* jacobian,
                           GLOBAL const double* lines, uint c, uint stride, uint row_stride, uint flags) {
  const V6 a = load_line(lines, line[c]), b = load_line(lines, line[stride + c]);
  if (flags & STORED) {
    const uint all = 3u * stride + row_stride;
    return v3(row_velocity(jacobian, all, c, a, b), row_velocity(jacobian, all, stride + c, a, b),
              row_velocity(jacobian, all, 2u * stride + c, a, b));
  }
  const V3 va = v3(a.v[0], a.v[1], a.v[2]), wa = v3(a.v[3], a.v[4], a.v[5]);
  const V3 vb = v3(b.v[0], b.v[1], b.v[2]), wb = v3(b.v[3], b.v[4], b.v[5]);
  const V3 ra = load3(contact + 8u * stride, stride, c), rb = load3(contact + 11u * stride, stride, c);
  return add(minus(va, vb), minus(cross3(wa, ra), cross3(wb, rb)));
}
// A d of contact c and of row r: D v, and the compliance times d.
DEVICE V3 contact_product(GLOBAL const double* contact, GLOBAL const uint* line, GLOBAL const double* jacobian,
                          GLOBAL const double* lines, V3 d, uint c, uint stride, uint row_stride, uint flags) {
  const V3 q = contact_velocity(contact, line, jacobian, lines, c, stride, row_stride, flags);
  return flags & COMPLIANT ? add(q, times(contact[7u * stride + c], d)) : q;
}
DEVICE double row_product(GLOBAL const double* row, GLOBAL const uint* line, GLOBAL const double* jacobian,
                          GLOBAL const double* lines, double d, uint r, uint stride, uint row_stride, uint flags) {
  const V6 a = load_line(lines, line[2u * stride + r]), b = load_line(lines, line[2u * stride + row_stride + r]);
  const uint ahead = flags & STORED ? 3u * stride : 0u;
  return row_velocity(jacobian, ahead + row_stride, ahead + r, a, b) + row[3u * row_stride + r] * d;
}

// Bodies -------------------------------------------------------------------------------------------------------------

// The impulse on a body by its contacts from c0 to c1 and its rows from r0 to r1 of the lists.
DEVICE V6 gather(GLOBAL const double* v, uint stride, GLOBAL const uint* contact_list, GLOBAL const double* list_arm,
                 uint arms, GLOBAL const uint* row_list, GLOBAL const double* list_row, uint levers, uint c0, uint c1,
                 uint r0, uint r1) {
  V6 w;
  for (uint k = 0u; k < 6u; ++k) w.v[k] = 0.0;
  for (uint e = c0; e < c1; ++e) {
    const uint entry = contact_list[e];
    const V3 x = load3(v, stride, entry / 2u), f = entry % 2u ? v3(-x.x, -x.y, -x.z) : x;
    const V3 m = cross3(load3(list_arm, arms, e), f);
    w.v[0] += f.x;
    w.v[1] += f.y;
    w.v[2] += f.z;
    w.v[3] += m.x;
    w.v[4] += m.y;
    w.v[5] += m.z;
  }
  for (uint e = r0; e < r1; ++e) {
    const double f = v[row_list[e] / 2u];  // the sign is that of the row of D
    for (uint k = 0u; k < 6u; ++k) w.v[k] += f * list_row[k * levers + e];
  }
  return w;
}

// v = M^-1 w into the line; <w, v>.
DEVICE double move(V6 w, GLOBAL const double* mass, uint line_stride, uint line, GLOBAL double* lines) {
  double m[7];
  V6 v;
  for (uint k = 0u; k < 7u; ++k) m[k] = mass[k * line_stride + line];
  for (uint k = 0u; k < 3u; ++k) v.v[k] = m[0] * w.v[k];
  v.v[3] = m[1] * w.v[3] + m[4] * w.v[4] + m[5] * w.v[5];
  v.v[4] = m[4] * w.v[3] + m[2] * w.v[4] + m[6] * w.v[5];
  v.v[5] = m[5] * w.v[3] + m[6] * w.v[4] + m[3] * w.v[5];
  double s[6];
  for (uint k = 0u; k < 6u; ++k) {
    lines[8u * line + k] = v.v[k];
    s[k] = w.v[k] * v.v[k];
  }
  return ((s[0] + s[1]) + (s[2] + s[3])) + (s[4] + s[5]);
}

// lines = M^-1 D'v, and <D'v, M^-1 D'v> by tiles: a work item per body, but for the large ones.
KERNEL bodies(VECTORS, uint which, uint stride, GLOBAL const uint* first, GLOBAL const uint* contact_list,
              GLOBAL const double* list_arm, uint arms, GLOBAL const uint* first_row, GLOBAL const uint* row_list,
              GLOBAL const double* list_row, uint levers, GLOBAL const double* mass, uint line_stride,
              GLOBAL double* lines, GLOBAL double* partial, uint begin, uint bodies_) {
  LOCAL_ARRAY(t, TILE);
  GLOBAL const double* v = VECTOR(which);
  const int running = RUNNING;
  FOR_TILE(i) {
    const uint line = GROUP * TILE + i + 1u;
    double sum = 0.0;
    if (running && line <= bodies_) {
      const V6 w = gather(v, stride, contact_list, list_arm, arms, row_list, list_row, levers, first[2u * line],
                          first[2u * line + 1u], first_row[2u * line], first_row[2u * line + 1u]);
      sum = move(w, mass, line_stride, line, lines);
    }
    t[i] = sum;
  }
  sum_tile(t, 1u, partial + begin, GROUP, GROUPS);
}

// Impulses of the parts of large bodies, eight doubles each.
KERNEL parts(VECTORS, uint which, uint stride, GLOBAL const uint* contact_list, GLOBAL const double* list_arm,
             uint arms, GLOBAL const uint* row_list, GLOBAL const double* list_row, uint levers,
             GLOBAL const uint* part, GLOBAL double* part_lines, uint count) {
  if (!RUNNING) return;
  GLOBAL const double* v = VECTOR(which);
  FOR_TILE(i) {
    const uint k = GROUP * TILE + i;
    if (k < count) {
      const V6 w = gather(v, stride, contact_list, list_arm, arms, row_list, list_row, levers, part[4u * k],
                          part[4u * k + 1u], part[4u * k + 2u], part[4u * k + 3u]);
      for (uint j = 0u; j < 6u; ++j) part_lines[8u * k + j] = w.v[j];
    }
  }
}

// A group per large body adds its parts up; after `bodies`, which left zeros there.
KERNEL large(GLOBAL const double* state, GLOBAL const uint* list, GLOBAL const double* part_lines,
             GLOBAL const double* mass, uint line_stride, GLOBAL double* lines, GLOBAL double* partial, uint begin) {
  LOCAL_ARRAY(t, 6u * TILE);
  const uint line = list[3u * GROUP], end = list[3u * GROUP + 2u];
  FOR_TILE(i) {
    double w[6];
    for (uint j = 0u; j < 6u; ++j) w[j] = 0.0;
    for (uint k = list[3u * GROUP + 1u] + i; k < end; k += TILE)
      for (uint j = 0u; j < 6u; ++j) w[j] += part_lines[8u * k + j];
    for (uint j = 0u; j < 6u; ++j) t[j * TILE + i] = w[j];
  }
  tree(t, 6u);
  if (ITEM == 0u && RUNNING) {
    V6 w;
    for (uint j = 0u; j < 6u; ++j) w.v[j] = t[j * TILE];
    partial[begin + GROUP] = move(w, mass, line_stride, line, lines);
  }
}

// Between the passes -------------------------------------------------------------------------------------------------

// A vector for the next x, which is neither the current nor the best one, nor that before.
DEVICE uint free_vector(GLOBAL const double* state) {
  uint k = FIRST_X;
  while (state[NOW] == (double)k || state[BEST] == (double)k || state[BEFORE] == (double)k)
    ++k;
  return k;
}

// The residual of the current x is known: is it the best one?
DEVICE void compare(GLOBAL double* state, double map) {
  const double residual = sqrt(map) / state[SCALE];
  if (!(residual < state[LEAST_MAP])) return;
  state[LEAST_MAP] = residual;
  if (residual < state[AT_START]) state[BEST] = state[NOW];
}

// The record of an iteration, and whether the next one may begin. An iterate that is to be refreshed is not compared
// before.
DEVICE void end_iteration(GLOBAL double* state, double map, double step, double difference, double trials) {
  GLOBAL double* record = state + SCALARS + RECORD * (uint)state[COUNT];
  record[0] = map;
  record[1] = step;
  record[2] = state[BACKTRACKS];
  record[3] = difference;
  record[4] = state[DAD];
  record[5] = state[DPD];
  record[6] = trials;
  state[COUNT] += 1.0;
  state[STALE] += 1.0;
  state[LEFT] -= 1.0;
  if (state[STALE] >= state[PERIOD] || sqrt(map) / state[SCALE] <= state[TOLERANCE]) {
    state[STOP] = REFRESH;
  } else {
    compare(state, map);
    if (!(state[LEFT] > 0.0)) state[STOP] = ENOUGH;
  }
}

// So many iterations may be made.
KERNEL allow(GLOBAL double* state, double iterations) {
  if (ITEM != 0u) return;
  state[STOP] = 0.0;
  state[LEFT] = iterations;
  state[COUNT] = 0.0;
}

// The first of the sums of a pass; with `fresh` it is the natural map of an x whose u was formed from scratch.
KERNEL collect(GLOBAL const double* partial, GLOBAL double* state, uint n, uint fresh) {
  LOCAL_ARRAY(t, 4u * TILE);
  collect_sums(partial, n, 0u, t);
  if (ITEM != 0u) return;
  state[SUM] = t[0];
  if (!fresh) return;
  state[STALE] = 0.0;
  compare(state, t[0]);
}

// P-SPG-FB -----------------------------------------------------------------------------------------------------------

// d = Pi_K(x - alpha P^-1 g) - x; <d, g>, <d, P d>, <d, E d>. Tiles of contacts, then of rows.
KERNEL direction(VECTORS, GLOBAL const double* contact, GLOBAL const double* row, GLOBAL double* partial, SIZES) {
  LOCAL_ARRAY(t, 3u * TILE);
  const int running = RUNNING;
  GLOBAL const double *x = VECTOR(NOW), *u = VECTOR(U);
  GLOBAL double* d = VECTOR(VECTOR_D);
  const double alpha = state[ALPHA];
  const uint tiles = (contacts + TILE - 1u) / TILE;
  FOR_TILE(i) {
    double dg = 0.0, dPd = 0.0, dEd = 0.0;
    const uint c = GROUP * TILE + i, r = c - tiles * TILE;
    if (GROUP < tiles) {
      if (running && c < contacts) {
        const V3 n = load3(contact, stride, c), xc = load3(x, stride, c), uc = load3(u, stride, c);
        const double mu = contact[3u * stride + c], p = contact[4u * stride + c];
        const V3 g = add(uc, times(de_saxce(uc, n, mu, flags), n));
        const V3 dc = minus(project(minus(xc, times(alpha / p, g)), n, mu, 1.0), xc);
        store3(d, stride, c, dc);
        const double dd = dot3(dc, dc);
        dg = dot3(dc, g);
        dPd = p * dd;
        if (flags & COMPLIANT) dEd = contact[7u * stride + c] * dd;
      }
    } else if (running && r < rows) {
      const uint at = 3u * stride + r;
      const double p = row[r];
      const double dr = clip(x[at] - alpha / p * u[at], row[row_stride + r], row[2u * row_stride + r]) - x[at];
      d[at] = dr;
      dg = dr * u[at];
      dPd = p * (dr * dr);
      dEd = row[3u * row_stride + r] * (dr * dr);
    }
    t[i] = dg;
    t[TILE + i] = dPd;
    t[2u * TILE + i] = dEd;
  }
  sum_tile(t, 3u, partial, GROUP, GROUPS);
}

// x_next = x + lambda d, u += lambda A d; <s, y>, <y, P^-1 y>, the natural map.
KERNEL update(VECTORS, GLOBAL const double* contact, GLOBAL const double* row, GLOBAL const uint* line,
              GLOBAL const double* jacobian, GLOBAL const double* lines, GLOBAL double* partial, SIZES) {
  LOCAL_ARRAY(t, 3u * TILE);
  const int running = RUNNING;
  GLOBAL const double *x = VECTOR(NOW), *d = VECTOR(VECTOR_D);
  GLOBAL double *x_next = vectors + free_vector(state) * size, *u = VECTOR(U);
  const double lambda = state[LAMBDA];
  const uint tiles = (contacts + TILE - 1u) / TILE;
  FOR_TILE(i) {
    double sy = 0.0, yPy = 0.0, map = 0.0;
    const uint c = GROUP * TILE + i, r = c - tiles * TILE;
    if (GROUP < tiles) {
      if (running && c < contacts) {
        const V3 n = load3(contact, stride, c), dc = load3(d, stride, c), old = load3(u, stride, c);
        const double mu = contact[3u * stride + c], p = contact[4u * stride + c];
        const V3 Ad = contact_product(contact, line, jacobian, lines, dc, c, stride, row_stride, flags);
        const V3 s = times(lambda, dc), xc = add(load3(x, stride, c), s);
        V3 y = times(lambda, Ad);
        const V3 uc = add(old, y);
        store3(x_next, stride, c, xc);
        store3(u, stride, c, uc);
        const double term = de_saxce(uc, n, mu, flags);
        y = add(y, times(term - de_saxce(old, n, mu, flags), n));
        sy = dot3(s, y);
        yPy = dot3(y, y) / p;
        map = natural_map(xc, add(uc, times(term, n)), n, mu, p);
      }
    } else if (running && r < rows) {
      const uint at = 3u * stride + r;
      const double p = row[r], s = lambda * d[at];
      const double y = lambda * row_product(row, line, jacobian, lines, d[at], r, stride, row_stride, flags);
      const double xr = x[at] + s, ur = u[at] + y;
      x_next[at] = xr;
      u[at] = ur;
      sy = s * y;
      yPy = y * y / p;
      map = row_map(xr, ur, p, row[row_stride + r], row[2u * row_stride + r]);
    }
    t[i] = sy;
    t[TILE + i] = yPy;
    t[2u * TILE + i] = map;
  }
  sum_tile(t, 3u, partial, GROUP, GROUPS);
}

// After `direction`: spg.cpp, 2 and 3.
KERNEL decide_lambda(GLOBAL const double* partial, GLOBAL double* state, GLOBAL const double* values, uint n,
                     uint n_last) {
  LOCAL_ARRAY(t, 4u * TILE);
  collect_sums(partial, n, n_last, t);
  if (ITEM != 0u || !RUNNING) return;
  const double dPd = t[TILE], limit = -dPd / state[ALPHA];
  const double dg = limit < t[0] ? limit : t[0];
  const double dAd = t[3u * TILE] + t[2u * TILE];
  if (!(dg < 0.0)) {
    state[STOP] = STATIONARY;
    return;
  }
  double maximum = values[0], lambda = 1.0;
  for (uint k = 1u; k < (uint)state[MEMORY]; ++k) maximum = maximum < values[k] ? values[k] : maximum;
  const double room = maximum - state[DIFFERENCE], exact = -dg / dAd;
  uint backtracks = 0u;
  for (; backtracks < MAX_BACKTRACKS; ++backtracks) {
    if (lambda * dg + 0.5 * lambda * lambda * dAd <= room + state[GAMMA] * lambda * dg) break;
    lambda = clip(exact, state[SIGMA_MIN] * lambda, state[SIGMA_MAX] * lambda);
  }
  state[LAMBDA] = lambda;
  state[DG] = dg;
  state[DPD] = dPd;
  state[DAD] = dAd;
  state[BACKTRACKS] = (double)backtracks;
}

// After `update`: spg.cpp, 4 and 5.
KERNEL decide_alpha(GLOBAL const double* partial, GLOBAL double* state, GLOBAL double* values, uint n) {
  LOCAL_ARRAY(t, 4u * TILE);
  collect_sums(partial, n, 0u, t);
  if (ITEM != 0u || !RUNNING) return;
  const double lambda = state[LAMBDA], sy = t[0], yPy = t[TILE], sPs = lambda * lambda * state[DPD];
  state[NOW] = state[BEFORE] = (double)free_vector(state);
  const double difference = state[DIFFERENCE] + (lambda * state[DG] + 0.5 * lambda * lambda * state[DAD]);
  state[DIFFERENCE] = difference;
  state[VALUES] += 1.0;
  if (!(state[VALUES] < state[MEMORY])) state[VALUES] = 0.0;
  values[(uint)state[VALUES]] = difference;
  const double next = sy > 0.0 ? (state[ODD] != 0.0 ? sPs / sy : sy / yPy) : 2.0 * state[ALPHA];
  state[ALPHA] = clip(next, state[ALPHA_MIN], state[ALPHA_MAX]);
  state[ODD] = 1.0 - state[ODD];
  end_iteration(state, t[2u * TILE], state[ALPHA], difference, 1.0);
}

// APGD ---------------------------------------------------------------------------------------------------------------

// y = x + beta (x - x_before) is never stored, nor is u_y = u + beta (u - u_before).
DEVICE V3 extrapolated(V3 now, V3 before, double beta) { return add(now, times(beta, minus(now, before))); }

// d = Pi_K(y - alpha P^-1 g) - y in the metric of APGD, g of y but for the De Saxce term, that of x; <d, P d>,
// <d, P (y - x)>, <d, E d>.
KERNEL momentum_direction(VECTORS, GLOBAL const double* contact, GLOBAL const double* row, GLOBAL double* partial,
                          SIZES) {
  LOCAL_ARRAY(t, 3u * TILE);
  const int running = RUNNING;
  GLOBAL const double *x = VECTOR(NOW), *x_before = VECTOR(BEFORE), *u = VECTOR(U), *u_before = VECTOR(U_BEFORE);
  GLOBAL double* d = VECTOR(VECTOR_D);
  const double alpha = 1.0 / state[L], beta = state[BETA];
  const uint tiles = (contacts + TILE - 1u) / TILE;
  FOR_TILE(i) {
    double dPd = 0.0, dPm = 0.0, dEd = 0.0;
    const uint c = GROUP * TILE + i, r = c - tiles * TILE;
    if (GROUP < tiles) {
      if (running && c < contacts) {
        const V3 n = load3(contact, stride, c), xc = load3(x, stride, c), uc = load3(u, stride, c);
        const V3 y = extrapolated(xc, load3(x_before, stride, c), beta);
        const V3 uy = extrapolated(uc, load3(u_before, stride, c), beta);
        const double mu = contact[3u * stride + c], aspect = contact[5u * stride + c], p = contact[6u * stride + c];
        const V3 g = add(uy, times(de_saxce(uc, n, mu, flags), n));
        // Along the normal p / aspect^2 stands for p.
        const double squared = aspect * aspect, more = 1.0 / squared - 1.0;
        const V3 scaled = add(g, times((squared - 1.0) * dot3(g, n), n));
        const V3 dc = minus(project(minus(y, times(alpha / p, scaled)), n, mu, aspect), y), m = minus(y, xc);
        store3(d, stride, c, dc);
        const double dd = dot3(dc, dc), dn = dot3(dc, n);
        dPd = p * (dd + more * (dn * dn));
        dPm = p * (dot3(dc, m) + more * (dn * dot3(m, n)));
        if (flags & COMPLIANT) dEd = contact[7u * stride + c] * dd;
      }
    } else if (running && r < rows) {
      const uint at = 3u * stride + r;
      const double p = row[r], y = x[at] + beta * (x[at] - x_before[at]), uy = u[at] + beta * (u[at] - u_before[at]);
      const double dr = clip(y - alpha / p * uy, row[row_stride + r], row[2u * row_stride + r]) - y;
      d[at] = dr;
      dPd = p * (dr * dr);
      dPm = p * (dr * (y - x[at]));
      dEd = row[3u * row_stride + r] * (dr * dr);
    }
    t[i] = dPd;
    t[TILE + i] = dPm;
    t[2u * TILE + i] = dEd;
  }
  sum_tile(t, 3u, partial, GROUP, GROUPS);
}

// x_next = y + d and its u, which takes the place of u_before; the natural map.
KERNEL accelerate(VECTORS, GLOBAL const double* contact, GLOBAL const double* row, GLOBAL const uint* line,
                  GLOBAL const double* jacobian, GLOBAL const double* lines, GLOBAL double* partial, SIZES) {
  LOCAL_ARRAY(t, TILE);
  const int running = RUNNING && state[ACCEPTED] != 0.0;
  GLOBAL const double *x = VECTOR(NOW), *x_before = VECTOR(BEFORE), *u = VECTOR(U), *d = VECTOR(VECTOR_D);
  GLOBAL double *x_next = vectors + free_vector(state) * size, *u_before = VECTOR(U_BEFORE);
  const double beta = state[BETA];
  const uint tiles = (contacts + TILE - 1u) / TILE;
  FOR_TILE(i) {
    double map = 0.0;
    const uint c = GROUP * TILE + i, r = c - tiles * TILE;
    if (GROUP < tiles) {
      if (running && c < contacts) {
        const V3 n = load3(contact, stride, c), dc = load3(d, stride, c);
        const double mu = contact[3u * stride + c], p = contact[4u * stride + c];
        const V3 Ad = contact_product(contact, line, jacobian, lines, dc, c, stride, row_stride, flags);
        const V3 xc = add(extrapolated(load3(x, stride, c), load3(x_before, stride, c), beta), dc);
        const V3 uc = add(extrapolated(load3(u, stride, c), load3(u_before, stride, c), beta), Ad);
        store3(x_next, stride, c, xc);
        store3(u_before, stride, c, uc);
        map = natural_map(xc, add(uc, times(de_saxce(uc, n, mu, flags), n)), n, mu, p);
      }
    } else if (running && r < rows) {
      const uint at = 3u * stride + r;
      const double Ad = row_product(row, line, jacobian, lines, d[at], r, stride, row_stride, flags);
      const double xr = x[at] + beta * (x[at] - x_before[at]) + d[at];
      const double ur = u[at] + beta * (u[at] - u_before[at]) + Ad;
      x_next[at] = xr;
      u_before[at] = ur;
      map = row_map(xr, ur, row[r], row[row_stride + r], row[2u * row_stride + r]);
    }
    t[i] = map;
  }
  sum_tile(t, 1u, partial, GROUP, GROUPS);
}

// After `momentum_direction`: apgd.cpp, 1 and 3. A direction that L does not bound is repeated with a larger L.
KERNEL decide_momentum(GLOBAL const double* partial, GLOBAL double* state, uint n, uint n_last, uint flags) {
  LOCAL_ARRAY(t, 4u * TILE);
  collect_sums(partial, n, n_last, t);
  if (ITEM != 0u || !RUNNING) return;
  const double dPd = t[0], dPm = t[TILE], dAd = t[3u * TILE] + t[2u * TILE];
  state[TRIALS] += 1.0;
  state[DPD] = dPd;
  state[DAD] = dAd;
  state[ACCEPTED] = dAd > state[L] * dPd && dPd > 0.0 ? 0.0 : 1.0;
  if (state[ACCEPTED] == 0.0) {
    const double doubled = 2.0 * state[L], seen = (1.0 + state[ROUNDING]) * dAd / dPd;
    state[L] = doubled < seen ? seen : doubled;
    return;
  }
  const int uphill = -(dPd + dPm) > 0.0 || ((flags & COULOMB) && state[LAST] > state[MOST_RISE] * state[LEAST]);
  const double theta = state[THETA], next = 0.5 * theta * (sqrt(theta * theta + 4.0) - theta);
  if (uphill) state[LEAST] = state[INFINITE];
  state[BETA_NEXT] = uphill ? 0.0 : theta * (1.0 - theta) / (theta * theta + next);
  state[THETA] = uphill ? 1.0 : next;
  state[L] *= state[RELAXATION];
}

// After `accelerate`: apgd.cpp, 2 and 4.
KERNEL decide_beta(GLOBAL const double* partial, GLOBAL double* state, uint n) {
  LOCAL_ARRAY(t, 4u * TILE);
  collect_sums(partial, n, 0u, t);
  if (ITEM != 0u || !RUNNING || state[ACCEPTED] == 0.0) return;
  const double next = (double)free_vector(state), u = state[U], trials = state[TRIALS];
  state[BEFORE] = state[NOW];
  state[NOW] = next;
  state[U] = state[U_BEFORE];
  state[U_BEFORE] = u;
  state[BETA] = state[BETA_NEXT];
  state[LAST] = sqrt(t[0]);
  state[LEAST] = state[LAST] < state[LEAST] ? state[LAST] : state[LEAST];
  state[TRIALS] = 0.0;
  end_iteration(state, t[0], 1.0 / state[L], 0.0, trials);
}

// Beside the iteration -----------------------------------------------------------------------------------------------

// The numbers of the lists, in their order: a work item of `bodies` reads a list, its neighbours the next ones. Arms of
// contacts (fields 8 and 11), and six numbers of a row of D.
KERNEL list_arms(GLOBAL const double* contact, uint stride, GLOBAL const uint* contact_list, GLOBAL double* list_arm,
                 uint arms) {
  FOR_TILE(i) {
    const uint e = GROUP * TILE + i;
    if (e < arms) {
      const uint entry = contact_list[e];
      store3(list_arm, arms, e, load3(contact + (entry % 2u ? 11u : 8u) * stride, stride, entry / 2u));
    }
  }
}
// ahead: component of a vector to which the first row of `jacobian` belongs.
KERNEL list_rows(GLOBAL const double* jacobian, uint stride, uint ahead, GLOBAL const uint* row_list,
                 GLOBAL double* list_row, uint levers) {
  FOR_TILE(i) {
    const uint e = GROUP * TILE + i;
    if (e < levers) {
      const uint place = row_list[e] / 2u - ahead, side = row_list[e] % 2u;
      for (uint k = 0u; k < 6u; ++k) list_row[k * levers + e] = jacobian[(6u * side + k) * stride + place];
    }
  }
}

// u = D lines + E x + b after `bodies` of x; the natural map. x and u by their places in `state`.
KERNEL refresh(VECTORS, uint which_x, uint which_u, GLOBAL const double* contact, GLOBAL const double* row,
               GLOBAL const uint* line, GLOBAL const double* jacobian, GLOBAL const double* lines,
               GLOBAL const double* b, GLOBAL double* partial, SIZES) {
  LOCAL_ARRAY(t, TILE);
  GLOBAL const double* x = VECTOR(which_x);
  GLOBAL double* u = VECTOR(which_u);
  const uint tiles = (contacts + TILE - 1u) / TILE;
  FOR_TILE(i) {
    double map = 0.0;
    const uint c = GROUP * TILE + i, r = c - tiles * TILE;
    if (GROUP < tiles) {
      if (c < contacts) {
        const V3 n = load3(contact, stride, c), xc = load3(x, stride, c);
        const double mu = contact[3u * stride + c], p = contact[4u * stride + c];
        const V3 q = contact_product(contact, line, jacobian, lines, xc, c, stride, row_stride, flags);
        const V3 uc = add(q, load3(b, stride, c));
        store3(u, stride, c, uc);
        map = natural_map(xc, add(uc, times(de_saxce(uc, n, mu, flags), n)), n, mu, p);
      }
    } else if (r < rows) {
      const uint at = 3u * stride + r;
      const double q = row_product(row, line, jacobian, lines, x[at], r, stride, row_stride, flags);
      u[at] = q + b[at];
      map = row_map(x[at], u[at], row[r], row[row_stride + r], row[2u * row_stride + r]);
    }
    t[i] = map;
  }
  sum_tile(t, 1u, partial, GROUP, GROUPS);
}

// x'(u + b), twice the objective.
KERNEL objective(VECTORS, GLOBAL const double* b, GLOBAL double* partial, SIZES) {
  LOCAL_ARRAY(t, TILE);
  GLOBAL const double *x = VECTOR(NOW), *u = VECTOR(U);
  const uint tiles = (contacts + TILE - 1u) / TILE;
  FOR_TILE(i) {
    double sum = 0.0;
    const uint c = GROUP * TILE + i, r = c - tiles * TILE, at = 3u * stride + r;
    if (GROUP < tiles) {
      if (c < contacts) sum = dot3(load3(x, stride, c), add(load3(u, stride, c), load3(b, stride, c)));
    } else if (r < rows) {
      sum = x[at] * (u[at] + b[at]);
    }
    t[i] = sum;
  }
  sum_tile(t, 1u, partial, GROUP, GROUPS);
}

// vectors[to] .. = vectors[from] ..
KERNEL copy(GLOBAL double* vectors, uint from, uint to, uint size) {
  FOR_TILE(i) {
    const uint k = GROUP * TILE + i;
    if (k < size) vectors[to + k] = vectors[from + k];
  }
}
