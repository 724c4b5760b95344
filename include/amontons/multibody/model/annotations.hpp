#pragma once
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "amontons/base/fields.hpp"
#include "amontons/base/math.hpp"
#include "amontons/collision/shapes/shapes.hpp"
#include "amontons/problem/contact.hpp"

// Parts of a model that no step reads: what it looks like, where it is measured, and states to start from.
// C++ hands them on from file to file, and Python uses them. They are not checked here.
namespace amontons {

// Triangles for pictures alone: arrays of float32 and int32, compressed by zlib and written in base64.
struct PictureMesh {
  std::string vertices, triangles;
};

// The look of a thing, or the volume in which a sensor feels: a shape, or a mesh for pictures, or neither. A
// mesh has no contacts, so that nothing of it need be closed or convex, and no solver unpacks it.
// Copies share the mesh, as copies of a Hull share its corners.
struct Look {
  std::optional<Shape> shape;
  std::shared_ptr<const PictureMesh> mesh;
};

// The link that holds a part of a body, an index of ModelDescription::links; own_link is the body itself.
constexpr Index own_link = -1;

// A part of a body with a name of its own: a fixed joint of a file holds it. The mass of the body includes
// it.
struct NamedLink {
  std::string name;
  Index body = world;
  // In the body frame.
  Transform frame;
  // The link that holds it, and the name of the fixed joint.
  Index carrier = own_link;
  std::string joint;
  // The mass of this part alone: kg, m in its frame, kg m^2 about its centre of mass in its own axes.
  double mass = 0;
  Vec3 centre_of_mass;
  Mat3 inertia;
};

// A named frame fixed in a body.
struct Site {
  std::string name;
  Index body = world;
  Transform frame;
  // The volume in which a touch sensor feels; neither: anywhere on the body.
  Look shape;
};

// A measurement, of the kinds of MJCF (docs/models.md).
struct Sensor {
  std::string name, kind;
  Index body = world;
  Transform frame;
  // The body in whose frame frame sensors tell; none: the world.
  std::optional<Index> reference;
  Transform reference_frame;
  // The coordinate, tendon or actuator, by name.
  std::string source;
  // The volume of touch sensors, at `frame`, and of insidesite, at `reference_frame`.
  Look shape;
  // For force, torque and subtree sensors: bodies that hang on it, each with all its links.
  std::vector<Index> bodies;
  // The magnetic field in the world, for magnetometers.
  Vec3 field;
  // Values are clipped to +- this; 0: they are not.
  double cutoff = 0;
  Index link = own_link;
  // Links that count, of bodies that are not in `bodies`.
  std::vector<Index> links;
};

// A visual shape on a body or on the world, without contacts.
struct Visual {
  std::string name;
  Index body = world;
  Transform frame;
  Look shape;
  // Red, green, blue and opacity, from 0 to 1; none: that of the kind of shape.
  std::optional<std::array<double, 4>> colour;
  Index link = own_link;
};

// A state to start from: arrays as in State. Empty controls or activations stay as they are.
struct Keyframe {
  std::string name;
  double time = 0;
  std::vector<Vec3> positions;
  std::vector<Quat> orientations;
  std::vector<Vec3> linear_velocities, angular_velocities;
  std::vector<double> joint_coordinates, controls, activations;
};

// An element of a model file that was not read. `place` is file:line, `effect` how much that changes the
// motion: "large", "small" or "none".
struct Unread {
  std::string place, element, what, effect;
};

namespace detail {
AMONTONS_FIELDS(PictureMesh, vertices, triangles);
AMONTONS_FIELDS(NamedLink, name, body, frame, carrier, joint, mass, centre_of_mass, inertia);
AMONTONS_FIELDS(Site, name, body, frame, shape);
AMONTONS_FIELDS(Sensor, name, kind, body, frame, reference, reference_frame, source, shape, bodies, field,
                cutoff, link, links);
AMONTONS_FIELDS(Visual, name, body, frame, shape, colour, link);
AMONTONS_FIELDS(Keyframe, name, time, positions, orientations, linear_velocities, angular_velocities,
                joint_coordinates, controls, activations);
AMONTONS_FIELDS(Unread, place, element, what, effect);
}  // namespace detail

}  // namespace amontons
