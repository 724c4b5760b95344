#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "amontons/collision/narrow/support_points.hpp"
#include "check.hpp"
#include "collision_scenes.hpp"

using namespace scenes;

namespace {

constexpr double tolerance = 1e-4, pi = 3.14159265358979323846;

std::vector<std::size_t> chosen(const std::vector<SupportPoint>& points, const Vec3& normal = {0, 0, 1}) {
  SupportPoints support;
  std::vector<unsigned char> kept(points.size(), 0);
  support.select(points, normal, tolerance, kept);
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i]) indices.push_back(i);
  return indices;
}

// Points of a grid of n x n over [-0.1, 0.1]^2 with gaps z(x, y).
std::vector<SupportPoint> grid(int n, const std::function<double(double, double)>& z) {
  std::vector<SupportPoint> points;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double x = 0.2 * i / (n - 1) - 0.1, y = 0.2 * j / (n - 1) - 0.1, gap = z(x, y);
      points.push_back({{x, y, 0.5 * gap}, gap, gap});
    }
  return points;
}

// A round sole: two rings of n corners, the outer one at gap 0, and a lifted rim around.
std::vector<SupportPoint> sole(int n) {
  std::vector<SupportPoint> points;
  for (int k = 0; k < n; ++k)
    for (const auto& [radius, gap] : {std::pair{0.1, 0.0}, {0.06, 0.0}, {0.11, 5e-3}}) {
      const double a = 2 * pi * k / n;
      points.push_back({{radius * std::cos(a), 0.5 * radius * std::sin(a), 0.5 * gap}, gap, gap});
    }
  return points;
}

double area_of(const std::vector<SupportPoint>& points, const std::vector<std::size_t>& indices) {
  Polygon p;
  for (std::size_t i : indices) p.push_back({points[i].point.x, points[i].point.y});
  return area(hull_of(p));
}

}  // namespace

// A rectangle keeps its four corners and nothing of what lies between them, however fine. Fails if a corner
// is lost to the simplification of the outline, or if points within or on the sides come along.
TEST(a_flat_grid_keeps_its_corners) {
  for (int n : {2, 3, 10, 40}) {
    const auto points = grid(n, [](double, double) { return 0.0; });
    const auto last = static_cast<std::size_t>(n - 1), all = static_cast<std::size_t>(n);
    CHECK(chosen(points) == std::vector<std::size_t>{0, last, all * last, all * all - 1});
  }
}

// Twelve corners of an ellipse of 40 cover what a regular dodecagon covers of its circle, 12 sin(30 deg) / (2
// pi), but for corners that stand 9 degrees apart: 2 % less at most. What is lifted far beyond reach does
// not count.
TEST(a_round_sole_keeps_its_area) {
  const auto points = sole(40);
  const auto kept = chosen(points);
  CHECK(kept.size() == 12);
  CHECK(area_of(points, kept) >= 0.98 * 3 / pi * pi * 0.1 * 0.05);
  for (std::size_t i : kept) CHECK(points[i].gap == 0);
}

// The same points whatever the last bits of the gaps (those of a body that rests are good to 1e-10 m), and
// whichever way the normal looks: fails if a choice between points that are alike hangs on rounding. A body
// that rocks on its rim has all of them and up to six corners of that side more.
TEST(the_choice_does_not_flicker) {
  const auto points = sole(40);
  const auto kept = chosen(points);
  Random random;
  for (int k = 0; k < 1000; ++k) {
    auto noisy = points;
    for (SupportPoint& p : noisy) {
      p.gap += 1e-10 * random();
      p.end = p.gap - 1e-3 + 1e-10 * random();
    }
    CHECK(chosen(noisy) == kept);
    const Quat turned = exponential(3 * random.vector());
    auto elsewhere = noisy;
    for (SupportPoint& p : elsewhere) p.point = rotate(turned, p.point);
    CHECK(chosen(elsewhere, rotate(turned, {0, 0, 1})) == kept);
    const double a = 1e-4 * random(), b = 1e-4 * random();
    for (SupportPoint& p : noisy) {
      p.gap += a * p.point.x + b * p.point.y;
      p.end = p.gap;
    }
    const auto rocked = chosen(noisy);
    CHECK(rocked.size() <= kept.size() + 6);
    CHECK(std::includes(rocked.begin(), rocked.end(), kept.begin(), kept.end()));
  }
}

// Whichever way a body with a round belly turns by little, the points that are kept hold it where all would,
// to the tolerance twice: once for what select() accepts, once for axes between the eight that it tries (45
// degrees apart, at slopes that lift the side by ten tolerances). Fails if depth inside the outline is
// overlooked, or one of two ends of a line.
TEST(bellies_and_edges_keep_what_they_would_rock_on) {
  const std::vector<std::function<double(double, double)>> bellies{
      [](double x, double y) { return 2 * (x * x + y * y); },          // a ball
      [](double x, double) { return 2 * x * x; },                      // a drum
      [](double x, double y) { return 2 * x * x + 0.1 * y * y; },      // a barrel
      [](double x, double y) { return std::max(0.0, x) + 2 * y * y; }  // an edge that turns into a slope
  };
  for (const auto& belly : bellies) {
    const auto points = grid(41, belly);
    const auto kept = chosen(points);
    CHECK(kept.size() <= 12);
    for (double slope : {0.0, 1e-3, 5e-3})
      for (int k = 0; k < 64; ++k) {
        const double a = 2 * pi * k / 64, u = slope * std::cos(a), v = slope * std::sin(a);
        const auto height = [&](const SupportPoint& p) { return p.gap - u * p.point.x - v * p.point.y; };
        double least = 1, held = 1;
        for (const SupportPoint& p : points) least = std::min(least, height(p));
        for (std::size_t i : kept) held = std::min(held, height(points[i]));
        CHECK(held - least <= 2 * tolerance);
      }
  }
}

// A plate that stands on one edge now and will lie flat at the end of the step has the far edge among its
// points. Fails if the motion is not looked at.
TEST(what_the_motion_brings_down_is_kept) {
  auto points = grid(10, [](double x, double) { return 0.1 * (x + 0.1); });
  for (SupportPoint& p : points) p.end = 0;
  const auto kept = chosen(points);
  for (std::size_t corner : {0u, 9u, 90u, 99u}) CHECK(std::count(kept.begin(), kept.end(), corner) == 1);
  CHECK(kept.size() <= 8);
}
