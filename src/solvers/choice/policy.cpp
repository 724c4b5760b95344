#include "solvers/choice/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::choice {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named =
    name_policy("choice", {{"most_rows", &policy.most_rows},
                           {"most_bodies", &policy.most_bodies},
                           {"path_factorizations", &policy.path_factorizations},
                           {"many_blocks", &policy.many_blocks},
                           {"least_progress", &policy.least_progress},
                           {"assembly", &policy.assembly},
                           {"first_turn", &policy.first_turn},
                           {"small_island", &policy.small_island}});

}  // namespace amontons::choice
