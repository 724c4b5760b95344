#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "amontons/multibody/model/state.hpp"

namespace amontons {

// All of a state as bytes, for the same build of the library on the same kind of processor. A simulation that
// gets them back goes on bit for bit, because a State is complete. The bytes name no model: who keeps them
// for long keeps the model beside them.
std::vector<std::byte> state_to_bytes(const State& state);
// The state of such bytes. `state` must be one of the same model, whose arrays have the sizes of its arrays.
// Throws InputError, with `state` unchanged, if the bytes are damaged or of another model or version.
void state_from_bytes(std::span<const std::byte> bytes, State& state);
// Whether two states of one model have the same bits, apart from the time and the number of steps. It reads
// up to the first difference.
bool differ_in_time_alone(const State& a, const State& b);
// Makes `to` a copy of `from`. It writes what differs alone, which is little if most bodies rest.
void copy_changes(const State& from, State& to);

}  // namespace amontons
