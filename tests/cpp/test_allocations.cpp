#include <atomic>
#include <new>
#include <string>
#include <vector>

#include "amontons/base/aligned_memory.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"

// Counts what the whole executable allocates.
namespace {
std::atomic<std::size_t> allocations{0};

void* counted(std::size_t size, std::size_t alignment) {
  ++allocations;
  void* memory = amontons::aligned_allocate(alignment, size);
  if (!memory) throw std::bad_alloc();
  return memory;
}

// Not inlined: GCC would see free() of what operator new returned, and warn of a mismatch.
[[gnu::noinline]] void release(void* memory) noexcept { amontons::aligned_free(memory); }
}  // namespace

void* operator new(std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new[](std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t a) {
  return counted(size, static_cast<std::size_t>(a));
}
void* operator new[](std::size_t size, std::align_val_t a) {
  return counted(size, static_cast<std::size_t>(a));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return counted(size,
                 alignof(std::max_align_t));  // as std::stable_sort asks for; running out ends the tests
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }

using namespace amontons;
using small::Vector;

namespace {

std::size_t allocations_of(const Problem& p, std::string_view method, Law law, std::size_t iterations) {
  Options options;
  options.law = law;
  options.tolerance = 0;
  options.max_iterations = iterations;
  solve(p, method, options);  // the scratch of products is kept from call to call
  const std::size_t before = allocations;
  const Solution s = solve(p, method, options);
  const std::size_t count = allocations - before;
  CHECK(s.iterations == iterations);
  return count;
}

}  // namespace

// Breaks when an iteration allocates: fifty and two hundred iterations must allocate equally often up to what
// happens after the last one.
TEST(iterations_do_not_allocate) {
  const Problem contacts = small::stack(12, 30, 0.3), bodies = small::chain(300, true);
  const std::size_t m = contacts.rows();
  const Vector A = small::dense_matrix(contacts.A);
  const Problem dense = make_problem(small::dense_operator(A, m), contacts.b, contacts.K);
  const Problem sparse = make_problem(small::sparse_operator(A, m), contacts.b, contacts.K);
  const auto compare = [](const Problem& p, const char* kind, std::string_view method, Law law) {
    const std::size_t few = allocations_of(p, method, law, 50), many = allocations_of(p, method, law, 200);
    // The search for a certificate after the last iteration allocates, depending on where the solve ended.
    if (many > few + 4)
      check::fail(__FILE__, __LINE__,
                  std::string(method) + " on " + kind + " allocates " + std::to_string(few) +
                      " times in 50 and " + std::to_string(many) + " times in 200 iterations");
  };
  for (Law law : {Law::associated, Law::coulomb})
    for (std::string_view method : {"p-spg-fb", "p-spg-fb-literal", "jacobi", "gauss-seidel", "apgd"}) {
      compare(contacts, "contacts", method, law);
      compare(dense, "a dense matrix", method, law);
      compare(sparse, "a sparse matrix", method, law);
    }
  for (std::string_view method : {"cg", "minres"}) compare(bodies, "bodies", method, Law::associated);
}

// Breaks when a step allocates that finds what the last one found: arrays of a step that are made anew, a
// report that copies more than numbers, a search that begins with empty memory. What has to be solved for
// costs the memory of its solver; a box at rest on a slope starts solved, and a free one has nothing to
// solve.
TEST(steady_steps_do_not_allocate) {
  ModelDescription slope;
  const Quat tilt = exponential({0.2, 0, 0});
  Body box;
  box.mass = 1;
  box.inertia = Mat3::diagonal(0.01, 0.01, 0.01);
  box.pose = {rotate(tilt, {0, 0, 0.1}), tilt};
  slope.bodies = {box};
  Geom ground, cube;
  ground.shape = Plane{};
  ground.frame.rotation = tilt;
  cube.body = 0;
  cube.shape = Box{{0.1, 0.1, 0.1}};
  slope.geoms = {ground, cube};
  ModelDescription flight = slope;
  flight.geoms.clear();
  flight.bodies[0].inertia = Mat3::diagonal(0.01, 0.02, 0.03);
  flight.bodies[0].angular_velocity = {1, 2, 3};
  for (const ModelDescription& description : {slope, flight}) {
    Simulation simulation(std::make_shared<Model>(description), {});
    simulation.run(200);
    std::size_t fewest = allocations;
    for (int i = 0; i < 20; ++i) {
      // A step that repeats the last one computes nothing: the load differs from that of the step before.
      simulation.state().forces[0].z = (i % 2) * 1e-12;
      const std::size_t before = allocations;
      simulation.step();
      fewest = std::min(fewest, allocations - before);
    }
    CHECK(fewest == 0);
  }
}

// Breaks when the direct way of `auto` allocates although it solved the same kind of problem before: a steady
// step of a robot would pay for it every time.
TEST(elimination_does_not_allocate) {
  const Problem p = small::mechanism();
  for (Law law : {Law::associated, Law::coulomb}) {
    Options options;
    options.law = law;
    Elimination memory;
    Solution s;
    CHECK(memory.solve(p, options, small::no_limit, s));
    const std::size_t before = allocations;
    CHECK(memory.solve(p, options, small::no_limit, s));
    CHECK(allocations == before);
  }
}

// Breaks when the counter is not the allocator in use, which would make the test above empty.
TEST(allocations_are_counted) {
  const std::size_t before = allocations;
  const std::vector<double> v(1000);
  CHECK(allocations == before + 1 && v.size() == 1000);
}
