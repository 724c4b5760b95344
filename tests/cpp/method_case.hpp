#pragma once

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>

#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"

// Tests that go through methods, laws and cases: EXPECT says which of them failed. It takes `c`, `method` and
// `law` from where it stands.
namespace method_case {

using namespace amontons;

constexpr Law laws[] = {Law::associated, Law::coulomb};

inline bool one_of(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

inline bool is_linear_only(std::string_view method) { return one_of(method, {"cg", "minres"}); }
inline bool is_factored(std::string_view method) {
  return one_of(method, {"auto", "interior-point", "newton"});
}
inline double reachable(std::string_view method) { return is_factored(method) ? 1e-10 : 1e-6; }

inline void report(const char* file, int line, const small::Case& c, std::string_view method, Law law,
                   const std::string& what) {
  check::fail(file, line,
              c.name + ", " + std::string(method) + ", " + (law == Law::coulomb ? "coulomb" : "associated") +
                  ": " + what);
}
#define EXPECT(condition)                                                                  \
  do {                                                                                     \
    if (!(condition)) method_case::report(__FILE__, __LINE__, c, method, law, #condition); \
  } while (false)

}  // namespace method_case
