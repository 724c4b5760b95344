#include "solvers/central_path/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::curve {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named = name_policy("curve", {{"rounding", &policy.rounding},
                                                                 {"fraction", &policy.fraction},
                                                                 {"most_fraction", &policy.most_fraction},
                                                                 {"fraction_back", &policy.fraction_back},
                                                                 {"least_target", &policy.least_target},
                                                                 {"most_bend", &policy.most_bend},
                                                                 {"most_back", &policy.most_back},
                                                                 {"shortest_step", &policy.shortest_step}});

}  // namespace amontons::curve
