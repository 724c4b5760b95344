// Time steps of a model for callgrind: step_work.py runs it and reads the profile.
//
//   step_work MODEL.json DT TOLERANCE BEFORE STEPS CONTROL...
//
// The model is a file of amontons.write_model. The controls (units of the actuators and motors, in the order
// of the model) are the same in all steps. The last STEPS steps are made in counted_steps(), at which
// callgrind collects; the others let initial overlaps and falls pass. Prints the mean number of contacts of a
// counted step.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>

#include "amontons/multibody/model/model_json.hpp"
#include "amontons/multibody/step/simulation.hpp"

namespace {

using namespace amontons;

double steps(Simulation& simulation, int count) {
  double contacts = 0;
  for (int k = 0; k < count; ++k) contacts += static_cast<double>(simulation.step().contacts);
  return contacts;
}

}  // namespace

// The name by which callgrind finds the part that counts.
extern "C" __attribute__((noinline)) double counted_steps(amontons::Simulation& simulation, int count) {
  return steps(simulation, count);
}

int main(int argc, char** argv) {
  if (argc < 6) {
    std::fputs("usage: step_work MODEL.json DT TOLERANCE BEFORE STEPS CONTROL...\n", stderr);
    return 2;
  }
  try {
    const auto model = std::make_shared<Model>(read_model_file(argv[1]));
    SimulationOptions options;
    options.dt = std::atof(argv[2]);
    options.tolerance = std::atof(argv[3]);
    options.threads = 1;
    Simulation simulation(model, options);
    auto& controls = simulation.state().controls;
    for (std::size_t k = 0; k < controls.size() && k + 6 < static_cast<std::size_t>(argc); ++k)
      controls[k] = std::atof(argv[k + 6]);
    steps(simulation, std::atoi(argv[4]));
    const int count = std::atoi(argv[5]);
    std::printf("%.17g\n", counted_steps(simulation, count) / count);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "step_work: %s\n", error.what());
    return 1;
  }
}
