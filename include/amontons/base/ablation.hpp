// Switches of single repairs, only for benchmarks/ablation.py. With the CMake option AMONTONS_ABLATION the
// environment variable AMONTONS_OFF lists repairs, separated by commas, that are switched off. It is read at
// every call, because processes that measure a repair are forked from one that has already run. Without the
// option there are no switches.
#pragma once

#ifdef AMONTONS_ABLATION
#include <cstdlib>
#include <string>
#include <string_view>
#endif

namespace amontons {

#ifdef AMONTONS_ABLATION
// Whether the repair with this name is switched off.
inline bool off(std::string_view repair) {
  const char* names = std::getenv("AMONTONS_OFF");
  return names && (',' + std::string(names) + ',').find(',' + std::string(repair) + ',') != std::string::npos;
}
#else
constexpr bool off(const char*) { return false; }
#endif

}  // namespace amontons
