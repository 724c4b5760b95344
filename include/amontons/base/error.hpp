#pragma once
#include <stdexcept>
#include <string>

namespace amontons {

// The only exception of the library: thrown for input that a user can correct. The message names the thing
// that is wrong and the remedy. It is thrown before anything has been changed.
struct InputError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

inline void require(bool condition, const std::string& message) {
  if (!condition) throw InputError(message);
}

}  // namespace amontons
