#include "entry.hpp"

// Co-simulation by the Functional Mock-up Interface 3.0.2 (fmi-standard.org, sections 2.2 and 4.2). The names
// and the arguments of the functions are those of the standard.
namespace {

using namespace amontons::fmu;
using Reference = std::uint32_t;
using LogMessage = void (*)(void* environment, int status, const char* category, const char* message);

}  // namespace

AMONTONS_FMU_EXPORT const char* fmi3GetVersion() { return "3.0"; }

AMONTONS_FMU_EXPORT int fmi3SetDebugLogging(void*, bool, std::size_t, const char* const*) { return ok; }

AMONTONS_FMU_EXPORT void* fmi3InstantiateCoSimulation(const char*, const char*, const char* resources, bool,
                                                      bool logging, bool, bool early_return, const Reference*,
                                                      std::size_t, void* environment, LogMessage log, void*) {
  const auto tell = [=](Status status, const char* message) {
    if (log && (logging || status >= error))
      log(environment, status, status >= error ? "logStatusError" : "logStatusWarning", message);
  };
  if (!resources) {
    tell(error, "the path of the resources is missing");
    return nullptr;
  }
  return make_unit(path_of(resources), early_return, tell);
}

AMONTONS_FMU_EXPORT void fmi3FreeInstance(void* unit) { delete static_cast<Unit*>(unit); }

AMONTONS_FMU_EXPORT int fmi3EnterInitializationMode(void* unit, bool, double, double start, bool, double) {
  return guarded(unit, [&](Instance& instance) { instance.start_at(start); });
}
AMONTONS_FMU_EXPORT int fmi3ExitInitializationMode(void* unit) {
  return guarded(unit, [](Instance&) {});
}
AMONTONS_FMU_EXPORT int fmi3EnterStepMode(void* unit) {
  return guarded(unit, [](Instance&) {});
}
AMONTONS_FMU_EXPORT int fmi3Terminate(void* unit) {
  return guarded(unit, [](Instance&) {});
}
AMONTONS_FMU_EXPORT int fmi3Reset(void* unit) {
  return guarded(unit, [](Instance& instance) { instance.reset(); });
}

AMONTONS_FMU_EXPORT int fmi3GetFloat64(void* unit, const Reference* references, std::size_t count,
                                       double* values, std::size_t) {
  return get_values(unit, references, count, values);
}
AMONTONS_FMU_EXPORT int fmi3GetInt32(void* unit, const Reference* references, std::size_t count,
                                     std::int32_t* values, std::size_t) {
  return get_values(unit, references, count, values);
}
AMONTONS_FMU_EXPORT int fmi3SetFloat64(void* unit, const Reference* references, std::size_t count,
                                       const double* values, std::size_t) {
  return set_values(unit, references, count, values);
}

AMONTONS_FMU_EXPORT int fmi3GetFMUState(void* unit, void** state) { return get_state(unit, state); }
AMONTONS_FMU_EXPORT int fmi3SetFMUState(void* unit, void* state) { return set_state(unit, state); }
AMONTONS_FMU_EXPORT int fmi3FreeFMUState(void*, void** state) { return free_state(state); }
AMONTONS_FMU_EXPORT int fmi3SerializedFMUStateSize(void* unit, void* state, std::size_t* size) {
  return serialised_size(unit, state, size);
}
AMONTONS_FMU_EXPORT int fmi3SerializeFMUState(void* unit, void* state, void* bytes, std::size_t size) {
  return serialise(unit, state, bytes, size);
}
AMONTONS_FMU_EXPORT int fmi3DeserializeFMUState(void* unit, const void* bytes, std::size_t size,
                                                void** state) {
  return deserialise(unit, bytes, size, state);
}

AMONTONS_FMU_EXPORT int fmi3DoStep(void* unit, double point, double size, bool, bool* event, bool* terminate,
                                   bool* early, double* last_time) {
  *event = *terminate = false;
  const Status status = advance(unit, point, size, *early);
  if (unit) *last_time = static_cast<Unit*>(unit)->instance->time();
  return status;
}

// No unit of this kind, or no variable of this type: an importer that reads modelDescription.xml does not
// call them, but many look up every function. Arguments are not read, so that they need no types.
#define AMONTONS_FMU_NOT_MADE(name) \
  AMONTONS_FMU_EXPORT void* name() { return nullptr; }
#define AMONTONS_FMU_NOT_THERE(name) \
  AMONTONS_FMU_EXPORT int name() { return error; }

AMONTONS_FMU_NOT_MADE(fmi3InstantiateModelExchange)
AMONTONS_FMU_NOT_MADE(fmi3InstantiateScheduledExecution)
AMONTONS_FMU_NOT_THERE(fmi3EnterEventMode)
AMONTONS_FMU_NOT_THERE(fmi3EnterConfigurationMode)
AMONTONS_FMU_NOT_THERE(fmi3ExitConfigurationMode)
AMONTONS_FMU_NOT_THERE(fmi3GetFloat32)
AMONTONS_FMU_NOT_THERE(fmi3GetInt8)
AMONTONS_FMU_NOT_THERE(fmi3GetUInt8)
AMONTONS_FMU_NOT_THERE(fmi3GetInt16)
AMONTONS_FMU_NOT_THERE(fmi3GetUInt16)
AMONTONS_FMU_NOT_THERE(fmi3GetUInt32)
AMONTONS_FMU_NOT_THERE(fmi3GetInt64)
AMONTONS_FMU_NOT_THERE(fmi3GetUInt64)
AMONTONS_FMU_NOT_THERE(fmi3GetBoolean)
AMONTONS_FMU_NOT_THERE(fmi3GetString)
AMONTONS_FMU_NOT_THERE(fmi3GetBinary)
AMONTONS_FMU_NOT_THERE(fmi3GetClock)
AMONTONS_FMU_NOT_THERE(fmi3SetFloat32)
AMONTONS_FMU_NOT_THERE(fmi3SetInt8)
AMONTONS_FMU_NOT_THERE(fmi3SetUInt8)
AMONTONS_FMU_NOT_THERE(fmi3SetInt16)
AMONTONS_FMU_NOT_THERE(fmi3SetUInt16)
AMONTONS_FMU_NOT_THERE(fmi3SetInt32)
AMONTONS_FMU_NOT_THERE(fmi3SetUInt32)
AMONTONS_FMU_NOT_THERE(fmi3SetInt64)
AMONTONS_FMU_NOT_THERE(fmi3SetUInt64)
AMONTONS_FMU_NOT_THERE(fmi3SetBoolean)
AMONTONS_FMU_NOT_THERE(fmi3SetString)
AMONTONS_FMU_NOT_THERE(fmi3SetBinary)
AMONTONS_FMU_NOT_THERE(fmi3SetClock)
AMONTONS_FMU_NOT_THERE(fmi3GetNumberOfVariableDependencies)
AMONTONS_FMU_NOT_THERE(fmi3GetVariableDependencies)
AMONTONS_FMU_NOT_THERE(fmi3GetDirectionalDerivative)
AMONTONS_FMU_NOT_THERE(fmi3GetAdjointDerivative)
AMONTONS_FMU_NOT_THERE(fmi3GetIntervalDecimal)
AMONTONS_FMU_NOT_THERE(fmi3GetIntervalFraction)
AMONTONS_FMU_NOT_THERE(fmi3GetShiftDecimal)
AMONTONS_FMU_NOT_THERE(fmi3GetShiftFraction)
AMONTONS_FMU_NOT_THERE(fmi3SetIntervalDecimal)
AMONTONS_FMU_NOT_THERE(fmi3SetIntervalFraction)
AMONTONS_FMU_NOT_THERE(fmi3SetShiftDecimal)
AMONTONS_FMU_NOT_THERE(fmi3SetShiftFraction)
AMONTONS_FMU_NOT_THERE(fmi3EvaluateDiscreteStates)
AMONTONS_FMU_NOT_THERE(fmi3UpdateDiscreteStates)
AMONTONS_FMU_NOT_THERE(fmi3EnterContinuousTimeMode)
AMONTONS_FMU_NOT_THERE(fmi3CompletedIntegratorStep)
AMONTONS_FMU_NOT_THERE(fmi3SetTime)
AMONTONS_FMU_NOT_THERE(fmi3SetContinuousStates)
AMONTONS_FMU_NOT_THERE(fmi3GetContinuousStateDerivatives)
AMONTONS_FMU_NOT_THERE(fmi3GetEventIndicators)
AMONTONS_FMU_NOT_THERE(fmi3GetContinuousStates)
AMONTONS_FMU_NOT_THERE(fmi3GetNominalsOfContinuousStates)
AMONTONS_FMU_NOT_THERE(fmi3GetNumberOfEventIndicators)
AMONTONS_FMU_NOT_THERE(fmi3GetNumberOfContinuousStates)
AMONTONS_FMU_NOT_THERE(fmi3GetOutputDerivatives)
AMONTONS_FMU_NOT_THERE(fmi3ActivateModelPartition)
