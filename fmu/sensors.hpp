#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "amontons/multibody/step/simulation.hpp"

// Sensors of a unit. They read what those of the package read (python/amontons/simulation/sensors.py), where
// forces and accelerations are means over the last step.
namespace amontons::fmu {

struct SensorMoment;

// A sensor, with all that its kind asks for.
struct Sensor {
  using Read = void (*)(const SensorMoment&, const Sensor&, double* values);
  Read read = nullptr;
  std::size_t size = 1, first = 0;  // values, and the place of the first among those of all sensors
  Index body = world, reference = world;
  Transform frame, reference_frame;  // in the frames of these bodies
  std::size_t index = 0, rate = 0;   // entry of q, dof, actuator or tendon; entry of qd
  double lower = 0, upper = 0;       // limits of its coordinate or tendon
  std::vector<Index> bodies;         // those that hang on it
  std::vector<unsigned char> own;    // per geom: 1 for those of its link
  Vec3 field;                        // of a magnetometer, world
  std::optional<Shape> volume;       // in `frame`, or in `reference_frame`
  double cutoff = 0;                 // values are clipped to +- this; 0: they are not
};

// The sensors in fmu.json. Throws InputError, or what nlohmann::json throws.
std::vector<Sensor> read_sensors(const nlohmann::json& listed, const nlohmann::json& volumes,
                                 const Simulation& simulation);

// Number of values of all sensors.
std::size_t values_of(const std::vector<Sensor>& sensors);

// Reads all sensors in the present state, into as many values as they have.
void read_all(const Simulation& simulation, const std::vector<Sensor>& sensors, double* values);

}  // namespace amontons::fmu
