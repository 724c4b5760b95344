// Closes loops by Newton's method. A loop is closed when the locked directions of its joint have no error.
// The derivative of an error along qd is the power of its wrench on the columns of the tree.
#include "amontons/multibody/kinematics/closure.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/base/error.hpp"
#include "multibody/joints/chain.hpp"
#include "multibody/joints/couplings.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/tendons.hpp"

namespace amontons {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A wrench about the world's origin on body A, and its opposite on B: its power is the rate of a condition.
struct Pull {
  Index body_a, body_b;
  Vec3 force, torque;
};

// C = 0, in m (angles times length), and dC/dt as the power of pulls.
struct Condition {
  double value;
  std::vector<Pull> pulls;
  Index joint, coupling;  // the joint or coupling of the condition; the other is -1
};

double power(const Pull& pull, const Twist& twist) {
  return dot(pull.force, twist.linear) + dot(pull.torque, twist.angular);
}

// Frames of joints for given poses of bodies and coordinates of all dofs.
struct Placed {
  const Model& model;
  std::span<const Transform> bodies;
  std::span<const double> coordinates;

  Transform of(Index body) const { return body < 0 ? Transform{} : bodies[body]; }
  Transform frame_b(const Joint& joint) const { return of(joint.body_b) * joint.frame_b; }
  Transform relative(const Joint& joint) const {
    return inverse(frame_b(joint)) * (of(joint.body_a) * joint.frame_a);
  }
  ChainKinematics chain(Index j) const {
    const std::size_t first = model.first_dof(j);
    return chain_kinematics(model.joint(j), relative(model.joint(j)),
                            coordinates.subspan(first, model.first_dof(j + 1) - first));
  }
  // The wrench (axes of frame_b, about a point given there) in the world.
  Pull pull(const Joint& joint, const Screw& wrench, const Vec3& point, double scale) const {
    const Transform b = frame_b(joint);
    const Vec3 f = scale * rotate(b.rotation, wrench.linear);
    return {joint.body_a, joint.body_b, f, scale * rotate(b.rotation, wrench.angular) + cross(b(point), f)};
  }
  Pull rate_of(Index j, Index dof, double scale) const {
    const ChainKinematics k = chain(j);
    return pull(model.joint(j), dual_wrenches(k, model.length())[dof], k.reference, scale);
  }
};

void append_chain(const Placed& placed, Index j, std::vector<Condition>& conditions) {
  const ChainKinematics chain = placed.chain(j);
  std::array<Screw, 6> wrenches;
  const std::size_t count = locked_wrenches(chain, placed.model.length(), wrenches);
  for (std::size_t i = 0; i < count; ++i)
    conditions.push_back({dot(wrenches[i], chain.error),
                          {placed.pull(placed.model.joint(j), wrenches[i], chain.reference, 1)},
                          j,
                          -1});
}

// A distance within its range is no condition.
void append_distance(const Placed& placed, Index j, std::vector<Condition>& conditions) {
  const Joint& rod = placed.model.joint(j);
  const Vec3 between = placed.relative(rod).position;
  const double distance = norm(between);
  const double excess = distance - std::clamp(distance, rod.lower_distance, rod.upper_distance);
  if (excess == 0 && rod.lower_distance < rod.upper_distance) return;
  const Vec3 direction = distance > 0 ? between / distance : Vec3{0, 0, 1};
  conditions.push_back({excess, {placed.pull(rod, {direction, {}}, between, 1)}, j, -1});
}

// Adds the rate of a coordinate of a coupling, of a joint or tendon, times a factor.
void append_rate(const Placed& placed, const BodyFrames& frames, const State& at, const Coordinate& c,
                 double factor, std::vector<Pull>& pulls) {
  if (c.tendon < 0) return pulls.push_back(placed.rate_of(c.joint, c.dof, factor));
  const WideRow row = tendon_line(placed.model, frames, at, c.tendon).row;
  for (std::size_t i = 0; i < row.body.size(); ++i) {
    const auto& j = row.j[i];
    const Vec3 f = factor * Vec3{j[0], j[1], j[2]}, t = factor * Vec3{j[3], j[4], j[5]};
    pulls.push_back({row.body[i], world, f, t + cross(frames[row.body[i]].centre, f)});
  }
}

void append_coupling(const Placed& placed, std::size_t index, std::vector<Condition>& conditions) {
  const Coupling& c = placed.model.description().couplings[index];
  State at;
  at.coordinates.assign(placed.coordinates.begin(), placed.coordinates.end());
  // Only pose and centre of a frame are read.
  BodyFrames frames(placed.bodies.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].pose = placed.bodies[i];
    frames[i].centre = frames[i].pose(placed.model.body(static_cast<Index>(i)).centre_of_mass);
  }
  const CouplingValue value = coupling_value(placed.model, c, frames, at);
  const double scale = coupling_scale(placed.model, c);
  Condition condition{scale * value.violation, {}, -1, static_cast<Index>(index)};
  append_rate(placed, frames, at, coordinate_a(c), scale, condition.pulls);
  if (c.joint_b >= 0 || c.tendon_b >= 0)
    append_rate(placed, frames, at, coordinate_b(c), -scale * value.slope, condition.pulls);
  conditions.push_back(std::move(condition));
}

// The conditions of all rigid loops; a compliant joint is a spring and closes no loop.
std::vector<Condition> conditions_at(const Tree& tree, const Placed& placed) {
  std::vector<Condition> conditions;
  for (const Index j : tree.loops()) {
    if (tree.model().joint(j).compliance > 0) continue;
    (is_chain(tree.model().joint(j)) ? append_chain : append_distance)(placed, j, conditions);
  }
  const auto& couplings = tree.model().description().couplings;
  for (std::size_t k = 0; k < couplings.size(); ++k)
    if (couplings[k].compliance == 0 && couplings[k].backlash == 0) append_coupling(placed, k, conditions);
  return conditions;
}

// The loops at q: errors, and their derivatives along qd, one row each.
struct Loops {
  TreePose pose;
  std::vector<double> coordinates;
  std::vector<Condition> conditions;
  VectorXd errors;
};

Loops loops_at(const Tree& tree, const State& state, std::span<const double> q, std::vector<double> near) {
  Loops loops;
  const Model& model = tree.model();
  loops.pose = pose_of(tree, state, q);
  loops.coordinates = joint_coordinates_at(tree, loops.pose, q, std::move(near));
  loops.conditions = conditions_at(tree, {model, loops.pose.bodies, loops.coordinates});
  loops.errors.resize(static_cast<Eigen::Index>(loops.conditions.size()));
  for (Eigen::Index i = 0; i < loops.errors.size(); ++i) loops.errors[i] = loops.conditions[i].value;
  return loops;
}

// Unit of each entry of qd (m): 1 for displacements, length for angles.
std::vector<double> units(const Tree& tree) {
  std::vector<double> unit(tree.nv(), tree.model().length());
  for (const Link& link : tree.links()) {
    if (link.joint < 0) {
      std::fill_n(unit.begin() + static_cast<std::ptrdiff_t>(link.first_v), 3, 1.0);
      continue;
    }
    const auto& dofs = tree.model().joint(link.joint).dofs;
    for (std::size_t i = 0; i < dofs.size(); ++i)
      if (dofs[i].kind == Dof::Kind::slide) unit[link.first_v + i] = 1;
  }
  return unit;
}

// Rows of conditions, columns in units of length; zero for held entries.
MatrixXd jacobian(const Tree& tree, const Loops& loops, std::span<const double> unit,
                  std::span<const unsigned char> held) {
  MatrixXd J = MatrixXd::Zero(loops.errors.size(), static_cast<Eigen::Index>(tree.nv()));
  for (Eigen::Index i = 0; i < J.rows(); ++i)
    for (const Pull& pull : loops.conditions[i].pulls)
      for (const double sign : {1.0, -1.0})
        for (Index k = tree.link_of(sign > 0 ? pull.body_a : pull.body_b); k >= 0;
             k = tree.link_of(tree.links()[k].parent)) {
          const Link& link = tree.links()[k];
          for (std::size_t c = link.first_v; c < link.first_v + link.v; ++c)
            if (!held[c])
              J(i, static_cast<Eigen::Index>(c)) += sign * power(pull, loops.pose.columns[c]) / unit[c];
        }
  return J;
}

// Approximately the least change z with J z = -r. Redundant loops make J J' singular, and poses near dead
// centre nearly singular. Levenberg's term vanishes with the square of the error, which keeps the convergence
// quadratic (Yamashita and Fukushima, "On the rate of convergence of the Levenberg-Marquardt method", 2001).
VectorXd least_change(const MatrixXd& J, const VectorXd& r, double relative_error) {
  MatrixXd N = J * J.transpose();
  const double size = N.trace() / static_cast<double>(N.rows());
  N.diagonal().array() += size * (1e-14 + std::min(1e-2, relative_error * relative_error)) + 1e-300;
  return -J.transpose() * N.ldlt().solve(r);
}

// q after a move by s z / unit along qd.
std::vector<double> moved(const Tree& tree, const std::vector<double>& q, const VectorXd& z,
                          std::span<const double> unit, double s) {
  std::vector<double> rates(unit.size());
  for (std::size_t i = 0; i < rates.size(); ++i) rates[i] = z[static_cast<Eigen::Index>(i)] / unit[i];
  return moved_along(tree, q, rates, s);
}

std::string quoted(const std::string& kind, const std::string& name, Index index) {
  return name.empty() ? kind + " " + std::to_string(index) : kind + " \"" + name + "\"";
}

[[noreturn]] void refuse(const Tree& tree, const Loops& loops, bool any_held, bool velocity) {
  Eigen::Index worst = 0;
  loops.errors.cwiseAbs().maxCoeff(&worst);
  const Condition& condition = loops.conditions[worst];
  const Model& model = tree.model();
  const std::string which =
      condition.joint >= 0
          ? quoted("joint", model.joint(condition.joint).name, condition.joint)
          : quoted("coupling", model.description().couplings[condition.coupling].name, condition.coupling);
  char gap[64];
  std::snprintf(gap, sizeof gap, "%.3g %s", std::abs(condition.value), velocity ? "m/s" : "m");
  throw InputError(std::string(velocity ? "qd does not keep " : "q does not close ") + which + ": a gap of " +
                   gap + " is left (angles times the length of the model); " +
                   (any_held
                        ? "give values that fit together, or fewer of them, so that the others can follow"
                        : "begin nearer to a pose in which the loop is closed"));
}

// Length (m) to which loop errors are compared: the model's, or the distances of its bodies if they are
// larger.
double extent(const Tree& tree, const TreePose& pose) {
  double size = tree.model().length();
  for (const Link& link : tree.links()) {
    const Vec3& origin = pose.bodies[link.parent < 0 ? link.body : link.parent].position;
    size = std::max(size, norm(pose.bodies[link.body].position - origin));
  }
  return size;
}

constexpr double closed = 1e-9;     // relative to the extent: accepted if rounding prevents a smaller error
constexpr double rounding = 1e-14;  // relative to the extent

}  // namespace

void check_coordinates(const Tree& tree, std::span<double> q, std::span<const double> qd) {
  for (const Link& link : tree.links()) {
    const auto who = [&] {
      const Model& model = tree.model();
      return link.joint < 0 ? quoted("body", model.body(link.body).name, link.body)
                            : quoted("joint", model.joint(link.joint).name, link.joint);
    };
    const auto finite = [](double x) { return std::isfinite(x); };
    const std::span<double> own = q.subspan(link.first_q, link.q);
    const auto rates = qd.subspan(link.first_v, link.v);
    AMONTONS_REQUIRE(std::all_of(own.begin(), own.end(), finite), "q of " + who() + " is not finite");
    AMONTONS_REQUIRE(std::all_of(rates.begin(), rates.end(), finite), "qd of " + who() + " is not finite");
    const std::size_t plain = link.joint < 0 ? 3 : tree.model().joint(link.joint).dofs.size();
    if (link.q == plain) continue;
    const auto ball = own.subspan(plain);
    const double size = norm(Quat{ball[0], ball[1], ball[2], ball[3]});
    AMONTONS_REQUIRE(size > 1e-6 && size < 1e6,
                     "q of " + who() + " has a quaternion of length " + std::to_string(size) +
                         "; give a unit quaternion (w, x, y, z), (1, 0, 0, 0) is no rotation");
    // A quaternion normalised to rounding is not changed, so that q keeps its bits.
    if (std::abs(size - 1) > 1e-15)
      for (double& c : ball) c /= size;
  }
}

// Without any, no pose needs to be made to know it.
static bool has_no_loops(const Tree& tree) {
  return tree.loops().empty() && tree.model().description().couplings.empty();
}

void close_loops(const Tree& tree, const State& state, std::span<const unsigned char> held,
                 std::vector<double>& q) {
  if (has_no_loops(tree)) return;
  // Newton steps, and halvings of each (counts): limits.
  constexpr int most_steps = 100, most_halvings = 8;
  constexpr double largest_turn = 0.5;  // limit of one step (rad): beyond it errors are nonlinear
  const std::vector<double> unit = units(tree);
  std::vector<double> now = q;
  Loops loops = loops_at(tree, state, now, state.coordinates);
  if (loops.conditions.empty()) return;
  const double size = extent(tree, loops.pose), length = tree.model().length();
  for (int step = 0; step < most_steps; ++step) {
    const double error = loops.errors.norm();
    if (error <= rounding * size) break;
    const VectorXd z = least_change(jacobian(tree, loops, unit, held), loops.errors, error / size);
    const double longest = z.size() ? z.cwiseAbs().maxCoeff() / length : 0;
    double s = longest > largest_turn ? largest_turn / longest : 1;
    // Ends of ranges appear and vanish as conditions: a step is accepted if the errors decrease.
    bool better = false;
    for (int halving = 0; halving < most_halvings && !better; ++halving, s /= 2) {
      std::vector<double> trial = moved(tree, now, z, unit, s);
      Loops there = loops_at(tree, state, trial, loops.coordinates);
      better = there.errors.norm() < error;
      if (!better) continue;
      now = std::move(trial);
      loops = std::move(there);
    }
    if (!better) break;
  }
  const bool any_held = std::any_of(held.begin(), held.end(), [](unsigned char h) { return h != 0; });
  if (!(loops.errors.norm() <= closed * size)) refuse(tree, loops, any_held, false);
  q = std::move(now);
}

void close_velocities(const Tree& tree, const State& state, std::span<const double> q,
                      std::span<const unsigned char> held, std::vector<double>& qd) {
  if (has_no_loops(tree)) return;
  Loops loops = loops_at(tree, state, q, state.coordinates);
  if (loops.conditions.empty()) return;
  const std::vector<double> unit = units(tree), none(tree.nv());
  const auto rates = [&] {
    const TreeMotion motion = motion_of(tree, state, loops.pose, qd, none);
    for (Eigen::Index i = 0; i < loops.errors.size(); ++i) {
      loops.errors[i] = 0;
      for (const Pull& pull : loops.conditions[i].pulls) {
        if (pull.body_a >= 0) loops.errors[i] += power(pull, motion.velocities[pull.body_a]);
        if (pull.body_b >= 0) loops.errors[i] -= power(pull, motion.velocities[pull.body_b]);
      }
    }
    return loops.errors.norm();
  };
  const double before = rates();
  const MatrixXd J = jacobian(tree, loops, unit, held);
  // Twice: the second pass removes the error of the damping.
  double left = before;
  for (int pass = 0; pass < 3 && left > rounding * before; ++pass) {
    const VectorXd z = least_change(J, loops.errors, 0);
    for (std::size_t i = 0; i < qd.size(); ++i) qd[i] += z[static_cast<Eigen::Index>(i)] / unit[i];
    left = rates();
  }
  double speed = before;
  for (std::size_t i = 0; i < qd.size(); ++i) speed = std::max(speed, std::abs(qd[i]) * unit[i]);
  const bool any_held = std::any_of(held.begin(), held.end(), [](unsigned char h) { return h != 0; });
  if (!(left <= closed * std::max(speed, 1e-300))) refuse(tree, loops, any_held, true);
}

}  // namespace amontons
