// The tuned numbers of the rooms by name. benchmarks/sensitivity.py varies them in the release build, to
// measure what each is worth. They are no options: nothing else sets them.
#pragma once
#include <cmath>
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

// The numbers that several rooms share.
namespace base {

struct Policy {
  // Rounding (relative): of lengths, sines, residuals and pivots, which a few operations on terms of like
  // size leave. Redundant rows have a pivot far above the terms that cancel there.
  double rounding = 1e-12;
  // Three digits (relative): an error that nobody sees. Starts with a smaller residual are near their
  // solution, and velocities at the end of a step follow from impulses of so many digits
  // (test_block_and_tackle).
  double three_digits = 1e-3;
  // Compliance (relative to the diagonal of A): makes redundant rows determinate. Newton's steps begin with
  // it, and failed steps raise it (friction_that_holds_a_joint_at_its_limit). Rows of joints have it relative
  // to D M^-1 D' times Model::lightness, so that redundant locked rows (two hinges of a door, planar loops)
  // share the load evenly. Not larger: a row sags by this fraction of g h^2, 2e-11 m for a body on one joint,
  // times the carried masses over the heaviest of its mechanism. Relative to D M^-1 D' alone a link of 1e-6
  // kg would let a trunk of 17 kg sink at 30 mm/s. Not smaller: positions are rounded to 1e-16 of their size.
  // That error, over h and over this compliance, is a load between redundant rows, below 1e-4 of the weight.
  double compliance = 1e-7;
};
// Read by every thread without a lock: only set_policy() changes it, between runs.
inline Policy policy;  // not constinit, which the parser of the reference does not know
inline const bool named = name_policy("base", {{"rounding", &policy.rounding},
                                               {"three_digits", &policy.three_digits},
                                               {"compliance", &policy.compliance}});

// The root of rounding (relative). It balances an error e of a regularised equation against rounding over e.
// A method that converges quadratically leaves rounding after a step of this size.
inline double half_of_digits() { return std::sqrt(policy.rounding); }

}  // namespace base

}  // namespace amontons
