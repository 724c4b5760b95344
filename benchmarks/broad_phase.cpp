// Time of the broad phase per body, for scenes of 10 to 100000 bodies.
//
//   broad_phase [--quick] [--csv FILE]
//
// Scenes, all on a plane (an infinite box) and a floor (one box under everything):
//   heap    equal spheres that touch in a close packing with jitter, a margin of a fiftieth of their radius
//   mixed   boxes with sizes over three powers of ten, about as many overlaps per body
//   rods    bars fifty times as long as thick, all along x
//   sparse  bodies a thousand times smaller than their distances, and one far away
// Columns: first_ns  per body, without an order from an earlier call (the first step of a simulation)
//          next_ns   per body, when the bodies have moved by a hundredth of their size since the last call
// Both are medians over the calls. Bodies are numbered at random: to find an order is the library's work.
#include "amontons/collision/broad_phase.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

namespace {

using namespace amontons;
using Clock = std::chrono::steady_clock;

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
  return v[v.size() / 2];
}

struct Scene {
  std::vector<Aabb> boxes;
  std::vector<unsigned char> fixed;
  std::vector<Ball> balls;  // no bounds: the work of boxes alone
  Bounds bounds() const { return {boxes, balls, fixed}; }
};

void add(Scene& scene, const Vec3& centre, const Vec3& half, bool fixed = false) {
  scene.boxes.push_back({centre - half, centre + half}), scene.fixed.push_back(fixed);
  scene.balls.push_back({centre, std::numeric_limits<double>::infinity()});
}

Scene make_scene(const char* name, int bodies) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto side = static_cast<int>(std::ceil(std::cbrt(bodies)));
  const auto anywhere = [&](double length) {
    const double x = uniform(random), y = uniform(random);
    return Vec3{length * x, length * y, length * uniform(random)};
  };
  Scene scene;
  for (int i = 0; i < bodies; ++i) {
    if (!std::strcmp(name, "heap")) {
      // Face-centred cubic: layers of squares, every other one moved into the hollows of the one below.
      const int x = i % side, y = i / side % side, z = i / side / side;
      const double shift = z % 2;
      const Vec3 jitter = anywhere(0.02);
      add(scene, Vec3{2.0 * x + shift, 2.0 * y + shift, std::sqrt(2.0) * z} + jitter, {1.02, 1.02, 1.02});
    } else if (!std::strcmp(name, "mixed")) {
      const double size = std::pow(10, -3 * uniform(random));
      add(scene, anywhere(1.5 * side), {size, size * (0.2 + uniform(random)), size});
    } else if (!std::strcmp(name, "rods")) {
      add(scene, anywhere(4.0 * side), {25, 0.5, 0.5});
    } else {
      add(scene, anywhere(1000.0 * side), {0.5, 0.5, 0.5});
    }
  }
  if (!std::strcmp(name, "sparse")) scene.boxes[0] = {{1e12, 0, 0}, {1e12, 1, 1}};
  std::shuffle(scene.boxes.begin(), scene.boxes.end(), random);
  constexpr double inf = std::numeric_limits<double>::infinity();
  scene.boxes.push_back({{-inf, -inf, -inf}, {inf, inf, inf}}), scene.fixed.push_back(1);
  add(scene, {0, 0, -1}, {1e4 * side, 1e4 * side, 1}, true);
  return scene;
}

void move(Scene& scene, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-0.01, 0.01);
  for (Aabb& box : scene.boxes) {
    if (!std::isfinite(box.lower.x)) continue;
    const Vec3 size = box.upper - box.lower;
    const Vec3 d{size.x * uniform(random), size.y * uniform(random), size.z * uniform(random)};
    box.lower += d, box.upper += d;
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
  std::FILE* csv = csv_path ? std::fopen(csv_path, "w") : stdout;
  if (!csv) {
    std::fprintf(stderr, "broad_phase: cannot write %s\n", csv_path);
    return 1;
  }
  std::fprintf(csv, "scene,bodies,pairs,first_ns_per_body,next_ns_per_body\n");
  for (const char* name : {"heap", "mixed", "rods", "sparse"})
    for (int bodies : {10, 100, 1000, 10000, 100000}) {
      Scene scene = make_scene(name, bodies);
      std::mt19937 random(11);
      std::vector<IndexPair> pairs;
      const int calls = std::clamp((quick ? 100000 : 1000000) / bodies, 5, 10001);
      const auto time = [&](BroadPhase& phase) {
        const auto begin = Clock::now();
        phase.find_pairs(scene.bounds(), pairs);
        return std::chrono::duration<double>(Clock::now() - begin).count();
      };
      std::vector<double> first, next;
      BroadPhase kept;
      kept.find_pairs(scene.bounds(), pairs);
      for (int call = 0; call < calls; ++call) {
        BroadPhase fresh;
        first.push_back(time(fresh));
        move(scene, random);
        next.push_back(time(kept));
      }
      std::fprintf(csv, "%s,%d,%zu,%.1f,%.1f\n", name, bodies, pairs.size(), 1e9 * median(first) / bodies,
                   1e9 * median(next) / bodies);
      std::fflush(csv);
    }
  if (csv != stdout) std::fclose(csv);
}
