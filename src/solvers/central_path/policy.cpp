#include "solvers/central_path/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::curve {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named = name_policy("curve", {{"rounding", &policy.rounding},
                                                                 {"fraction", &policy.fraction},
                                                                 {"most_fraction", &policy.most_fraction},
                                                                 {"most_bend", &policy.most_bend},
                                                                 {"most_change", &policy.most_change},
                                                                 {"neighbourhood", &policy.neighbourhood},
                                                                 {"most_repeats", &policy.most_repeats}});

}  // namespace amontons::curve
