#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "amontons/multibody/kinematics/motion.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "sensors.hpp"

// An instance of a functional mock-up unit: a simulation, and the variables by which others see it. The two
// versions of the interface, fmi2.cpp and fmi3.cpp, share it.
namespace amontons::fmu {

// What a variable is; resources/fmu.json names it with an index and a part of what it belongs to.
enum class Kind : unsigned char {
  time,           // s
  control,        // input: entry of State::controls
  joint_force,    // input: entry of State::joint_forces, N or N m
  body_load,      // input: force (N) and torque (N m) at the centre of mass, world; parts 0 to 5
  q,              // generalised coordinate
  qd,             // generalised velocity
  frame,          // of a site or body: position, quaternion, linear and angular velocity; parts 0 to 12
  reaction,       // of a joint, on A: force, torque; parts 0 to 5; mean of the last step
  contact_force,  // on a body, parts 0 to 2; mean of the last step
  sensor,         // parts are its values; sensors.hpp
  effort,         // along a dof: of motor, spring and damper, friction, limit, parts 0 to 3; mean of the step
  actuator,       // effort of an actuator; mean of the last step
  contacts,       // number of contacts of the last step
  began,          // pairs of geoms that began to touch since the start
  ended,          // pairs that ceased to touch
  missed,         // steps that missed their tolerance
};

struct Variable {
  Kind kind = Kind::time;
  std::size_t index = 0, part = 0;
};

// A frame fixed in a body.
struct Frame {
  Index body = world;
  Transform pose;
};

// What the outputs of an instance depend on beside its state.
struct Record {
  std::int32_t contacts = 0, began = 0, ended = 0, missed = 0;
  std::vector<GeomPair> touching;  // in the last step, sorted
  // Of the last step: force and torque of the reaction of each joint, then the contact force on each body,
  // then the values of all sensors.
  std::vector<double> loads;
};

// All that the future and the outputs of an instance depend on.
struct Memory {
  State state;
  Record record;
};

class Instance {
 public:
  // Reads model.json and fmu.json of the folder. Throws InputError.
  explicit Instance(const std::filesystem::path& resources);

  void reset();
  // Time (s) at which the simulation begins.
  void start_at(double time) { simulation_.state().time = time; }
  double time() const { return simulation_.state().time; }

  bool is_integer(std::uint32_t reference) const;
  // Throw InputError for a reference that is not in the list, or that is no input.
  double value(std::uint32_t reference) const;
  void set(std::uint32_t reference, double value);

  // Result of steps up to the next communication point.
  struct Advance {
    bool stopped = false;  // the state is that before a step which could not be made
    bool early = false;    // ended after a step that missed its tolerance
    bool missed = false;   // a step missed its tolerance
    std::string message;
  };
  // Throws InputError unless `point` is the present time and `size` a multiple of the time step.
  Advance advance(double point, double size, bool return_early);

  Memory memory() const { return {simulation_.state(), record_}; }
  void restore(const Memory& memory);
  // Throws InputError for bytes that are damaged or of another unit.
  Memory from_bytes(std::span<const std::byte> bytes) const;

 private:
  const Variable& variable(std::uint32_t reference) const;
  double of_frame(const Frame& frame, std::size_t part) const;
  double coordinate(const Variable& variable) const;
  double effort(const Variable& variable) const;
  // Where the values of sensors begin in the loads of a Record.
  std::size_t first_sensor() const {
    return 6 * simulation_.model().joints() + 3 * simulation_.model().bodies();
  }
  void note_step(const Report& report);
  void note_loads();

  Simulation simulation_;
  std::vector<Variable> variables_;
  std::vector<Frame> frames_;
  std::vector<Sensor> sensors_;
  State start_;
  Record record_;
  mutable Coordinates coordinates_;  // of the present state; empty: not yet asked for
};

std::vector<std::byte> to_bytes(const Memory& memory);

}  // namespace amontons::fmu
