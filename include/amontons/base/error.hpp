#pragma once
#include <stdexcept>
#include <string>

namespace amontons {

// The only exception of the library, thrown for input that a user can correct. The message names the wrong
// thing and the remedy. It is thrown before anything changes.
struct InputError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

}  // namespace amontons

// Throws InputError unless the condition holds. It is a macro, so that the message is only built when needed:
// the checks run over every entry of a problem.
#define AMONTONS_REQUIRE(condition, message)                 \
  do {                                                       \
    if (!(condition)) throw ::amontons::InputError(message); \
  } while (false)
