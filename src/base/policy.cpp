#include "amontons/base/policy.hpp"

#include <cmath>
#include <type_traits>
#include <utility>

#include "amontons/base/error.hpp"

namespace amontons {

std::vector<RoomPolicy>& policy() {
  // Made by the first room that names its numbers, in whatever order the rooms are initialised.
  static std::vector<RoomPolicy> rooms;
  return rooms;
}

bool name_policy(std::string_view room, std::vector<PolicyNumber> numbers) {
  policy().push_back({room, std::move(numbers)});
  return true;
}

// Counts are whole numbers below the largest int: a fraction of one would be cut without a word.
static void set(const PolicyNumber& number, const std::string& name, double value) {
  constexpr double most = 1e9;  // not tuned: fits into an int
  const auto change = [&]<class T>(T* where) {
    if constexpr (!std::is_same_v<T, double>)
      AMONTONS_REQUIRE(value >= 0 && value <= most && value == std::floor(value),
                       name + " must be a whole number from 0 to 1e9");
    *where = static_cast<T>(value);
  };
  AMONTONS_REQUIRE(!std::isnan(value), name + " must be a number");
  std::visit(change, number.value);
}

void set_policy(const std::string& name, double value) {
  for (const RoomPolicy& room : policy())
    for (const PolicyNumber& number : room.numbers)
      if (std::string(room.room).append(".").append(number.name) == name) return set(number, name, value);
  throw InputError("there is no tuned number \"" + name + "\"");
}

}  // namespace amontons
