// Switches of single repairs, for benchmarks/ablation.py alone. With the CMake option AMONTONS_ABLATION the
// environment variable AMONTONS_OFF names repairs, separated by commas, that take no effect. It is read once
// per process. Without the option no switch exists.
#pragma once

#ifdef AMONTONS_ABLATION
#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>
#endif

namespace amontons {

#ifdef AMONTONS_ABLATION
// Whether the repair of this name is switched off.
inline bool off(std::string_view repair) {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> found;
    const char* text = std::getenv("AMONTONS_OFF");
    std::istringstream list(text ? text : "");
    for (std::string name; std::getline(list, name, ',');) found.push_back(name);
    return found;
  }();
  return std::find(names.begin(), names.end(), repair) != names.end();
}
#else
constexpr bool off(const char*) { return false; }
#endif

}  // namespace amontons
