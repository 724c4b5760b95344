#include "multibody/joints/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::joints {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named = name_policy("joints", {{"compliance", &policy.compliance},
                                                                  {"auxiliary_mass", &policy.auxiliary_mass},
                                                                  {"reach", &policy.reach},
                                                                  {"smallest_step", &policy.smallest_step},
                                                                  {"regular", &policy.regular},
                                                                  {"rounding", &policy.rounding}});

}  // namespace amontons::joints
