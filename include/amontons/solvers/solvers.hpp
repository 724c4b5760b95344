#pragma once
#include <string_view>
#include <vector>

#include "amontons/solvers/choice/automatic.hpp"
#include "amontons/solvers/companions/gauss_seidel.hpp"
#include "amontons/solvers/companions/jacobi.hpp"
#include "amontons/solvers/companions/spg_literal.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/first_order/apgd.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/krylov/cg.hpp"
#include "amontons/solvers/krylov/minres.hpp"
#include "amontons/solvers/second_order/interior_point.hpp"
#include "amontons/solvers/second_order/newton.hpp"

namespace amontons {

// The methods take the same problem and options and give the same solution. The comment at each definition
// cites its source. "auto" comes first, the rest in the order of the documentation. A method that does not
// apply to a problem throws InputError: no method is silently replaced by another.
const std::vector<std::string_view>& method_names();
// The method of that name; InputError for an unknown name lists the known ones.
Method find_method(std::string_view name);
// Validates the options, then runs the method. The functions above do not validate theirs, because phases and
// inner solves call them with validated options.
Solution solve(const Problem&, std::string_view method, const Options&);
// The same as a part of other work, whose budget it shares.
Solution solve(const Problem&, std::string_view method, const Options&, Budget& whole);

}  // namespace amontons
