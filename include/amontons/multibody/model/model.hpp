#pragma once
#include <filesystem>
#include <utility>
#include <vector>

#include "amontons/multibody/model/names.hpp"

namespace amontons {

// The drive of an entry of State::controls: an actuator, or the motor of a joint's degree of freedom (then
// `actuator` is -1).
struct Control {
  std::string name;
  Index actuator = -1, joint = -1, dof = 0;
};

// A checked description with derived data. Immutable, shared by simulations.
class Model {
 public:
  // Throws as check() does.
  explicit Model(ModelDescription description);
  // Reads a file of amontons.write_model or of to_json; throws InputError naming the file and the place.
  static Model from_json(const std::filesystem::path& file);
  // Writes a file that from_json and Python read (write_model_file).
  void to_json(const std::filesystem::path& file) const;

  const ModelDescription& description() const { return d_; }
  // Counts, which are the lengths of the arrays of a State.
  std::size_t bodies() const { return d_.bodies.size(); }
  std::size_t joints() const { return d_.joints.size(); }
  std::size_t dofs() const { return first_dof_.back(); }
  // Coordinates of joint j are entries [first_dof(j), first_dof(j + 1)) of State::coordinates.
  std::size_t first_dof(std::size_t joint) const { return first_dof_[joint]; }
  const Body& body(Index i) const { return d_.bodies[i]; }
  // In body axes; zero for a body that is not dynamic.
  const Mat3& inverse_inertia(Index i) const { return inverse_inertia_[i]; }
  const Joint& joint(Index j) const { return d_.joints[j]; }
  const Geom& geom(Index g) const { return d_.geoms[g]; }
  // Index of a name; an index is checked. Throws InputError that lists the known names.
  Index body_index(Reference body) const { return body.among(d_.bodies, "body"); }
  Index geom_index(Reference geom) const { return geom.among(d_.geoms, "geom"); }
  Index joint_index(Reference joint) const { return joint.among(d_.joints, "joint"); }
  Index tendon_index(Reference tendon) const { return tendon.among(d_.tendons, "tendon"); }
  Index actuator_index(Reference actuator) const { return actuator.among(d_.actuators, "actuator"); }
  // Index of a joint's degree of freedom in State::coordinates.
  std::size_t dof_index(Reference joint, Index dof = 0) const;
  // Actuators in their order, then the motors of all joints. A motor has the name of its joint, for a joint
  // with several dofs "joint[dof]", followed by " motor" if an actuator has that name.
  const std::vector<Control>& controls() const { return controls_; }
  // Index in State::controls.
  Index control_index(Reference control) const { return control.among(controls_, "control"); }
  // The control of a dof's motor (global index), -1 without one.
  Index control_of_dof(std::size_t dof) const { return dof_control_[dof]; }
  // Actuators on a dof (global index), on a tendon, and on neither, in the order of the model.
  const std::vector<Index>& actuators_of_dof(std::size_t dof) const { return dof_actuators_[dof]; }
  const std::vector<Index>& actuators_of_tendon(std::size_t t) const { return tendon_actuators_[t]; }
  const std::vector<Index>& other_actuators() const { return other_actuators_; }
  // Whether a dof limits the sum of its actuator efforts.
  bool bounds_efforts() const { return bounds_efforts_; }
  // Whether impulses can move a body; this is the only definition. false for the world.
  bool is_dynamic(Index body) const { return body >= 0 && dynamic_[body]; }
  // A characteristic length (m): the median bounding radius of the shapes of dynamic bodies (1 without any).
  // Default tolerances are fractions of it, so that results do not depend on the unit of length.
  double length() const { return length_; }
  double total_mass() const { return total_mass_; }
  // Mass of the lighter dynamic body of a row over the mass of the heaviest body that joints connect to it,
  // in [1e-8, 1]. It is 1 if no joint holds the lighter body. Compliances that are relative to D M^-1 D' of a
  // row are multiplied by it, because a row of a light link carries the weight of the heavy ones.
  double lightness(Index body_a, Index body_b) const;
  // Factor of the inverse mass and inertia in the response to impulses, at most 1. It is below 1 for a body
  // that is lighter than 1e-8 of the heaviest one of its mechanism. Otherwise one ulp of the impulses that
  // carry the mechanism would move this body by more than a tolerance of 1e-6 allows, and no solve could
  // converge.
  double mobility_factor(Index body) const { return mobility_factor_[body]; }
  // Whether two geoms may touch: by masks, exclusions and joints, unless their pair has `always`. Never
  // within one body, nor if neither body is dynamic.
  bool may_touch(Index geom_a, Index geom_b) const;
  // A model of few geoms lists the pairs that may touch, ascending, the lower index first: a step then tests
  // their boxes alone, without a tree of all boxes.
  bool lists_pairs() const { return d_.geoms.size() <= few_geoms; }
  const std::vector<std::pair<Index, Index>>& listed_pairs() const { return listed_pairs_; }
  // Material of the contact of two geoms, in either order.
  Material material(Index geom_a, Index geom_b) const;
  // The part of a geom that a search for contacts reads. A search reads it of every geom and of many pairs,
  // in any order; a geom has several lines of the cache, of which this is one.
  struct Outline {
    Index body;
    std::uint32_t category, mask;
    bool dynamic;       // its body is; false for the world
    bool still;         // of the world, or of a body that nothing moves
    bool round, plane;  // sphere, capsule or ellipsoid; plane: all other shapes have edges
    bool has_corners;   // any number of them: hull, mesh or height field
    bool conveys;       // its surface moves over its body
    double radius;      // m, of a ball, a sphere about the centre of mass of its body; 0: it is none
  };
  const Outline& outline(Index geom) const { return outlines_[geom]; }
  bool has_corners() const { return has_corners_; }  // of any geom
  // Rest offset of a geom (m). That of a pair is at most the sum of its geoms'.
  double rest_offset(Index geom) const { return rest_offset_[geom]; }

 private:
  // Size (geoms): 64 have at most 2016 pairs, whose tests cost about as much as the search in a tree.
  static constexpr std::size_t few_geoms = 64;

  void weigh_mechanisms();
  void list_controls();
  void list_pairs();

  ModelDescription d_;
  std::vector<std::size_t> first_dof_;
  std::vector<std::vector<Index>> dof_actuators_, tendon_actuators_;
  std::vector<Index> other_actuators_;
  std::vector<Control> controls_;
  std::vector<Index> dof_control_;
  bool bounds_efforts_ = false;
  std::vector<std::pair<Index, Index>> excluded_;                    // sorted body pairs, first < second
  std::vector<std::pair<Index, Index>> always_;                      // sorted geom pairs
  std::vector<std::pair<Index, Index>> excluded_geoms_;              // the same for geoms
  std::vector<std::pair<std::pair<Index, Index>, Material>> pairs_;  // sorted geom pairs
  std::vector<std::pair<Index, Index>> listed_pairs_;
  std::vector<Outline> outlines_;
  bool has_corners_ = false;
  std::vector<unsigned char> dynamic_;  // per body: bodies are large
  std::vector<double> rest_offset_;
  std::vector<double> mobility_factor_;
  std::vector<double> lightness_;  // for each body relative to the heaviest one of its mechanism
  std::vector<Mat3> inverse_inertia_;
  double length_ = 1, total_mass_ = 0;
};

}  // namespace amontons
