#include "check.hpp"

#include <cstdio>
#include <filesystem>
#include <iterator>

namespace check {

namespace {
Test* first = nullptr;
Test** last = &first;  // tests run in the order of their definition within a file
bool failed = false;

std::string title(const Test& test) {
  const std::string_view path = test.file;
  const std::size_t begin = path.find_last_of('/') + 1;
  return std::string(path.substr(begin, path.find_last_of('.') - begin)) + ": " + test.name;
}

bool selected(const std::string& title, int argc, char** argv) {
  for (int i = 1; i < argc; ++i)
    if (title.find(argv[i]) != std::string::npos) return true;
  return argc == 1;
}
}  // namespace

Test::Test(const char* file_, const char* name_, void (*run_)())
    : file(file_), name(name_), run(run_), next(nullptr) {
  *last = this;
  last = &next;
}

void fail(const char* file, int line, std::string_view message) {
  failed = true;
  std::fprintf(stderr, "%s:%d: %.*s\n", file, line, static_cast<int>(message.size()), message.data());
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

void fail_near(double a, double b, double tolerance, const char* text, const char* file, int line) {
  fail(file, line,
       std::string(text) + ": " + number(a) + " and " + number(b) + " differ by " + number(std::abs(a - b)) +
           " > " + number(tolerance));
}

void fail_to_throw(const char* what, std::string_view substring, const char* text, const char* file,
                   int line) {
  if (!what)
    fail(file, line, std::string(text) + " does not throw");
  else if (std::string_view(what).find(substring) == std::string_view::npos)
    fail(file, line,
         std::string(text) + " throws \"" + what + "\", which does not contain \"" + std::string(substring) +
             "\"");
}

// Threads of this program, waiting ones too; 0 where the system has no such list.
static std::ptrdiff_t threads() {
  std::error_code none;
  return std::distance(std::filesystem::directory_iterator("/proc/self/task", none), {});
}

static void run(const Test& test, bool threaded) {
  const std::ptrdiff_t before = threads();
  try {
    test.run();
  } catch (const std::exception& error) {
    fail(test.file, 0, std::string("unexpected exception: ") + error.what());
  }
  if (!threaded && threads() > before)
    fail(test.file, 0, "starts threads: put \"thread\" into the name of the test or of its file");
}

}  // namespace check

int main(int argc, char** argv) {
  int passes = 0, failures = 0;
  // The thread sanitizer runs the tests with "thread" in their titles. They come last here, as pools of
  // threads stay.
  for (const bool threaded : {false, true})
    for (const check::Test* test = check::first; test; test = test->next) {
      const std::string title = check::title(*test);
      if (!check::selected(title, argc, argv) || threaded != (title.find("thread") != title.npos)) continue;
      check::failed = false;
      check::run(*test, threaded);
      if (check::failed) std::fprintf(stderr, "FAILED %s\n", title.c_str());
      ++(check::failed ? failures : passes);
    }
  std::printf("%d passed, %d failed\n", passes, failures);
  // A name that selects nothing is a mistake, not a success.
  return failures > 0 || passes == 0 ? 1 : 0;
}
