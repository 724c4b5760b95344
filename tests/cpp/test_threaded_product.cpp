#include <cmath>
#include <vector>

#include "amontons/problem/threaded_product.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "random.hpp"

using namespace amontons;

namespace {

// Contacts between random bodies, of which every seventh is fixed, some with the world; a few stored rows.
ContactSystem random_system(std::size_t contacts, std::size_t bodies) {
  small::Draws random(7);
  ContactSystem A;
  const auto vector = [&] {
    return Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  };
  for (std::size_t i = 0; i < bodies; ++i) {
    const double w = i % 7 == 3 ? 0 : random.uniform(0.5, 2);
    A.bodies.inverse_mass.push_back(w);
    A.bodies.inverse_inertia.push_back({3 * w, 2 * w, 4 * w, 0.1 * w, 0.2 * w, -0.1 * w});
  }
  for (std::size_t i = 0; i < contacts; ++i) {
    const auto a = static_cast<Index>((i * 7919) % bodies), b = static_cast<Index>((i * 104729 + 1) % bodies);
    const Vec3 n = vector();
    A.contacts.push_back(
        contact_between(a, a == b || i % 9 == 0 ? world : b, vector(), vector(), n / norm(n)));
    A.contact_compliance.push_back(i % 5 == 0 ? 0.1 : 0);
  }
  A.jacobian.push_back({0, 1, {1, 0, 0, 0, 0.5, 0}, {-1, 0, 0, 0, 0.5, 0}});
  A.compliance.push_back(0.1);
  return A;
}

}  // namespace

// Breaks when a bit of a product depends on the number of threads, on a large system or on a small one.
TEST(products_by_threads_have_the_same_bits) {
  for (const std::size_t contacts : {100, 20000}) {
    const ContactSystem A = random_system(contacts, 3000);
    std::vector<double> x(A.rows()), alone(x.size()), y(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::cos(double(i));
    A.product(x, alone);
    for (const unsigned threads : {1u, 2u, 3u, 4u}) {
      y.assign(y.size(), -1);
      product(A, x, y, threads);
      CHECK(y == alone);
    }
  }
}
