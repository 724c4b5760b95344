// Private pieces of Simulation::step(), in the order in which a step uses them.
#pragma once
#include <chrono>
#include <functional>
#include <vector>

#include "amontons/collision/broad_phase.hpp"
#include "amontons/collision/pairs/collide.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/multibody/step/simulation.hpp"

namespace amontons {

using Clock = std::chrono::steady_clock;
inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// A contact point with all that its rows need. body_a is dynamic.
struct ContactSite {
  Index body_a, body_b, geom_a, geom_b;
  Vec3 point, normal, r_a, r_b;
  double gap;
  Material material;
  Vec3 surface;  // velocity of A's surface over its body less that of B's, tangential, world
};

struct ContactFinder {
  BroadPhase broad_phase;
  std::vector<Transform> frames;
  std::vector<Aabb> boxes;
  std::vector<unsigned char> fixed;
  std::vector<double> speeds;
  std::vector<IndexPair> pairs;
  std::vector<ContactPoint> points;
  std::vector<std::size_t> by_pair;
  std::vector<Transform> ends;
  std::vector<std::size_t> by_body;
  std::vector<unsigned char> passed;

  void sort_by_pair(const std::vector<ContactSite>& sites);

  // All contact points within `margin`, or that the velocities v bring there within h.
  void find(const Model& model, const std::vector<BodyFrame>& bodies, const std::vector<BodyVelocity>& v,
            double h, double margin, std::vector<ContactSite>& sites);
  // Appends the points that the velocities v after a solve bring deeper than `allowance` and that are not
  // among the sites, which the free velocities foresaw: an impact gives bodies velocities that nobody could
  // foresee. Returns their number.
  std::size_t find_missed(const Model& model, const std::vector<BodyFrame>& bodies,
                          const std::vector<BodyVelocity>& free, const std::vector<BodyVelocity>& v, double h,
                          double margin, double allowance, std::vector<ContactSite>& sites);
  // Appends the points of known pairs that overlap by more than `allowance` where v takes the bodies: a face
  // that turns while something slides along it is where its old normal does not tell. Arms, normal and gap of
  // these points are those of the end of the step, so that they ask for nothing that the motion does not.
  // Returns their number.
  std::size_t find_overlaps(const Model& model, const std::vector<BodyFrame>& bodies,
                            const std::vector<BodyVelocity>& v, double h, double allowance,
                            std::vector<ContactSite>& sites);

 private:
  // Whether the side of geom B, on which A does not rest yet, is level with the face on which A does.
  bool is_seam(const Model& model, const ContactSite& site, double margin,
               const std::vector<ContactSite>& sites);
  // f(site, gap at the end of the step) for every point in reach of the velocities v.
  template <class F>
  void visit(const Model& model, const std::vector<BodyFrame>& bodies, const std::vector<BodyVelocity>& v,
             double h, double margin, F&& f);
};

// u = v_A + w_A x r_A - v_B - w_B x r_B + surface, of the given velocities.
Vec3 relative_velocity(const ContactSite& site, const std::vector<BodyVelocity>& v);

// Impulses of the last step on the contact points of this one: same geoms, nearest point. x0 has three
// entries per site (normal, tangent 1, tangent 2).
void warm_start_contacts(const Model& model, const std::vector<CachedContact>& cache, double scale,
                         const std::vector<BodyFrame>& bodies, const std::vector<ContactSite>& sites,
                         std::vector<double>& x0);

// The VI of a step: contacts first, then joint rows.
struct Assembly {
  double h, recovery_speed;
  bool impact = false;  // ask for u_n = -e u_n^- in place of the closing of gaps
};
Problem assemble(const Model& model, const std::vector<BodyMobility>& mobility,
                 const std::vector<BodyVelocity>& free, const std::vector<ContactSite>& sites,
                 const JointRows& rows, const Assembly& options);

// Solves the VI of a step from the impulses of the last one, options.x0.
Solution solve_step(const Problem& problem, const std::string& method, const Options& options);

// v += M^-1 D' x
void apply_impulses(const Problem& problem, std::span<const double> x, std::vector<BodyVelocity>& v);

// The impulses of impacts: per site (world, on A), and of the locked directions of each joint, as in State.
struct Impact {
  std::vector<Vec3> contacts;
  std::vector<JointWrench> joints;
};

// Impacts with restitution at the start of a step: turns the velocities v before them into those after, and
// stores the impulses in `impact`. The joint rows are called for when something bounces. Adds the cost of its
// solves to the report, and their residual if it is worse. Returns whether anything bounced.
bool resolve_impacts(const Model& model, const std::vector<BodyMobility>& mobility,
                     const std::vector<ContactSite>& sites,
                     const std::function<const JointRows&()>& joint_rows, const Assembly& assembly,
                     double threshold, const std::string& method, const Options& options,
                     std::vector<BodyVelocity>& v, Impact& impact, Report& report);
// Adds the cost of a solve to the report, and its residual, status and method if that is the worst so far.
void add_cost(const Solution& solution, Report& report);
void add_solution(const Solution& solution, Report& report);

}  // namespace amontons
