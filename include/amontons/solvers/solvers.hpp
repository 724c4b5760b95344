#pragma once
#include <string_view>
#include <vector>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// The methods. Same problem, same options, same solution; the comment at each definition cites its source.
Solution spg_literal(const Problem&, const Options&);     // "p-spg-fb-literal"
Solution spg(const Problem&, const Options&);             // "p-spg-fb"
Solution jacobi(const Problem&, const Options&);          // "jacobi"
Solution gauss_seidel(const Problem&, const Options&);    // "gauss-seidel"
Solution apgd(const Problem&, const Options&);            // "apgd"
Solution cg(const Problem&, const Options&);              // "cg", K = R^m only
Solution minres(const Problem&, const Options&);          // "minres", K = R^m only
Solution admm(const Problem&, const Options&);            // "admm"
Solution interior_point(const Problem&, const Options&);  // "interior-point"
Solution newton(const Problem&, const Options&);          // "newton"
Solution automatic(const Problem&, const Options&);       // "auto": picks by the structure of the problem

const std::vector<std::string_view>& method_names();
// Validates, then runs the method of that name; InputError for an unknown name lists the known ones.
Solution solve(const Problem&, std::string_view method, const Options&);

}  // namespace amontons
