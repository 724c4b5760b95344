// One production iteration (direction, curvature, update) of the fused contact passes on a three-dimensional
// packing of spheres, and the STREAM triad on the same machine.
//
//   contact_kernel [--quick] [--csv FILE]
//
// The packing: spheres at the sites of a cubic lattice with jitter, in contact with their six neighbours (three
// contacts per body) and with a fixed floor, mu = 0.5. Bodies and contacts are numbered at random: to order
// them in memory is the library's work. The bandwidth column divides the compulsory traffic, as counted at the
// head of src/vi/contact_passes.isa.cpp (400 bytes per contact, 24 more under coulomb, and 384 per body; a body
// that is held more than once counts once), by the time; the triad column counts two loads and one store of
// eight bytes per element, as STREAM does, over arrays of 1 GiB each so that no cache holds a useful part.
// Times are medians over repeats.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include "amontons/base/isa.hpp"
#include "amontons/base/threads.hpp"
#include "amontons/vi/contact_stages.hpp"

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

struct Scene {
  ContactOperator A;
  ConeProduct K;
  std::vector<double> b, P;
};

Scene sphere_packing(std::size_t contacts) {
  const auto side = static_cast<int>(std::lround(std::cbrt(static_cast<double>(contacts) / 3)));
  const int bodies = side * side * side;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> jitter(-0.1, 0.1);
  std::vector<Index> name(bodies);
  std::iota(name.begin(), name.end(), 0);
  std::shuffle(name.begin(), name.end(), random);

  Scene scene;
  InverseMass& mass = scene.A.joints.inverse_mass;
  mass.translation.resize(bodies);
  mass.inertia.resize(bodies);
  std::vector<std::array<double, 3>> centre(bodies);
  const auto site = [&](int i, int j, int k) { return name[(i * side + j) * side + k]; };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      for (int k = 0; k < side; ++k) {
        const Index body = site(i, j, k);
        centre[body] = {i + jitter(random), j + jitter(random), k + jitter(random)};
        mass.translation[body] = 1 / (1 + jitter(random));
        const double inertia = mass.translation[body] / (0.4 * 0.25);
        mass.inertia[body] = {inertia, inertia, inertia, 0, 0, 0};
      }
  auto& list = scene.A.contacts;
  const auto touch = [&](Index a, Index other) {
    ContactFrame c{a, other, {}, {}, {}};
    double length = 0;
    for (int k = 0; k < 3; ++k) c.normal[k] = centre[a][k] - centre[other][k], length += c.normal[k] * c.normal[k];
    for (int k = 0; k < 3; ++k) {
      c.normal[k] /= std::sqrt(length);
      c.r_a[k] = -0.5 * std::sqrt(length) * c.normal[k], c.r_b[k] = -c.r_a[k];
    }
    list.push_back(c);
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
          list.push_back({body, -1, {0, 0, -0.5}, {p[0], p[1], p[2] - 0.5}, {0, 0, 1}});
        }
      }
  std::shuffle(list.begin(), list.end(), random);
  scene.A.contact_compliance.assign(list.size(), 0);
  scene.K.add_friction(std::vector<double>(list.size(), 0.5));
  // Fall under gravity for one step, with some noise to keep all three regions of the projection busy.
  for (const ContactFrame& c : list) {
    scene.b.push_back(-0.05 * c.normal[2] + 0.2 * jitter(random));
    scene.b.push_back(jitter(random)), scene.b.push_back(jitter(random));
    const double mean = (c.body_b < 0 ? 1 : 2) * (1 + 2.0 / 3 * 0.25 / 0.1);  // of diag(A), to about 10 %
    scene.P.push_back(mean);
  }
  return scene;
}

// One iteration as in the solver, with the alternating Barzilai-Borwein steps and no line search.
struct Iteration {
  ContactStages& stages;
  double alpha = 1;
  int count = 0;
  void operator()() {
    const Direction d = stages.direction(alpha);
    const double dAd = stages.curvature();
    const double lambda = std::min(1.0, -d.dg / dAd);
    const Update u = stages.update(lambda);
    const double sPs = lambda * lambda * d.dPd;
    alpha = count++ % 2 ? sPs / u.sy : u.sy / u.yPy;
    if (!(u.sy > 0)) alpha = 1;
    alpha = std::clamp(alpha, 1e-13, 1e13);
  }
};

struct Timing {
  double iteration;  // s
  double residual;   // at the end, to show that it did the work
};

Timing time_iteration(const Scene& scene, Law law, unsigned threads, double budget) {
  ContactStages stages(scene.A, scene.K, scene.b, scene.P, law, threads);
  stages.start({});
  Iteration iterate{stages};
  auto begin = Clock::now();
  for (int i = 0; i < 5; ++i) iterate();
  const double guess = seconds_since(begin) / 5;
  const int repeats = 15;
  const int inner = std::max(1, static_cast<int>(budget / repeats / guess));
  std::vector<double> times;
  for (int r = 0; r < repeats; ++r) {
    begin = Clock::now();
    for (int i = 0; i < inner; ++i) iterate();
    times.push_back(seconds_since(begin) / inner);
    if (r % 3 == 0) stages.keep_best();
    stages.start({}), iterate.alpha = 1;
  }
  return {median(times), std::sqrt(stages.refresh())};
}

// a = b + s c. Bytes per second, 24 per element.
double triad(unsigned threads, std::size_t bytes) {
  const std::size_t n = bytes / sizeof(double), huge = std::size_t{1} << 21;
  double* arrays[3];
  for (double*& p : arrays) {
    p = static_cast<double*>(std::aligned_alloc(huge, bytes));
    if (!p) std::abort();
#if defined(__linux__)
    madvise(p, bytes, MADV_HUGEPAGE);
#endif
  }
  ThreadPool pool(threads);
  double *a = arrays[0], *b = arrays[1], *c = arrays[2];
  const std::size_t pieces = 64;
  pool.run(pieces, [=](std::size_t k) {
    for (std::size_t i = n * k / pieces; i < n * (k + 1) / pieces; ++i) a[i] = 0, b[i] = 1, c[i] = 2;
  });
  std::vector<double> times;
  for (int r = 0; r < 9; ++r) {
    const auto begin = Clock::now();
    pool.run(pieces, [=](std::size_t k) {
      const std::size_t last = n * (k + 1) / pieces;
      double* __restrict to = a;
      for (std::size_t i = n * k / pieces; i < last; ++i) to[i] = b[i] + 3.0 * c[i];
    });
    times.push_back(seconds_since(begin));
  }
  for (double* p : arrays) std::free(p);
  return 24.0 * static_cast<double>(n) / median(times);
}

const char* isa_name() {
  switch (active_isa()) {
    case Isa::avx512: return "avx512";
    case Isa::avx2: return "avx2";
    default: return "baseline";
  }
}

}  // namespace

int main(int argc, char** argv) {
  bool quick = false;
  const char* csv_path = nullptr;
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--quick")) quick = true;
    if (!std::strcmp(argv[i], "--csv") && i + 1 < argc) csv_path = argv[++i];
  }
  std::FILE* csv = csv_path ? std::fopen(csv_path, "w") : nullptr;
  if (csv_path && !csv) {
    std::fprintf(stderr, "contact_kernel: cannot write %s\n", csv_path);
    return 1;
  }
  const char* header = "contacts,law,threads,isa,ns_per_contact,gb_per_s,triad_gb_per_s,ratio,residual";
  if (csv) std::fprintf(csv, "%s\n", header);
  std::printf("%9s %-10s %7s %-8s %13s %8s %8s %6s\n", "contacts", "law", "threads", "isa", "ns/contact", "GB/s",
              "triad", "ratio");
  const std::vector<std::size_t> sizes =
      quick ? std::vector<std::size_t>{1000, 10000} : std::vector<std::size_t>{1000, 10000, 100000, 1000000};
  for (unsigned threads : {1u, 2u}) {
    const double stream = triad(threads, std::size_t{1} << (quick ? 26 : 30));
    for (std::size_t size : sizes) {
      const Scene scene = sphere_packing(size);
      for (Law law : {Law::associated, Law::coulomb}) {
        const Timing t = time_iteration(scene, law, threads, quick ? 0.2 : 1.5);
        const auto contacts = static_cast<double>(scene.A.contacts.size());
        const auto bodies = static_cast<double>(scene.A.joints.inverse_mass.bodies());
        const double bytes = (law == Law::coulomb ? 424 : 400) * contacts + 384 * bodies;
        const double rate = bytes / t.iteration, ns = 1e9 * t.iteration / contacts;
        const char* name = law == Law::coulomb ? "coulomb" : "associated";
        std::printf("%9zu %-10s %7u %-8s %13.2f %8.2f %8.2f %6.3f\n", scene.A.contacts.size(), name, threads,
                    isa_name(), ns, rate / 1e9, stream / 1e9, rate / stream);
        std::fflush(stdout);
        if (csv)
          std::fprintf(csv, "%zu,%s,%u,%s,%.3f,%.3f,%.3f,%.4f,%.6g\n", scene.A.contacts.size(), name, threads,
                       isa_name(), ns, rate / 1e9, stream / 1e9, rate / stream, t.residual);
      }
    }
  }
  if (csv) std::fclose(csv);
}
