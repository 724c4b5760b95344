// Many simulations at once.
#include <cmath>
#include <limits>
#include <type_traits>

#include "amontons/base/error.hpp"
#include "amontons/multibody/kinematics/motion.hpp"
#include "amontons/multibody/worlds/worlds.hpp"
#include "check.hpp"
#include "vectors.hpp"

using namespace amontons;
using small::same_bits;

namespace {

constexpr std::size_t records = 7, repeat = 3;

// A box that slides on the floor, pulled by a motor along x.
std::shared_ptr<Model> driven_box() {
  ModelDescription d;
  d.gravity = {0, 0, -10};
  // In place: GCC 12 with sanitizers takes the shape that an assignment replaces for uninitialised.
  const auto add_geom = [&](Index body, const auto& shape) {
    Geom& geom = d.geoms.emplace_back();
    geom.body = body;
    geom.shape.emplace<std::remove_cvref_t<decltype(shape)>>(shape);
  };
  add_geom(world, Plane{});
  Body body;
  body.mass = 2;
  body.inertia = Mat3::diagonal(1, 1, 1);
  body.pose.position = {0, 0, 0.5};
  d.bodies.push_back(body);
  add_geom(0, Box{{0.5, 0.5, 0.5}});
  Body pusher = body;
  pusher.pose.position = {-1.2, 0, 0.6};
  d.bodies.push_back(pusher);
  add_geom(1, Sphere{0.4});
  Joint slide;
  slide.body_a = 1;
  slide.frame_b.position = {-1.2, 0, 0.6};
  Dof dof;
  dof.kind = Dof::Kind::slide;
  dof.axis = {1, 0, 0};
  slide.dofs.push_back(dof);
  d.joints.push_back(slide);
  Actuator motor;
  motor.name = "motor";
  motor.transmission.joint = 0;
  d.actuators.push_back(motor);
  return std::make_shared<Model>(d);
}

std::vector<std::shared_ptr<Simulation>> make_worlds(const std::shared_ptr<Model>& model, std::size_t count,
                                                     unsigned threads_of_each = 1) {
  std::vector<std::shared_ptr<Simulation>> worlds;
  for (std::size_t i = 0; i < count; ++i) {
    SimulationOptions options;
    options.threads = threads_of_each;
    worlds.push_back(std::make_shared<Simulation>(model, options));
    worlds.back()->state().linear_velocities[0].x = 0.1 * static_cast<double>(i);
  }
  return worlds;
}

std::vector<double> efforts(std::size_t worlds) {
  std::vector<double> out(worlds * records);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = 30 * std::sin(static_cast<double>(i));
  return out;
}

}  // namespace

// Breaks when a world gets the controls or the rows of another one, or its bits depend on the threads: the
// reference is a plain loop.
TEST(worlds_on_threads_are_as_alone) {
  const auto model = driven_box();
  const Tree tree(model);
  constexpr std::size_t count = 5;
  const std::vector<double> controls = efforts(count);
  std::vector<double> q, qd;
  for (auto worlds = make_worlds(model, count); const auto& world : worlds) {
    const auto row = static_cast<std::size_t>(&world - worlds.data());
    for (std::size_t r = 0; r < records; ++r) {
      world->state().controls[0] = controls[row * records + r];
      for (std::size_t k = 0; k < repeat; ++k) world->step();
      const Coordinates c = read_coordinates(tree, world->state());
      q.insert(q.end(), c.q.begin(), c.q.end());
      qd.insert(qd.end(), c.qd.begin(), c.qd.end());
    }
  }
  for (unsigned threads : {1u, 2u, 3u, 8u})
    for (unsigned threads_of_each : {1u, 2u}) {
      const auto worlds = make_worlds(model, count, threads_of_each);
      const Course course = run_worlds(tree, worlds, {records, repeat, controls, threads}, {});
      CHECK(same_bits(course.q, q) && same_bits(course.qd, qd));
      CHECK(course.done == std::vector<std::size_t>(count, records) && !course.interrupted);
      CHECK(course.missed == std::vector<std::uint64_t>(count * records));
      CHECK(worlds[0]->state().steps == records * repeat);
    }
}

// Breaks when a world that cannot go on stops the others, is not told of, or leaves rows that look like a
// motion.
TEST(a_world_that_fails_on_a_thread) {
  const auto model = driven_box();
  const Tree tree(model);
  std::vector<double> controls = efforts(3);
  controls[records + 4] = std::numeric_limits<double>::infinity();
  const Course course = run_worlds(tree, make_worlds(model, 3), {records, repeat, controls, 2}, {});
  CHECK(course.failures[0].empty() && course.failures[2].empty());
  CHECK(course.failures[1].find("\"motor\"") != std::string::npos);
  CHECK(course.done == (std::vector<std::size_t>{records, 4, records}));
  const std::size_t row = (records + 4) * tree.nq();
  CHECK(std::isfinite(course.q[row - 1]) && std::isnan(course.q[row]));
  CHECK(std::isfinite(course.residuals[records + 3]) && std::isnan(course.residuals[records + 4]));
}

// Breaks when a step from a changed state has other bits on another thread or after another one, or when an
// entry is not the one that was named: the motor is a load on the pusher along x, rates are entries of it.
TEST(steps_by_threads_from_changed_states) {
  const auto model = driven_box();
  Simulation before(model, {});
  for (int k = 0; k < 3; ++k) before.step();
  using Entry = Change::Entry;
  std::vector<Change> changes{{}, {Entry::control, 0, 1.0}, {Entry::held_control, 0, 1.0}};
  const std::size_t nv = before.tree().nv(), width = 3 * nv;
  for (std::size_t k = 0; k < nv; ++k) changes.push_back({Entry::qd, k, 1e-3});
  for (std::size_t k = 0; k < nv; ++k) changes.push_back({Entry::q, k, 1e-3});
  const std::vector<double> q = read_coordinates(before.tree(), before.state()).q;
  const ChangedSteps one = make_changed_steps(before, changes, q, false, 1, {});
  const ChangedSteps two = make_changed_steps(before, changes, q, false, 3, {});
  CHECK(one.failure.empty() && !one.interrupted && one.rows.size() == changes.size() * width);
  CHECK(one.rows == two.rows);
  Simulation whole(before);
  whole.step();
  const Coordinates end = read_coordinates(whole.tree(), whole.state());
  for (std::size_t k = 0; k < nv; ++k) CHECK_NEAR(one.rows[2 * nv + k], end.qd[k], 1e-9);
  const auto moved = [&](std::size_t row, std::size_t entry) {
    return one.rows[row * width + entry] - one.rows[entry];
  };
  const std::size_t slide = nv - 1;  // the rate of the pusher
  CHECK(moved(1, nv + slide) > 0);
  CHECK_NEAR(moved(1, nv + slide), moved(2, nv + slide), 1e-12);  // the mean of both steps acts
  CHECK_NEAR(moved(3 + slide, nv + slide), 1e-3, 1e-9);
  CHECK_NEAR(moved(3 + nv + slide, slide), 1e-3, 1e-9);
  CHECK_THROWS(make_changed_steps(before, changes, {}, false, 1, {}), "one entry per coordinate");
}

// Breaks when worlds go on after the caller was told to stop.
TEST(threads_of_worlds_stop) {
  const auto model = driven_box();
  const Tree tree(model);
  const auto worlds = make_worlds(model, 2);
  const Course course = run_worlds(tree, worlds, {2, 1000000, {}, 2}, [] { return true; });
  CHECK(course.interrupted && course.done == (std::vector<std::size_t>{0, 0}));
}

// Breaks when two threads may step one world, or worlds are read by the tree of another model.
TEST(worlds_that_are_refused) {
  const auto model = driven_box();
  const Tree tree(model), other(driven_box());
  auto worlds = make_worlds(model, 2);
  CHECK_THROWS(run_worlds(other, worlds, {}, {}), "one model");
  CHECK_THROWS(run_worlds(tree, worlds, {2, 1, std::vector<double>(3), 1}, {}),
               "one row per world and record");
  worlds.push_back(worlds[0]);
  CHECK_THROWS(run_worlds(tree, worlds, {}, {}), "twice");
}
