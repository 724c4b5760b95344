#include "solvers/direct/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::direct {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named =
    name_policy("direct", {{"most_rows", &policy.most_rows},
                           {"most_factor_work", &policy.most_factor_work},
                           {"aim", &policy.aim},
                           {"reduced_share", &policy.reduced_share},
                           {"stale_steps", &policy.stale_steps},
                           {"proximal", &policy.proximal},
                           {"projections", &policy.projections},
                           {"most_steps", &policy.most_steps}});

}  // namespace amontons::direct
