#include "multibody/step/policy.hpp"

#include "amontons/base/policy.hpp"

namespace amontons::step {

// Has its values before any initialisation at run time, so that no order of initialisation matters.
constinit Policy policy;

// Names that set_policy() takes. tools/check_policy.py finds a field that is missing.
[[maybe_unused]] static const bool named = name_policy("step", {{"least_searches", &policy.least_searches},
                                                                {"few_iterations", &policy.few_iterations},
                                                                {"most_repeats", &policy.most_repeats},
                                                                {"work_per_block", &policy.work_per_block},
                                                                {"share_of_part", &policy.share_of_part},
                                                                {"three_digits", &policy.three_digits},
                                                                {"direct_start", &policy.direct_start},
                                                                {"most_looks", &policy.most_looks},
                                                                {"least_turn", &policy.least_turn},
                                                                {"closing", &policy.closing},
                                                                {"allowed_error", &policy.allowed_error},
                                                                {"steps_of_slack", &policy.steps_of_slack},
                                                                {"few_rows", &policy.few_rows},
                                                                {"softness", &policy.softness},
                                                                {"largest_turn", &policy.largest_turn},
                                                                {"rough", &policy.rough},
                                                                {"remembered_sag", &policy.remembered_sag},
                                                                {"wrong", &policy.wrong}});

}  // namespace amontons::step
