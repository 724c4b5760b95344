// One production iteration (direction, curvature, update) of the fused contact passes on a three-dimensional
// packing of spheres, and the STREAM triad on the same machine.
//
//   contact_kernel [--quick] [--threads N] [--csv FILE]
//
// The packing: spheres at the sites of a cubic lattice with jitter, in contact with their six neighbours
// (three contacts per body) and with the ground, mu = 0.5. Bodies and contacts are numbered at random: to
// order them in memory is the library's work. A run starts at x = 0 and does as many iterations as a solver
// that is on its way; its time per iteration and contact is one sample. Columns:
//   ns_per_contact, best_ns   median over the runs, and the fastest, which neighbours disturb least
//   gb_per_s compulsory traffic by the median: 400 bytes per contact, 24 more under coulomb, 384 per body, as
//            counted in ARCHITECTURE.md; a second copy of a body is not counted
//   triad    a = b + s c, two loads and one store of eight bytes per element as STREAM counts them: median of
//            passes right before and right after the runs, with as many threads, on arrays of 768 MiB each,
//            so that no cache holds a useful part; ratio: gb_per_s over it, meant for the largest problem
//   near     the triad on arrays that have the bytes of the problem together, so that it runs in the cache
//            that holds the problem; near_ratio: gb_per_s over it
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <random>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include "amontons/base/isa.hpp"
#include "amontons/base/threads.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"

namespace {

using namespace amontons;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
  return v[v.size() / 2];
}

Problem sphere_packing(std::size_t contacts) {
  const auto side = static_cast<int>(std::lround(std::cbrt(static_cast<double>(contacts) / 3)));
  const int bodies = side * side * side;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> jitter(-0.1, 0.1);
  std::vector<Index> name(bodies);
  std::iota(name.begin(), name.end(), 0);
  std::shuffle(name.begin(), name.end(), random);

  ContactSystem A;
  A.bodies.inverse_mass.resize(bodies);
  A.bodies.inverse_inertia.resize(bodies);
  std::vector<Vec3> centre(bodies);
  const auto site = [&](int i, int j, int k) { return name[(i * side + j) * side + k]; };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      for (int k = 0; k < side; ++k) {
        const Index body = site(i, j, k);
        centre[body] = {i + jitter(random), j + jitter(random), k + jitter(random)};
        A.bodies.inverse_mass[body] = 1 / (1 + jitter(random));
        const double inertia = A.bodies.inverse_mass[body] / (0.4 * 0.25);
        A.bodies.inverse_inertia[body] = {inertia, inertia, inertia, 0, 0, 0};
      }
  auto& list = A.contacts;
  const auto touch = [&](Index a, Index other) {
    const Vec3 between = centre[a] - centre[other];
    list.push_back(contact_between(a, other, -0.5 * between, 0.5 * between, normalised(between)));
  };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      for (int k = 0; k < side; ++k) {
        const Index body = site(i, j, k);
        if (i + 1 < side) touch(body, site(i + 1, j, k));
        if (j + 1 < side) touch(body, site(i, j + 1, k));
        if (k + 1 < side) touch(body, site(i, j, k + 1));
        if (k == 0) {
          const auto& p = centre[body];
          list.push_back(contact_between(body, -1, {0, 0, -0.5}, p - Vec3{0, 0, 0.5}, {0, 0, 1}));
        }
      }
  std::shuffle(list.begin(), list.end(), random);
  A.contact_compliance.assign(list.size(), 0);
  SetProduct K;
  K.add_each<Friction>(std::vector<double>(list.size(), 0.5));
  // Fall under gravity for one step, with some noise to keep all three regions of the projection busy.
  std::vector<double> b;
  for (const ContactGeometry& c : list) {
    b.push_back(-0.05 * c.normal.z + 0.2 * jitter(random));
    b.push_back(jitter(random));
    b.push_back(jitter(random));
  }
  return make_problem(std::move(A), std::move(b), std::move(K));
}

const ContactSystem& system_of(const Problem& scene) { return std::get<ContactSystem>(scene.A); }

// One iteration as in the solver: alternating Barzilai-Borwein steps, a step that never overshoots along d.
struct Iteration {
  ContactIterate& iterate;
  double alpha = 1;
  int count = 0;
  void operator()() {
    const Direction d = iterate.direction(alpha);
    const double dAd = iterate.curvature();
    const double lambda = std::min(1.0, -d.dg / dAd);
    const Update u = iterate.update(lambda);
    const double sPs = lambda * lambda * d.dPd;
    alpha = count++ % 2 ? sPs / u.sy : u.sy / u.yPy;
    if (!(u.sy > 0)) alpha = 1;
    alpha = std::clamp(alpha, 1e-13, 1e13);
  }
};

struct Timing {
  double median, best;  // s per iteration
};

Timing time_iteration(const Problem& scene, Law law, unsigned threads, bool quick) {
  const std::size_t contacts = system_of(scene).contacts.size();
  const int iterations = contacts > 500000 ? 10 : contacts > 50000 ? 25 : 50;
  const auto work = static_cast<double>(contacts) * iterations;
  const int runs = std::clamp(static_cast<int>((quick ? 1e7 : 1e8) / work), 9, 501);
  ContactIterate iterate(scene, law, threads);
  std::vector<double> times;
  for (int run = 0; run < runs; ++run) {
    iterate.start({});
    Iteration iteration{iterate};
    const auto begin = Clock::now();
    for (int i = 0; i < iterations; ++i) {
      iteration();
      if (i % 3 == 0) iterate.keep_best();  // the buffers rotate as in a solver
    }
    times.push_back(seconds_since(begin) / iterations);
  }
  return {median(times), *std::min_element(times.begin(), times.end())};
}

class Triad {
 public:
  // bytes: of an array.
  Triad(unsigned threads, std::size_t bytes) : pool_(threads), n_(bytes / sizeof(double)) {
    constexpr std::size_t huge_page = std::size_t{1} << 21;
    const std::size_t pages = (bytes + huge_page - 1) / huge_page * huge_page;
    for (double*& p : arrays_) {
      p = static_cast<double*>(std::aligned_alloc(huge_page, pages));
      if (!p) std::abort();
#if defined(__linux__)
      madvise(p, pages, MADV_HUGEPAGE);
#endif
    }
    each_piece([this](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) arrays_[0][i] = 0, arrays_[1][i] = 1, arrays_[2][i] = 2;
    });
  }
  Triad(const Triad&) = delete;
  ~Triad() {
    for (double* p : arrays_) std::free(p);
  }

  // Appends bytes per second of some passes: a few over large arrays, and more over small ones.
  void sample(std::vector<double>& rates) {
    const std::size_t passes = std::max(std::size_t{4}, (std::size_t{1} << 25) / n_);
    for (std::size_t pass = 0; pass < passes; ++pass) {
      const auto begin = Clock::now();
      each_piece([this](std::size_t first, std::size_t last) {
        double* __restrict a = arrays_[0];
        const double* __restrict b = arrays_[1], * __restrict c = arrays_[2];
        for (std::size_t i = first; i < last; ++i) a[i] = b[i] + 3.0 * c[i];
      });
      rates.push_back(24.0 * static_cast<double>(n_) / seconds_since(begin));
    }
  }

 private:
  template <class F>
  void each_piece(F&& f) {
    constexpr std::size_t pieces = 64;
    pool_.run(pieces, [&](std::size_t k) { f(n_ * k / pieces, n_ * (k + 1) / pieces); });
  }
  ThreadPool pool_;
  std::size_t n_;
  double* arrays_[3];
};

const char* isa_name() {
  switch (active_isa()) {
    case Isa::avx512:
      return "avx512";
    case Isa::avx2:
      return "avx2";
    default:
      return "baseline";
  }
}

}  // namespace

int main(int argc, char** argv) {
  bool quick = false;
  unsigned max_threads = 2;
  const char* csv_path = nullptr;
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--quick")) quick = true;
    if (!std::strcmp(argv[i], "--threads") && i + 1 < argc) max_threads = std::atoi(argv[++i]);
    if (!std::strcmp(argv[i], "--csv") && i + 1 < argc) csv_path = argv[++i];
  }
  std::FILE* csv = csv_path ? std::fopen(csv_path, "w") : nullptr;
  if (csv_path && !csv) {
    std::fprintf(stderr, "contact_kernel: cannot write %s\n", csv_path);
    return 1;
  }
  const auto tell = [&](const char* format, auto... values) {
    for (std::FILE* out : {stdout, csv})
      if (out) std::fprintf(out, format, values...), std::fflush(out);
  };
  tell("%s",
       "contacts,law,threads,isa,ns_per_contact,best_ns,gb_per_s,triad_gb_per_s,ratio,"
       "near_gb_per_s,near_ratio\n");
  std::vector<std::size_t> sizes{1000, 10000, 100000, 1000000};
  if (quick) sizes.resize(2);
  for (unsigned threads = 1; threads <= max_threads; threads *= 2) {
    Triad triad(threads, std::size_t{quick ? 64u : 768u} << 20);
    for (std::size_t size : sizes) {
      const Problem scene = sphere_packing(size);
      const auto contacts = static_cast<double>(system_of(scene).contacts.size());
      const auto bodies = static_cast<double>(system_of(scene).bodies.size());
      for (Law law : {Law::associated, Law::coulomb}) {
        const double bytes = (law == Law::coulomb ? 424 : 400) * contacts + 384 * bodies;
        Triad nearby(threads, static_cast<std::size_t>(bytes / 3));
        std::vector<double> rates, near_rates;
        triad.sample(rates);
        nearby.sample(near_rates);
        const Timing t = time_iteration(scene, law, threads, quick);
        triad.sample(rates);
        nearby.sample(near_rates);
        const double rate = bytes / t.median, stream = median(rates), near = median(near_rates);
        const double ns = 1e9 * t.median / contacts, best = 1e9 * t.best / contacts;
        const char* name = law == Law::coulomb ? "coulomb" : "associated";
        tell("%.0f,%s,%u,%s,%.3f,%.3f,%.3f,%.3f,%.4f,%.3f,%.4f\n", contacts, name, threads, isa_name(), ns,
             best, rate / 1e9, stream / 1e9, rate / stream, near / 1e9, rate / near);
      }
    }
  }
  if (csv) std::fclose(csv);
}
