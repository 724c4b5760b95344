#include "multibody/contacts/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::contacts {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named =
    name_policy("contacts", {{"allowance", &policy.allowance},
                             {"level", &policy.level},
                             {"least_overlap", &policy.least_overlap},
                             {"few", &policy.few},
                             {"one_normal", &policy.one_normal},
                             {"least_turn", &policy.least_turn},
                             {"same_direction", &policy.same_direction}});

}  // namespace amontons::contacts
