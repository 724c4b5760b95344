#include "solvers/choice/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::choice {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named =
    name_policy("choice", {{"product_per_contact", &policy.product_per_contact},
                           {"plain_per_contact", &policy.plain_per_contact},
                           {"product_per_row", &policy.product_per_row},
                           {"unfused", &policy.unfused},
                           {"factor_solve", &policy.factor_solve},
                           {"factor_per_body", &policy.factor_per_body},
                           {"factor_per_block", &policy.factor_per_block},
                           {"factor_per_multiplication", &policy.factor_per_multiplication},
                           {"most_rows", &policy.most_rows},
                           {"most_bodies", &policy.most_bodies},
                           {"large_linear_system", &policy.large_linear_system},
                           {"linear_products", &policy.linear_products},
                           {"preconditioned_factorizations", &policy.preconditioned_factorizations},
                           {"contradiction_products", &policy.contradiction_products},
                           {"contradiction_iterations", &policy.contradiction_iterations},
                           {"likelier_products", &policy.likelier_products},
                           {"unlikelier_products", &policy.unlikelier_products},
                           {"many_contacts", &policy.many_contacts},
                           {"first_turn", &policy.first_turn},
                           {"product_per_held_body", &policy.product_per_held_body},
                           {"path_start", &policy.path_start},
                           {"path_per_digit", &policy.path_per_digit},
                           {"path_unsymmetric", &policy.path_unsymmetric},
                           {"frozen_ratio", &policy.frozen_ratio},
                           {"blocks_unit", &policy.blocks_unit},
                           {"newton_iterations", &policy.newton_iterations},
                           {"last_iterations", &policy.last_iterations},
                           {"turn", &policy.turn},
                           {"least_progress", &policy.least_progress},
                           {"race_work", &policy.race_work},
                           {"race_work_per_block", &policy.race_work_per_block},
                           {"late_race_work", &policy.late_race_work},
                           {"late_race_work_per_block", &policy.late_race_work_per_block},
                           {"small_island", &policy.small_island},
                           {"frozen_tolerance", &policy.frozen_tolerance},
                           {"frozen_burst", &policy.frozen_burst}});

}  // namespace amontons::choice
