#include "entry.hpp"

// Co-simulation by the Functional Mock-up Interface 2.0.5 (fmi-standard.org, sections 2.1 and 4.2). The names
// and the arguments of the functions are those of the standard.
namespace {

using namespace amontons::fmu;
using Reference = std::uint32_t;

// fmi2CallbackFunctions
struct Callbacks {
  void (*log)(void* environment, const char* instance, int status, const char* category, const char* message,
              ...);
  void* (*allocate)(std::size_t, std::size_t);
  void (*free)(void*);
  void (*step_finished)(void*, int);
  void* environment;
};

// A URI of a file (RFC 3986, RFC 8089), or a path as some importers give it.
std::filesystem::path path_of_uri(std::string text) {
  if (!text.starts_with("file:")) return path_of(text);
  text.erase(0, 5);
  if (text.starts_with("//")) text.erase(0, std::min(text.find('/', 2), text.size()));
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool coded = text[i] == '%' && i + 2 < text.size();
    plain += coded ? static_cast<char>(std::stoi(text.substr(i + 1, 2), nullptr, 16)) : text[i];
    if (coded) i += 2;
  }
  if (plain.size() > 2 && plain[0] == '/' && plain[2] == ':') plain.erase(0, 1);  // /C:/folder
  return path_of(plain);
}

}  // namespace

AMONTONS_FMU_EXPORT const char* fmi2GetTypesPlatform() { return "default"; }
AMONTONS_FMU_EXPORT const char* fmi2GetVersion() { return "2.0"; }
AMONTONS_FMU_EXPORT int fmi2SetDebugLogging(void*, int, std::size_t, const char* const*) { return ok; }

AMONTONS_FMU_EXPORT void* fmi2Instantiate(const char* name, int type, const char*, const char* resources,
                                          const Callbacks* callbacks, int, int logging) {
  constexpr int co_simulation = 1;
  const auto tell = [calls = callbacks ? *callbacks : Callbacks{}, who = std::string(name ? name : ""),
                     logging](Status status, const char* message) {
    if (calls.log && (logging || status >= error))
      calls.log(calls.environment, who.c_str(), status,
                status >= error ? "logStatusError" : "logStatusWarning", "%s", message);
  };
  if (type != co_simulation || !resources) {
    tell(error, "the unit is for co-simulation, and needs the place of its resources");
    return nullptr;
  }
  try {
    return make_unit(path_of_uri(resources), false, tell);
  } catch (const std::exception&) {
    tell(error, "the place of the resources is no URI of a file");
    return nullptr;
  }
}

AMONTONS_FMU_EXPORT void fmi2FreeInstance(void* unit) { delete static_cast<Unit*>(unit); }
AMONTONS_FMU_EXPORT int fmi2SetupExperiment(void* unit, int, double, double start, int, double) {
  return guarded(unit, [&](Instance& instance) { instance.start_at(start); });
}
AMONTONS_FMU_EXPORT int fmi2EnterInitializationMode(void* unit) {
  return guarded(unit, [](Instance&) {});
}
AMONTONS_FMU_EXPORT int fmi2ExitInitializationMode(void* unit) {
  return guarded(unit, [](Instance&) {});
}
AMONTONS_FMU_EXPORT int fmi2Terminate(void* unit) {
  return guarded(unit, [](Instance&) {});
}
AMONTONS_FMU_EXPORT int fmi2Reset(void* unit) {
  return guarded(unit, [](Instance& instance) { instance.reset(); });
}

AMONTONS_FMU_EXPORT int fmi2GetReal(void* unit, const Reference* references, std::size_t count,
                                    double* values) {
  return get_values(unit, references, count, values);
}
AMONTONS_FMU_EXPORT int fmi2GetInteger(void* unit, const Reference* references, std::size_t count,
                                       int* values) {
  return get_values(unit, references, count, values);
}
AMONTONS_FMU_EXPORT int fmi2SetReal(void* unit, const Reference* references, std::size_t count,
                                    const double* values) {
  return set_values(unit, references, count, values);
}

AMONTONS_FMU_EXPORT int fmi2GetFMUstate(void* unit, void** state) { return get_state(unit, state); }
AMONTONS_FMU_EXPORT int fmi2SetFMUstate(void* unit, void* state) { return set_state(unit, state); }
AMONTONS_FMU_EXPORT int fmi2FreeFMUstate(void*, void** state) { return free_state(state); }
AMONTONS_FMU_EXPORT int fmi2SerializedFMUstateSize(void* unit, void* state, std::size_t* size) {
  return serialised_size(unit, state, size);
}
AMONTONS_FMU_EXPORT int fmi2SerializeFMUstate(void* unit, void* state, char* bytes, std::size_t size) {
  return serialise(unit, state, bytes, size);
}
AMONTONS_FMU_EXPORT int fmi2DeSerializeFMUstate(void* unit, const char* bytes, std::size_t size,
                                                void** state) {
  return deserialise(unit, bytes, size, state);
}

AMONTONS_FMU_EXPORT int fmi2DoStep(void* unit, double point, double size, int) {
  bool early = false;
  return advance(unit, point, size, early);
}
AMONTONS_FMU_EXPORT int fmi2GetRealStatus(void* unit, int kind, double* value) {
  constexpr int last_successful_time = 2;
  if (!unit || kind != last_successful_time) return discard;
  *value = static_cast<Unit*>(unit)->instance->time();
  return ok;
}
AMONTONS_FMU_EXPORT int fmi2GetBooleanStatus(void*, int, int* value) {
  *value = 0;  // fmi2Terminated: the unit never asks for the end
  return ok;
}

// No variable of this type, no derivatives, no steps in the background; importers look up all functions.
// Arguments are not read, so that they need no types.
#define AMONTONS_FMU_NOT_THERE(name) \
  AMONTONS_FMU_EXPORT int name() { return error; }

AMONTONS_FMU_NOT_THERE(fmi2GetBoolean)
AMONTONS_FMU_NOT_THERE(fmi2GetString)
AMONTONS_FMU_NOT_THERE(fmi2SetInteger)
AMONTONS_FMU_NOT_THERE(fmi2SetBoolean)
AMONTONS_FMU_NOT_THERE(fmi2SetString)
AMONTONS_FMU_NOT_THERE(fmi2GetDirectionalDerivative)
AMONTONS_FMU_NOT_THERE(fmi2SetRealInputDerivatives)
AMONTONS_FMU_NOT_THERE(fmi2GetRealOutputDerivatives)
AMONTONS_FMU_NOT_THERE(fmi2CancelStep)
AMONTONS_FMU_NOT_THERE(fmi2GetStatus)
AMONTONS_FMU_NOT_THERE(fmi2GetIntegerStatus)
AMONTONS_FMU_NOT_THERE(fmi2GetStringStatus)
