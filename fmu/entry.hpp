#pragma once
#include <algorithm>
#include <cstring>
#include <exception>
#include <functional>
#include <optional>

#include "amontons/base/error.hpp"
#include "instance.hpp"

// What the functions of both versions of the interface have in common: they are of C, and let no exception
// out.
#if defined(_WIN32)
#define AMONTONS_FMU_EXPORT extern "C" __declspec(dllexport)
#else
#define AMONTONS_FMU_EXPORT extern "C" __attribute__((visibility("default")))
#endif

namespace amontons::fmu {

// Both versions have these numbers: fmi2Status and fmi3Status.
enum Status : int { ok, warning, discard, error };

// An instance with its environment.
struct Unit {
  std::function<void(Status, const char*)> log;
  std::filesystem::path resources;
  std::unique_ptr<Instance> instance;
  bool returns_early = false;
};

// The status of some work; an exception is logged, and is the status error.
template <class Work>
Status guarded(void* given, Work&& work) {
  auto* unit = static_cast<Unit*>(given);
  if (!unit) return error;
  try {
    work(*unit->instance);
    return ok;
  } catch (const std::exception& failure) {
    unit->log(error, failure.what());
  } catch (...) {
    unit->log(error, "an unknown error");
  }
  return error;
}

// A unit with its instance, or null after a message.
template <class Log>
Unit* make_unit(const std::filesystem::path& resources, bool returns_early, Log log) {
  try {
    auto unit = std::make_unique<Unit>();
    unit->log = log;
    unit->returns_early = returns_early;
    unit->instance = std::make_unique<Instance>(resources);
    return unit.release();
  } catch (const std::exception& failure) {
    log(error, failure.what());
  } catch (...) {
    log(error, "an unknown error");
  }
  return nullptr;
}

// Paths of both versions are UTF-8 on every system.
inline std::filesystem::path path_of(const std::string& text) {
  return std::filesystem::path(std::u8string(text.begin(), text.end()));
}

template <class T>
void require_type(const Instance& instance, std::uint32_t reference) {
  AMONTONS_REQUIRE(instance.is_integer(reference) == std::is_integral_v<T>,
                   "value reference " + std::to_string(reference) + " is of another type");
}

template <class T>
Status get_values(void* unit, const std::uint32_t* references, std::size_t count, T* values) {
  return guarded(unit, [&](const Instance& instance) {
    for (std::size_t i = 0; i < count; ++i) {
      require_type<T>(instance, references[i]);
      values[i] = static_cast<T>(instance.value(references[i]));
    }
  });
}

inline Status set_values(void* unit, const std::uint32_t* references, std::size_t count,
                         const double* values) {
  return guarded(unit, [&](Instance& instance) {
    for (std::size_t i = 0; i < count; ++i) instance.set(references[i], values[i]);
  });
}

// A saved state: a new one where there is none yet.
inline Status get_state(void* unit, void** state) {
  return guarded(unit, [&](const Instance& instance) {
    if (*state)
      *static_cast<Memory*>(*state) = instance.memory();
    else
      *state = new Memory(instance.memory());
  });
}

inline Status set_state(void* unit, void* state) {
  return guarded(unit, [&](Instance& instance) {
    AMONTONS_REQUIRE(state, "there is no state to go back to");
    instance.restore(*static_cast<const Memory*>(state));
  });
}

inline Status free_state(void** state) {
  if (!state) return ok;
  delete static_cast<Memory*>(*state);
  *state = nullptr;
  return ok;
}

inline Status serialised_size(void* unit, void* state, std::size_t* size) {
  return guarded(unit, [&](const Instance&) { *size = to_bytes(*static_cast<const Memory*>(state)).size(); });
}

inline Status serialise(void* unit, void* state, void* bytes, std::size_t size) {
  return guarded(unit, [&](const Instance&) {
    const std::vector<std::byte> found = to_bytes(*static_cast<const Memory*>(state));
    AMONTONS_REQUIRE(found.size() <= size, "the serialised state needs more room");
    std::memcpy(bytes, found.data(), found.size());
  });
}

inline Status deserialise(void* unit, const void* bytes, std::size_t size, void** state) {
  return guarded(unit, [&](const Instance& instance) {
    Memory memory = instance.from_bytes({static_cast<const std::byte*>(bytes), size});
    if (*state)
      *static_cast<Memory*>(*state) = std::move(memory);
    else
      *state = new Memory(std::move(memory));
  });
}

// The status of steps, and whether they ended before the communication point.
inline Status advance(void* given, double point, double size, bool& early) {
  Instance::Advance result;
  const Status status = guarded(given, [&](Instance& instance) {
    result = instance.advance(point, size, static_cast<Unit*>(given)->returns_early);
  });
  early = result.early;
  if (status != ok || result.message.empty()) return status;
  const Status told = result.stopped ? discard : result.missed && !result.early ? warning : ok;
  static_cast<Unit*>(given)->log(told == ok ? warning : told, result.message.c_str());
  return told;
}

}  // namespace amontons::fmu
