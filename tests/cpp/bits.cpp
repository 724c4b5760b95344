// Hashes of what scenes do, for comparison between systems: their bits must be the same on all.
//
//   amontons_bits FOLDER [THREADS ...]
//
// FOLDER holds models of write_model() and the table scenes.txt, a line each: file, steps, dt (s), tolerance,
// margin (m, 0: automatic), method. tools/same_bits.py writes it and compares the outputs. Each line printed
// is: scene, law, threads, instruction set, hash of positions, orientations, velocities and impulses.
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "amontons/base/isa.hpp"
#include "amontons/multibody/step/simulation.hpp"

using namespace amontons;

namespace {

struct Scene {
  std::string file, method;
  std::size_t steps = 0;
  double dt = 0, tolerance = 0, margin = 0;
};

// FNV-1a by words (Fowler, Noll, Vo): every bit of every number counts, in order.
class Hash {
 public:
  void add(double value) { state_ = (state_ ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3u; }
  void add(const Vec3& v) { add(v.x), add(v.y), add(v.z); }
  void add(const Quat& q) { add(q.w), add(q.x), add(q.y), add(q.z); }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325u;
};

std::uint64_t hash_of(const Scene& scene, const Model& model, Law law, unsigned threads) {
  SimulationOptions options;
  options.dt = scene.dt;
  options.law = law;
  options.method = scene.method;
  options.tolerance = scene.tolerance;
  options.margin = scene.margin;
  options.threads = threads;
  Simulation simulation(model, options);
  for (std::size_t k = 0; k < scene.steps; ++k) simulation.step();
  Hash hash;
  const State& s = simulation.state();
  for (const Vec3& v : s.positions) hash.add(v);
  for (const Quat& q : s.orientations) hash.add(q);
  for (const Vec3& v : s.linear_velocities) hash.add(v);
  for (const Vec3& v : s.angular_velocities) hash.add(v);
  for (double x : simulation.impulses()) hash.add(x);
  return hash.value();
}

const char* name(Isa isa) { return isa == Isa::avx512 ? "avx512" : isa == Isa::avx2 ? "avx2" : "baseline"; }

int print(const std::string& folder, const std::vector<unsigned>& threads) {
  std::ifstream table(folder + "/scenes.txt");
  int lines = 0;
  for (Scene s; table >> s.file >> s.steps >> s.dt >> s.tolerance >> s.margin >> s.method; ++lines) {
    const Model model = Model::from_json(folder + "/" + s.file + ".json");
    for (const Law law : {Law::coulomb, Law::associated})
      for (const unsigned t : threads) {
        std::printf("%s %s %u %s %016llx\n", s.file.c_str(), law == Law::coulomb ? "coulomb" : "associated",
                    t, name(active_isa()), static_cast<unsigned long long>(hash_of(s, model, law, t)));
        std::fflush(stdout);
      }
  }
  return lines ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  std::vector<unsigned> threads;
  for (int i = 2; i < argc; ++i) threads.push_back(static_cast<unsigned>(std::atoi(argv[i])));
  try {
    return print(argv[1], threads.empty() ? std::vector<unsigned>{1} : threads);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
