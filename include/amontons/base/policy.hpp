// The tuned numbers of the rooms by name. benchmarks/sensitivity.py varies them in the release build, to
// measure what each is worth. They are no options: nothing else sets them.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace amontons {

// A number and the field that holds it. Fields keep the types of what they limit, because a step compares
// them without conversions.
struct PolicyNumber {
  std::string_view name;
  std::variant<double*, int*, std::size_t*> value;
};
// The numbers of a namespace, whose name stands before theirs: "step.closing".
struct RoomPolicy {
  std::string_view room;
  std::vector<PolicyNumber> numbers;
};

// The rooms that are linked, each of which names its numbers before main().
std::vector<RoomPolicy>& policy();
bool name_policy(std::string_view room, std::vector<PolicyNumber> numbers);

// Sets a number, "room.name", of this process. Steps and solves read numbers without a lock, so none may run
// meanwhile. Throws InputError if there is none of this name, or if a count is no count.
void set_policy(const std::string& name, double value);

}  // namespace amontons
