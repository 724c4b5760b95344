#include <cmath>
#include <vector>

#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/device_layout.hpp"
#include "amontons/solvers/first_order/forwarded_iterate.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"

using namespace amontons;

namespace {

// Boxes in a row on the ground, each on four points and pushed against the next one.
Problem row_of_boxes(std::size_t count, bool rows) {
  ContactSystem A;
  std::vector<double> mu;
  for (std::size_t i = 0; i < count; ++i) {
    A.bodies.inverse_mass.push_back(1);
    A.bodies.inverse_inertia.push_back({3, 3, 3, 0, 0, 0});
    const auto body = static_cast<Index>(i);
    for (double x : {-0.5, 0.5})
      for (double y : {-0.5, 0.5})
        A.contacts.push_back(contact_between(body, world, {x, y, -0.5}, {x, y, 0}, {0, 0, 1}));
    if (i > 0) A.contacts.push_back(contact_between(body, body - 1, {-0.5, 0, 0}, {0.5, 0, 0}, {1, 0, 0}));
  }
  A.contact_compliance.assign(A.contacts.size(), 0);
  mu.assign(A.contacts.size(), 0.4);
  SetProduct K;
  K.add_each<Friction>(mu);
  if (rows) {
    A.jacobian.push_back({0, 1, {1, 0, 0, 0, 0.5, 0}, {-1, 0, 0, 0, 0.5, 0}});
    A.compliance.push_back(0.1);
    K.add_each<Interval>(std::vector<double>{-0.2}, std::vector<double>{0.1});
  }
  std::vector<double> b(A.rows());
  for (std::size_t i = 0; i < b.size(); ++i) b[i] = i % 3 == 0 ? -0.05 : 0.03 * std::cos(double(i));
  return make_problem(std::move(A), std::move(b), std::move(K));
}

// The passes of this library behind the interface, and how often they are asked.
class Counted final : public AnyIterate {
 public:
  Counted(const Problem& problem, Law law, int& passes) : it_(problem, law, 1), passes_(passes) {}
  double start(std::span<const double> x0) override { return it_.start(x0); }
  double refresh() override { return it_.refresh(); }
  Direction direction(double alpha) override { return ++passes_, it_.direction(alpha); }
  double curvature() override { return it_.curvature(); }
  Update update(double lambda) override { return it_.update(lambda); }
  void start_momentum() override { it_.start_momentum(); }
  MomentumDirection momentum_direction(double alpha) override {
    return ++passes_, it_.momentum_direction(alpha);
  }
  double accelerate(double beta) override { return it_.accelerate(beta); }
  double refresh_momentum() override { return it_.refresh_momentum(); }
  void keep_best() override { it_.keep_best(); }
  void extract_best(std::span<double> x) const override { it_.extract_best(x); }
  void extract(std::span<double> x) const override { it_.extract(x); }
  double objective() const override { return it_.objective(); }

 private:
  ContactIterate it_;
  int& passes_;
};

std::shared_ptr<IterateSource> counting(int& passes, std::size_t least) {
  auto source = std::make_shared<IterateSource>();
  source->name = "counted";
  source->takes = [least](const Problem& p) { return p.K.contacts() >= least; };
  source->make = [&passes](const Problem& p, Law law) { return std::make_unique<Counted>(p, law, passes); };
  return source;
}

}  // namespace

// Breaks when the way through the interface changes a bit, leaves a pass out, or does not say where it led.
TEST(forwarded_passes_give_the_bits_of_this_library) {
  const Problem p = row_of_boxes(6, true);
  for (const char* method : {"p-spg-fb", "apgd"}) {
    Options options;
    options.law = Law::coulomb;
    options.threads = 1;
    const Solution own = solve(p, method, options);
    int passes = 0;
    options.iterates = counting(passes, 0);
    const Solution other = solve(p, method, options);
    CHECK(passes > 0);
    CHECK(other.device == "counted" && own.device == "cpu");
    CHECK(own.x == other.x && own.iterations == other.iterations);
  }
}

// Breaks when auto forgets the device, when another method or a small problem goes there.
TEST(only_methods_with_passes_go_to_a_device) {
  const Problem p = row_of_boxes(6, false);
  int passes = 0;
  Options options;
  options.iterates = counting(passes, 0);
  const Solution automatic = solve(p, "auto", options);
  CHECK(passes > 0 && automatic.device == "counted" && automatic.status == Status::converged);
  passes = 0;
  CHECK(solve(p, "newton", options).device == "cpu");
  options.iterates = counting(passes, 1000);
  CHECK(solve(p, "auto", options).device == "cpu");
  CHECK(solve(p, "apgd", options).device == "cpu");
  CHECK(passes == 0);
}

// The entries of an array of a layout.
template <class T>
std::vector<T> entries(const HostArray<T>& array) {
  return {array.begin(), array.end()};
}

// All arrays of two layouts, bit by bit.
void check_equal(const DeviceLayout& a, const DeviceLayout& b) {
  CHECK(a.contact_of == b.contact_of && a.row_of == b.row_of && a.compliant == b.compliant);
  CHECK(entries(a.contact) == entries(b.contact) && entries(a.row) == entries(b.row));
  CHECK(entries(a.jacobian) == entries(b.jacobian) && entries(a.mass) == entries(b.mass));
  CHECK(entries(a.line) == entries(b.line) && entries(a.b) == entries(b.b));
  CHECK(entries(a.first) == entries(b.first) && entries(a.contact_list) == entries(b.contact_list));
  CHECK(entries(a.first_row) == entries(b.first_row) && entries(a.row_list) == entries(b.row_list));
  CHECK(entries(a.parts) == entries(b.parts) && entries(a.large) == entries(b.large));
}

// Breaks when a vector does not come back from the order and the axes of the passes as it was.
TEST(layout_of_a_device_keeps_vectors) {
  const Problem p = row_of_boxes(5, true);
  CHECK(DeviceLayout::fits(p));
  DeviceLayout layout(p);
  CHECK(layout.contacts == 24 && layout.rows == 1 && layout.bodies == 5);
  CHECK(layout.stride % 32 == 0 && layout.size() == layout.b.size());
  std::vector<double> back(p.rows());
  layout.to_user({layout.b.begin(), layout.b.size()}, back);
  for (std::size_t i = 0; i < back.size(); ++i) CHECK_NEAR(back[i], p.b[i], 1e-15);
  layout.start(p.b);
  layout.to_user({layout.x.begin(), layout.x.size()}, back);
  std::vector<double> expected(p.b);
  project(p.K, expected, expected);
  for (std::size_t i = 0; i < back.size(); ++i) CHECK_NEAR(back[i], expected[i], 1e-15);
}

// Breaks when an entry depends on the number of threads, or on the problem that had the memory before; when
// an array that differs is not told to the device, or the lists are made and sent anew for the same pairs.
TEST(threads_lay_out_in_the_memory_of_another) {
  const Problem many = row_of_boxes(2000, true), few = row_of_boxes(700, false),
                rows = row_of_boxes(700, true);
  const DeviceLayout alone(many, 1);
  check_equal(alone, DeviceLayout(many, 3));
  DeviceLayout kept(few, 2);
  for (const Problem* p : {&rows, &many, &few, &many}) {
    kept.fill(*p, 2);
    check_equal(kept, DeviceLayout(*p, 1));
    CHECK(kept.contact_list.changed && kept.line.changed && kept.b.changed);
  }
  kept.fill(many, 2);
  CHECK(!kept.contact.changed && !kept.contact_list.changed && !kept.b.changed && !kept.mass.changed);
  Problem turned = many;
  auto& A = std::get<ContactSystem>(turned.A);
  A.contacts[4321].normal = {0, 0.6, 0.8};
  kept.fill(turned, 2);
  check_equal(kept, DeviceLayout(turned, 1));
  CHECK(kept.contact.changed && !kept.contact_list.changed && !kept.line.changed && !kept.mass.changed);
  A.bodies.inverse_mass[7] = 2;
  kept.fill(turned, 2);
  check_equal(kept, DeviceLayout(turned, 1));
  CHECK(kept.mass.changed && !kept.first.changed);
}

// Breaks when a long list is not cut, or an entry of it is lost or counted twice.
TEST(layout_of_a_device_cuts_long_lists) {
  ContactSystem A;
  A.bodies.inverse_mass = {1};
  A.bodies.inverse_inertia = {{1, 1, 1, 0, 0, 0}};
  for (int i = 0; i < 300; ++i)
    A.contacts.push_back(contact_between(0, world, {0.01 * i, 0, 0}, {0, 0, 0}, {0, 0, 1}));
  A.contact_compliance.assign(300, 0);
  SetProduct K;
  K.add_each<Friction>(std::vector<double>(300, 0.5));
  const Problem p = make_problem(std::move(A), std::vector<double>(900, -1), std::move(K));
  const DeviceLayout layout(p);
  const std::vector<std::uint32_t> parts{0, 128, 0, 0, 128, 256, 0, 0, 256, 300, 0, 0}, large{1, 0, 3};
  CHECK(entries(layout.parts) == parts && entries(layout.large) == large);
  CHECK(entries(layout.first) == std::vector<std::uint32_t>(4, 0));
  for (std::uint32_t e = 0; e < 300; ++e) CHECK(layout.contact_list[e] == 2 * e);
}
