// Strings around obstacles, rates of tendons, rows over many bodies.
#include <numbers>

#include "check.hpp"
#include "joint_scene.hpp"
#include "multibody/joints/tendons.hpp"
#include "multibody/joints/wrapping.hpp"

using namespace joint_scene;

namespace {

constexpr double pi = std::numbers::pi;

// The length of the string from a to b that touches the sphere of radius r at p first and q last.
double by_way_of(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, double r) {
  const double angle = std::acos(std::clamp(dot(p, q) / (r * r), -1.0, 1.0));
  return norm(p - a) + r * angle + norm(b - q);
}

double length_of(const Vec3& a, const Vec3& b, const std::optional<Wrap>& w) {
  return w ? norm(w->first - a) + w->length + norm(b - w->last) : norm(b - a);
}

// Free bodies, and a tendon past some of them.
Model bodies_with(Random& random, std::size_t count, const Tendon& tendon) {
  ModelDescription d;
  d.gravity = {};
  for (std::size_t i = 0; i < count; ++i) d.bodies.push_back(odd_body(random, random.transform(1.5)));
  d.tendons.push_back(tendon);
  return Model(d);
}

PathElement stop(Index body, const Vec3& at) {
  PathElement e;
  e.body = body;
  e.frame.position = at;
  return e;
}

PathElement obstacle(PathElement::Kind kind, Index body, const Transform& frame, double radius) {
  PathElement e;
  e.kind = kind;
  e.body = body;
  e.frame = frame;
  e.radius = radius;
  return e;
}

struct Placed {
  State state;
  BodyFrames frames;
  BodyMobilities mobility;
  BodyVelocities velocities;
  explicit Placed(const Model& model, double time = 0) : state(initial_state(model)) {
    // Bodies moved by their velocities, poses of rotations about the frame's origin.
    for (std::size_t i = 0; i < model.bodies(); ++i) {
      state.positions[i] += time * state.linear_velocities[i];
      state.orientations[i] = exponential(time * state.angular_velocities[i]) * state.orientations[i];
    }
    place_bodies(model, state, frames, mobility, velocities);
  }
};

}  // namespace

// Breaks when the way around a sphere is not the shortest: no neighbouring touching points, anywhere on the
// sphere, make it shorter, and it is longer than the straight line.
TEST(the_way_round_is_the_shortest) {
  Random random;
  int bent = 0;
  for (int i = 0; i < 400; ++i) {
    const double r = random(0.2, 0.8);
    const Vec3 a = random.vector(1.5), b = random.vector(1.5);
    const auto w = wrap(a, b, PathElement::Kind::sphere, {}, r, std::nullopt);
    if (!w) continue;
    ++bent;
    const double length = length_of(a, b, w);
    CHECK(length >= norm(b - a) - 1e-12);
    CHECK_NEAR(norm(w->first), r, 1e-12);
    CHECK_NEAR(norm(w->last), r, 1e-12);
    CHECK_NEAR(w->length, r * std::acos(std::clamp(dot(w->first, w->last) / (r * r), -1.0, 1.0)), 1e-7);
    // Near the touching points a way by others is longer, of those that do not cut into the sphere.
    for (int k = 0; k < 5; ++k) {
      const Vec3 p = r * normalised(w->first + random.vector(0.05)),
                 q = r * normalised(w->last + random.vector(0.05));
      if (dot(a - p, p) < 0 || dot(b - q, q) < 0) continue;
      CHECK(by_way_of(a, b, p, q, r) >= length - 1e-9);
    }
  }
  CHECK(bent > 20);
}

// Breaks when the string that must pass through an obstacle does not take the shortest of such ways: the
// point that a search over the circle finds.
TEST(the_way_through_is_the_shortest) {
  Random random;
  int bent = 0;
  for (int i = 0; i < 400; ++i) {
    const double r = random(0.1, 0.4);
    Vec3 a = random.vector(1.5), b = random.vector(1.5);
    a.z = b.z = 0;
    const auto w = wrap(a, b, PathElement::Kind::cylinder, {}, r, Vec3{0.01, 0, 0});
    if (!w) continue;
    ++bent;
    double shortest = infinity;
    for (int k = 0; k < 20000; ++k) {
      const double angle = 2 * pi * k / 20000;
      const Vec3 p = r * Vec3{std::cos(angle), std::sin(angle), 0};
      shortest = std::min(shortest, norm(p - a) + norm(b - p));
    }
    CHECK_NEAR(length_of(a, b, w), shortest, 1e-6);  // the spacing of the search, squared
  }
  CHECK(bent > 20);
}

// Breaks when the row of a tendon is not the derivative of its length, around obstacles that move, through
// them, on the far side, and after pulleys: central differences of the length along a motion.
TEST(rates_are_derivatives) {
  Random random;
  using Kind = PathElement::Kind;
  int bent = 0;
  for (int i = 0; i < 200; ++i) {
    Tendon t;
    PathElement around = obstacle(i % 2 ? Kind::sphere : Kind::cylinder, 1, random.transform(0.2), 0.5);
    if (i % 3) {
      around.side_body = 1;
      around.side = around.frame.position + (i % 3 == 1 ? 0.2 : 2) * random.unit();
    }
    PathElement pulley;
    pulley.kind = Kind::pulley;
    pulley.divisor = 2;
    t.path = {stop(0, random.vector(0.3)),
              around,
              stop(2, random.vector(0.3)),
              pulley,
              stop(world, random.vector()),
              stop(3, random.vector(0.3)),
              stop(0, {})};
    const Model model = bodies_with(random, 4, t);
    constexpr double step = 1e-6;
    const Placed now(model), before(model, -step), after(model, step);
    const auto length = [&](const Placed& p) { return tendon_length(model, p.frames, p.state, 0); };
    const Line line = tendon_line(model, now.frames, now.state, 0);
    const double rate = (length(after) - length(before)) / (2 * step);
    // Where the string comes off or on within the step, the difference is of the kink.
    if (std::abs(length(after) - 2 * line.length + length(before)) > 1e-9) continue;
    bent += line.row.body.size() == 4 &&
            std::find(line.row.body.begin(), line.row.body.end(), 1) != line.row.body.end();
    CHECK_NEAR(row_velocity(line.row, now.velocities), rate, 1e-7);
  }
  CHECK(bent > 20);
}

// Breaks when a row over more bodies than fit, by way of one auxiliary body (7), several (13, 20), or none
// (2), does not act like the row itself. Reference: the impulse x that stops D v, x = -D v / (D M^-1 D'); of
// the inertia of auxiliary bodies 1e-5 is left.
TEST(wide_rows_act_like_one_row) {
  Random random;
  for (const std::size_t count : {2, 3, 7, 8, 13, 20}) {
    Scene scene;
    for (std::size_t i = 0; i < count; ++i)
      scene.description.bodies.push_back(odd_body(random, random.transform(1)));
    scene.build();
    WideRow wide;
    for (std::size_t i = 0; i < count; ++i) {
      std::array<double, 6> j;
      for (double& entry : j) entry = random();
      wide.add(static_cast<Index>(i), j, 1);
    }
    const double left = 1e-5 * static_cast<double>(count);
    const double x = -row_velocity(wide, scene.free) / inverse_effective_mass(wide, scene.mobility);
    const StepBodies bodies{scene.bodies, scene.mobility, scene.start, scene.free};
    const NarrowRow narrow = narrowed(wide, bodies, 0, {RowKind::tendon, 0, -1}, scene.rows);
    scene.rows.append(Bilateral{}, narrow.row, {0, narrow.offset}, 0, {RowKind::tendon, 0, 0});
    const std::vector<double> solution = scene.solve();
    CHECK_NEAR(solution.back(), x, left * std::abs(x));
    // What reaches the bodies is x along each part.
    const std::vector<BodyVelocity> after = scene.velocities_after(solution);
    for (std::size_t i = 0; i < count; ++i) {
      const auto& j = wide.j[i];
      const Vec3 linear = x * scene.mobility[i].inverse_mass * Vec3{j[0], j[1], j[2]};
      const Vec3 angular = x * (scene.mobility[i].inverse_inertia * Vec3{j[3], j[4], j[5]});
      CHECK_NEAR(norm(after[i].linear - scene.free[i].linear - linear), 0, left * norm(linear));
      CHECK_NEAR(norm(after[i].angular - scene.free[i].angular - angular), 0, left * norm(angular));
    }
    CHECK_NEAR(row_velocity(wide, after), 0, 1e-9);
  }
}

// Breaks when an error of a coupling or tendon is not seen, or in another unit: of a hinge beyond what a
// coupling says by 0.3 rad, of a string by 0.2 m.
TEST(errors_of_couplings_and_tendons) {
  ModelDescription d;
  d.bodies = {unit_body(), unit_body({{3, 0, 0}, {}})};
  d.joints.push_back(joint_of(0, world, {hinge({0, 0, 1})}));
  d.couplings.push_back({"held", 0, 0, -1, 0, {0.3}});
  Tendon string;
  string.path = {stop(world, {}), stop(1, {})};
  string.upper = 3.1;
  d.tendons.push_back(string);
  const auto error = [&] {
    const Model model(d);
    const Placed placed(model);
    return line_error(model, placed.frames, placed.state) / model.length();
  };
  CHECK_NEAR(error(), 0.3, 1e-12);
  d.tendons[0].upper = 2.8;
  d.couplings[0].compliance = 1;  // a spring, no error
  CHECK_NEAR(error(), 0.2, 1e-12);
  d.tendons[0].lower = d.tendons[0].upper = 3.5;
  CHECK_NEAR(error(), 0.5, 1e-12);
}
