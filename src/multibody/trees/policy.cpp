#include "multibody/trees/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::trees {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named =
    name_policy("trees", {{"rate_precision", &policy.rate_precision}, {"most_left", &policy.most_left}});

}  // namespace amontons::trees
