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
                           {"island_share", &policy.island_share},
                           {"constrained_share", &policy.constrained_share},
                           {"refinements", &policy.refinements},
                           {"most_rounds", &policy.most_rounds},
                           {"least_diagonal", &policy.least_diagonal},
                           {"far_off", &policy.far_off},
                           {"steps_at_once", &policy.steps_at_once},
                           {"stale_at_once", &policy.stale_at_once},
                           {"times_carefully", &policy.times_carefully},
                           {"proximal_at_once", &policy.proximal_at_once},
                           {"proximal_careful", &policy.proximal_careful},
                           {"proximal_rise", &policy.proximal_rise},
                           {"slow_step", &policy.slow_step},
                           {"most_island_work", &policy.most_island_work},
                           {"multiplications_per_row", &policy.multiplications_per_row},
                           {"unwatched_work", &policy.unwatched_work},
                           {"usual_curve_steps", &policy.usual_curve_steps},
                           {"most_curve_steps", &policy.most_curve_steps},
                           {"share_of_curve", &policy.share_of_curve},
                           {"end_of_curve", &policy.end_of_curve}});

}  // namespace amontons::direct
