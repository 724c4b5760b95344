#include "solvers/choice/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::choice {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named =
    name_policy("choice", {{"product_per_row", &policy.product_per_row},
                           {"product_per_held_body", &policy.product_per_held_body},
                           {"factor_per_block", &policy.factor_per_block},
                           {"factor_per_multiplication", &policy.factor_per_multiplication},
                           {"most_rows", &policy.most_rows},
                           {"most_bodies", &policy.most_bodies},
                           {"path_factorizations", &policy.path_factorizations},
                           {"path_unsymmetric", &policy.path_unsymmetric},
                           {"frozen_ratio", &policy.frozen_ratio},
                           {"blocks_unit", &policy.blocks_unit},
                           {"first_turn", &policy.first_turn},
                           {"turn", &policy.turn},
                           {"race_work", &policy.race_work},
                           {"late_race_work", &policy.late_race_work},
                           {"small_island", &policy.small_island},
                           {"frozen_tolerance", &policy.frozen_tolerance},
                           {"frozen_burst", &policy.frozen_burst}});

}  // namespace amontons::choice
