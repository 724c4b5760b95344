#pragma once
#include <stdexcept>
#include <string>

namespace amontons {

// The only exception of the library: thrown for input that a user can correct. The message names the thing
// that is wrong and the remedy. It is thrown before anything has been changed.
struct InputError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

}  // namespace amontons

// Throws InputError unless the condition holds. A macro, so that the message is only put together when it is
// needed: the checks run over every entry of a problem.
#define AMONTONS_REQUIRE(condition, message)                 \
  do {                                                       \
    if (!(condition)) throw ::amontons::InputError(message); \
  } while (false)
