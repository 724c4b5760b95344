#include "solvers/second_order/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::second_order {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named =
    name_policy("second_order", {{"fraction", &policy.fraction},
                                 {"collapse", &policy.collapse},
                                 {"rounding", &policy.rounding},
                                 {"start_margin", &policy.start_margin},
                                 {"near_the_end", &policy.near_the_end},
                                 {"most_stale", &policy.most_stale},
                                 {"shortest_burst", &policy.shortest_burst},
                                 {"longest_burst", &policy.longest_burst},
                                 {"halvings", &policy.halvings},
                                 {"sufficient", &policy.sufficient},
                                 {"inexact", &policy.inexact},
                                 {"most_proximal", &policy.most_proximal}});

}  // namespace amontons::second_order
