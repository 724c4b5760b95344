// Switches of single repairs, for benchmarks/ablation.py alone. With the CMake option AMONTONS_ABLATION the
// environment variable AMONTONS_OFF names repairs, separated by commas, that take no effect. It is read at
// every call: processes that measure a repair are forked from one that has run already. Without the option no
// switch exists.
#pragma once

#ifdef AMONTONS_ABLATION
#include <cstdlib>
#include <string>
#include <string_view>
#endif

namespace amontons {

#ifdef AMONTONS_ABLATION
// Whether the repair of this name is switched off.
inline bool off(std::string_view repair) {
  const char* names = std::getenv("AMONTONS_OFF");
  return names && (',' + std::string(names) + ',').find(',' + std::string(repair) + ',') != std::string::npos;
}
#else
constexpr bool off(const char*) { return false; }
#endif

}  // namespace amontons
