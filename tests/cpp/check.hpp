#pragma once
#include <cmath>
#include <exception>
#include <string>
#include <string_view>

// A small test harness.
//   TEST(name) { ... }                       a test; it fails if a check fails or an exception escapes
//   CHECK(condition)                         the test goes on after a failure
//   CHECK_NEAR(a, b, tolerance)              |a - b| <= tolerance; NaN is never near
//   CHECK_THROWS(expression, "substring")    throws a std::exception whose message contains the substring
// The executable takes substrings of "test_file: name" and runs the tests that contain one of them, or all.
namespace check {

// A sanitizer makes programs about ten times slower. Tests that take one path for several sizes then leave
// out the largest, which the build without sanitizers runs.
#ifdef AMONTONS_SANITIZED
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif

struct Test {
  const char* file;
  const char* name;
  void (*run)();
  Test* next;
  Test(const char* file, const char* name, void (*run)());
};

// Prints file:line and the message and marks the running test as failed. Messages are made in check.cpp: a
// string in each of the thousands of checks would cost the compiler time.
void fail(const char* file, int line, std::string_view message);
std::string number(double value);  // with all its digits
void fail_near(double a, double b, double tolerance, const char* text, const char* file, int line);
void fail_to_throw(const char* what, std::string_view substring, const char* text, const char* file,
                   int line);

// a == b covers equal infinities, whose difference is NaN.
inline bool is_near(double a, double b, double tolerance) { return a == b || std::abs(a - b) <= tolerance; }

inline void near(double a, double b, double tolerance, const char* text, const char* file, int line) {
  if (!is_near(a, b, tolerance)) fail_near(a, b, tolerance, text, file, line);
}

template <class F>
void throws(F&& f, std::string_view substring, const char* text, const char* file, int line) {
  try {
    f();
  } catch (const std::exception& error) {
    return fail_to_throw(error.what(), substring, text, file, line);
  }
  fail_to_throw(nullptr, substring, text, file, line);
}

}  // namespace check

#define TEST(name)                                                   \
  static void test_##name();                                         \
  static check::Test register_##name(__FILE__, #name, &test_##name); \
  static void test_##name()

#define CHECK(...)                                                                  \
  do {                                                                              \
    if (!(__VA_ARGS__)) check::fail(__FILE__, __LINE__, "CHECK(" #__VA_ARGS__ ")"); \
  } while (false)

#define CHECK_NEAR(a, b, tolerance) \
  check::near((a), (b), (tolerance), "CHECK_NEAR(" #a ", " #b ")", __FILE__, __LINE__)

#define CHECK_THROWS(expression, substring) \
  check::throws([&] { (void)(expression); }, (substring), #expression, __FILE__, __LINE__)
