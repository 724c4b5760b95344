// Private: the fused passes over contacts and joint rows (contact_passes.isa.cpp).
#pragma once
#include "amontons/base/isa.hpp"
#include "solvers/first_order/pass_data.hpp"

namespace amontons {

// The passes over one chunk, and their sums in the order of v. An iteration is direction, mass, update: d
// must be complete on all bodies before M^-1 acts, and <d, A d> known before lambda. A pass does all work
// that needs a contact, because memory and not arithmetic bounds the speed.
//
//  direction_pass   d = Pi_K(x - alpha / p g) - x, lines = D'd;
//                   <d, g>, <d, P d>, <d, E d>
//  impulse_pass     lines = D'x
//  mass_pass        lines = M^-1 lines;
//                   <lines before, lines after>
//  update_pass      with lines = M^-1 D'd: x_next = x + lambda d, u += lambda (D lines + E d);
//                   <s, y>, <y, P^-1 y>, the squared natural map at x_next
//  refresh_pass     with lines = M^-1 D'x: u = D lines + E x + b;
//                   the squared natural map at x
//  momentum_direction_pass
//                   as direction_pass from y and u_y, in the metric of accelerated methods for P;
//                   0, <d, P d>, <d, E d>, <d, P (y - x)>
//  accelerate_pass  with lines = M^-1 D'd: x_next = y + d, u = A x_next + b, y = x_next + beta (x_next - x),
//                   u_y = A y + b;
//                   the squared natural map at x_next
AMONTONS_FOR_EACH_ISA(PassSums direction_pass(const PassData& data, const Chunk& chunk, double alpha);
                      PassSums impulse_pass(const PassData& data, const Chunk& chunk);
                      PassSums mass_pass(const PassData& data, const Chunk& chunk);
                      PassSums update_pass(const PassData& data, const Chunk& chunk, double lambda);
                      PassSums refresh_pass(const PassData& data, const Chunk& chunk);
                      PassSums momentum_direction_pass(const PassData& data, const Chunk& chunk,
                                                       double alpha);
                      PassSums accelerate_pass(const PassData& data, const Chunk& chunk, double beta);)

// The passes of one instruction set, chosen once.
struct Passes {
  using Pass = PassSums (*)(const PassData&, const Chunk&);
  using Step = PassSums (*)(const PassData&, const Chunk&, double);
  Step direction;
  Pass impulse, mass;
  Step update;
  Pass refresh;
  Step momentum_direction, accelerate;
};
Passes passes_of(Isa isa);

}  // namespace amontons
