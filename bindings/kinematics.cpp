#include "amontons/multibody/kinematics/closure.hpp"
#include "amontons/multibody/kinematics/dynamics.hpp"
#include "amontons/multibody/kinematics/rays.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "bindings.hpp"
#include "math_casters.hpp"

namespace amontons::python {

namespace {

using Bytes = nb::ndarray<const unsigned char, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

std::vector<double> to_vector(const Vector& a, std::size_t count, const char* name) {
  AMONTONS_REQUIRE(a.shape(0) == count, std::string(name) + " has " + std::to_string(a.shape(0)) +
                                            " entries; the model asks for " + std::to_string(count));
  return {a.data(), a.data() + count};
}

std::span<const Vec3> to_vectors(const Matrix& a, std::size_t count, const char* name) {
  AMONTONS_REQUIRE(a.shape(0) == count && a.shape(1) == 3,
                   std::string(name) + " must have shape (" + std::to_string(count) + ", 3)");
  return {reinterpret_cast<const Vec3*>(a.data()), count};
}

// (body, parent, joint, reversed, first of q, size in q, first of qd, size in qd) per dynamic body.
nb::list links_of(const Tree& tree) {
  nb::list out;
  for (const Link& l : tree.links())
    out.append(nb::make_tuple(l.body, l.parent, l.joint, l.reversed, l.first_q, l.q, l.first_v, l.v));
  return out;
}

nb::tuple coordinates(const Tree& tree, const State& state) {
  Coordinates c = read_coordinates(tree, state);
  return nb::make_tuple(to_numpy(std::move(c.q)), to_numpy(std::move(c.qd)));
}

std::span<const unsigned char> flags(const Tree& tree, const Bytes& held) {
  AMONTONS_REQUIRE(held.shape(0) == tree.nv(), "held needs one entry per velocity");
  return {held.data(), tree.nv()};
}

// Moves bodies to q; they keep qd as far as loops allow it there. Nothing changes if q is impossible.
void set_q(const Tree& tree, Simulation& s, const Vector& given, const Bytes& held) {
  std::vector<double> q = to_vector(given, tree.nq(), "q"), qd = read_coordinates(tree, s.state()).qd;
  check_coordinates(tree, q, qd);
  close_loops(tree, s.state(), flags(tree, held), q);
  close_velocities(tree, s.state(), q, std::vector<unsigned char>(tree.nv()), qd);
  write_poses(tree, q, s.state());
  write_velocities(tree, q, qd, s.state());
}

void set_qd(const Tree& tree, Simulation& s, const Vector& given, const Bytes& held) {
  std::vector<double> q = read_coordinates(tree, s.state()).q, qd = to_vector(given, tree.nv(), "qd");
  check_coordinates(tree, q, qd);
  close_velocities(tree, s.state(), q, flags(tree, held), qd);
  write_velocities(tree, q, qd, s.state());
}

// Coordinates of the dofs of all joints, including those that close loops.
OutVector joint_coordinates(const Tree& tree, const Simulation& s) {
  const State& state = s.state();
  std::vector<Transform> poses;
  for (std::size_t i = 0; i < state.positions.size(); ++i)
    poses.push_back({state.positions[i], state.orientations[i]});
  return to_numpy(fitted_coordinates(tree.model(), poses, state.coordinates));
}

TreePose present_pose(const Tree& tree, const Simulation& s) {
  return pose_of(tree, s.state(), read_coordinates(tree, s.state()).q);
}

OutMatrix matrix(const Tree& tree, const Simulation& s) {
  const std::vector<double> q = read_coordinates(tree, s.state()).q;
  return to_numpy(mass_matrix(tree, s.state(), pose_of(tree, s.state(), q), q),
                  std::max<std::size_t>(tree.nv(), 1));
}

OutVector line(const Tree& tree, const Simulation& s, Index tendon) {
  AMONTONS_REQUIRE(tendon >= 0 && tendon < static_cast<Index>(s.model().description().tendons.size()),
                   "tendon_jacobian: there is no such tendon");
  const std::vector<double> q = read_coordinates(tree, s.state()).q;
  return to_numpy(tendon_jacobian(tree, s.state(), pose_of(tree, s.state(), q), q, tendon));
}

// A body, or the world, and a point in its frame, in world coordinates.
Vec3 place_of(const Simulation& s, Index body, const Vec3& point) {
  AMONTONS_REQUIRE(body >= world && body < static_cast<Index>(s.model().bodies()),
                   "jacobian: there is no such body");
  return body == world ? point : Transform{s.state().positions[body], s.state().orientations[body]}(point);
}

OutMatrix jacobian(const Tree& tree, const Simulation& s, Index body, const Vec3& point) {
  return to_numpy(point_jacobian(tree, present_pose(tree, s), body, place_of(s, body, point)),
                  std::max<std::size_t>(tree.nv(), 1));
}

// (n, 6, nv): the same of the origins of frames on bodies.
nb::ndarray<nb::numpy, double, nb::ndim<3>> jacobians(const Tree& tree, const Simulation& s,
                                                      const IndexVector& bodies, const Matrix& points) {
  const std::size_t n = bodies.shape(0);
  AMONTONS_REQUIRE(points.shape(0) == n && points.shape(1) >= 3, "points needs a row for each body");
  const TreePose pose = present_pose(tree, s);
  std::vector<double> rows;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 at = place_of(s, bodies(i), {points(i, 0), points(i, 1), points(i, 2)});
    const std::vector<double> own = point_jacobian(tree, pose, bodies(i), at);
    rows.insert(rows.end(), own.begin(), own.end());
  }
  auto* owner = new std::vector<double>(std::move(rows));
  nb::capsule capsule(owner, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
  return nb::ndarray<nb::numpy, double, nb::ndim<3>>(owner->data(), {n, 6, tree.nv()}, capsule);
}

OutVector inverse(const Tree& tree, const Simulation& s, const Vector& qdd) {
  const Coordinates c = read_coordinates(tree, s.state());
  return to_numpy(inverse_dynamics(tree, s.state(), pose_of(tree, s.state(), c.q), c.q, c.qd,
                                   to_vector(qdd, tree.nv(), "qdd")));
}

void append(std::vector<double>& row, std::initializer_list<Vec3> vectors) {
  for (const Vec3& v : vectors) row.insert(row.end(), {v.x, v.y, v.z});
}

// Data of bodies for sensors, at given accelerations. First (n, 28), per frame on a body (-1: the world):
// position, axes as the rows of a matrix (3, 3) and orientation. Then velocity, angular velocity,
// acceleration of its origin and angular acceleration. Then (bodies, 15): centre of mass, momentum and its
// moment, force and its moment.
nb::tuple observe(const Tree& tree, const Simulation& s, const Vector& qdd, const IndexVector& bodies,
                  const Matrix& frames) {
  AMONTONS_REQUIRE(frames.shape(0) == bodies.shape(0) && frames.shape(1) == 7,
                   "frames must have seven columns");
  const State& state = s.state();
  const Coordinates c = read_coordinates(tree, state);
  const TreePose pose = pose_of(tree, state, c.q);
  const std::vector<double> rates = to_vector(qdd, tree.nv(), "qdd");
  const TreeMotion motion = motion_of(tree, state, pose, c.qd, rates);
  std::vector<double> rows, momenta;
  for (std::size_t i = 0; i < bodies.shape(0); ++i) {
    const Index body = bodies(i);
    const Transform frame{{frames(i, 0), frames(i, 1), frames(i, 2)},
                          {frames(i, 3), frames(i, 4), frames(i, 5), frames(i, 6)}};
    Transform in_world = frame;
    Twist v{}, a{};
    if (body >= 0) {
      in_world = Transform{state.positions[body], state.orientations[body]} * frame;
      v = motion.velocities[body];
      a = motion.accelerations[body];
    }
    const Vec3& p = in_world.position;
    const Quat& q = in_world.rotation;
    const Mat3 axes = to_matrix(q);
    append(rows, {p, axes.row[0], axes.row[1], axes.row[2]});
    rows.insert(rows.end(), {q.w, q.x, q.y, q.z});
    // The acceleration of the particle there: that of the flow, plus omega x v for its motion through it.
    append(rows, {velocity_at(v, p), v.angular, velocity_at(a, p) + cross(v.angular, velocity_at(v, p)),
                  a.angular});
  }
  for (const BodyMomentum& b : body_momenta(tree, state, pose, c.qd, rates))
    append(momenta, {b.centre, b.momentum.linear, b.momentum.angular, b.force.linear, b.force.angular});
  return nb::make_tuple(to_numpy(std::move(rows), 28), to_numpy(std::move(momenta), 15));
}

// (n,) distances, infinite without a hit; (n,) geoms, -1 without a hit; (n, 3) normals.
nb::tuple cast_rays(const Simulation& s, const Matrix& origins, const Matrix& directions,
                    const Bytes& excluded) {
  const std::size_t n = origins.shape(0);
  AMONTONS_REQUIRE(excluded.shape(0) == s.model().description().geoms.size(),
                   "excluded needs one entry per geom");
  const auto from = to_vectors(origins, n, "origins"), along = to_vectors(directions, n, "directions");
  std::vector<double> distances, normals;
  std::vector<Index> geoms;
  for (std::size_t i = 0; i < n; ++i) {
    const GeomHit hit =
        cast_ray(s.model(), s.state(), {from[i], along[i]}, {excluded.data(), excluded.shape(0)});
    distances.push_back(hit.hit.distance);
    geoms.push_back(hit.geom);
    normals.insert(normals.end(), {hit.hit.normal.x, hit.hit.normal.y, hit.hit.normal.z});
  }
  return nb::make_tuple(to_numpy(std::move(distances)), to_numpy(std::move(geoms)),
                        to_numpy(std::move(normals), 3));
}

}  // namespace

void bind_kinematics(nb::module_& m) {
  m.def("cast_rays", &cast_rays, nb::arg("simulation"), nb::arg("origins"), nb::arg("directions"),
        nb::arg("excluded"), "Distances, geoms, normals.");
  nb::class_<Tree>(m, "Tree", "The spanning tree of a model's joints, and what follows from it.")
      .def(nb::new_([](std::shared_ptr<Model> model) { return std::make_shared<Tree>(std::move(model)); }),
           nb::arg("model"))
      .def_prop_ro("nq", &Tree::nq)
      .def_prop_ro("nv", &Tree::nv)
      .def_prop_ro("links", &links_of)
      .def_prop_ro("loops", &Tree::loops)
      .def(
          "coordinates", [](const Tree& tree, const Simulation& s) { return coordinates(tree, s.state()); },
          nb::arg("simulation"))
      .def(
          "rates", [](const Tree&, const Simulation& s) { return to_numpy(s.accelerations()); },
          nb::arg("simulation"))
      .def("set_q", &set_q, nb::arg("simulation"), nb::arg("q"), nb::arg("held"))
      .def("set_qd", &set_qd, nb::arg("simulation"), nb::arg("qd"), nb::arg("held"))
      .def("joint_coordinates", &joint_coordinates, nb::arg("simulation"))
      .def("jacobian", &jacobian, nb::arg("simulation"), nb::arg("body"), nb::arg("point"),
           "Of a point in the frame of the body.")
      .def("jacobians", &jacobians, nb::arg("simulation"), nb::arg("bodies"), nb::arg("points"))
      .def("mass_matrix", &matrix, nb::arg("simulation"))
      .def("tendon_jacobian", &line, nb::arg("simulation"), nb::arg("tendon"))
      .def("inverse_dynamics", &inverse, nb::arg("simulation"), nb::arg("qdd"))
      .def("observe", &observe, nb::arg("simulation"), nb::arg("qdd"), nb::arg("bodies"), nb::arg("frames"))
      .def(
          "generalised_forces",
          [](const Tree& tree, const Simulation& s, const Matrix& forces, const Matrix& torques) {
            const std::size_t n = s.model().bodies();
            return to_numpy(amontons::generalised_forces(tree, present_pose(tree, s),
                                                         to_vectors(forces, n, "forces"),
                                                         to_vectors(torques, n, "torques")));
          },
          nb::arg("simulation"), nb::arg("forces"), nb::arg("torques"));
}

}  // namespace amontons::python
