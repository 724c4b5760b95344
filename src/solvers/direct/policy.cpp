#include "solvers/direct/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::direct {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named =
    name_policy("direct", {{"most_rows", &policy.most_rows},
                           {"most_rows_on_joints", &policy.most_rows_on_joints},
                           {"most_factor_work", &policy.most_factor_work},
                           {"rounding", &policy.rounding},
                           {"aim", &policy.aim},
                           {"reduced_share", &policy.reduced_share},
                           {"refinements", &policy.refinements},
                           {"most_rounds", &policy.most_rounds},
                           {"newton_steps", &policy.newton_steps},
                           {"stale_steps", &policy.stale_steps},
                           {"proximal", &policy.proximal},
                           {"most_island_work", &policy.most_island_work},
                           {"multiplications_per_row", &policy.multiplications_per_row},
                           {"unwatched_work", &policy.unwatched_work},
                           {"curve_steps_in_reserve", &policy.curve_steps_in_reserve},
                           {"most_curve_steps", &policy.most_curve_steps},
                           {"end_of_curve", &policy.end_of_curve}});

}  // namespace amontons::direct
