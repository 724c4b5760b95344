// Restitution by generalised reflections (Smith, Kaufman, Vouga, Tamstorf, Grinspun, SIGGRAPH 2012): all
// contacts that approach are reflected together, then those that approach now, until none does. Contacts that
// do not approach take no part, so that momentum travels through a row of balls instead of stopping in it.
// Energy does not grow in any reflection with e <= 1.
#include <algorithm>

#include "amontons/solvers/solvers.hpp"
#include "multibody/step.hpp"

namespace amontons {

namespace {

// Reflections of one step. What still approaches afterwards is stopped by the step itself.
constexpr int most_reflections = 64;

std::vector<BodyVelocity> start_velocities(const std::vector<BodyFrame>& bodies) {
  std::vector<BodyVelocity> v;
  v.reserve(bodies.size());
  for (const BodyFrame& body : bodies) v.push_back({body.velocity, body.omega});
  return v;
}

// Impacts are over before springs, motors, dry friction or stabilisation act: locked directions only.
JointRows locked_rows(const JointRows& rows) {
  JointRows locked;
  locked.auxiliary_inverse_mass = rows.auxiliary_inverse_mass;
  for (std::size_t i = 0; i < rows.tags.size(); ++i) {
    if (rows.tags[i].kind != RowKind::locked && rows.tags[i].kind != RowKind::coupling) continue;
    locked.jacobian.push_back(rows.jacobian[i]);
    locked.compliance.push_back(rows.compliance[i]);
  }
  locked.c.assign(locked.jacobian.size(), 0.0);
  locked.cones.add_free(locked.jacobian.size());
  return locked;
}

}  // namespace

void add_cost(const Solution& solution, Report& report) {
  report.iterations += solution.iterations;
  report.products += solution.products;
  report.factorizations += solution.factorizations;
}

void add_solution(const Solution& solution, Report& report) {
  add_cost(solution, report);
  if (report.method.empty() || !(solution.residual <= report.residual)) {
    report.residual = solution.residual, report.status = solution.status, report.method = solution.method;
  }
}

bool resolve_impacts(const Model& model, const std::vector<ContactSite>& sites,
                     const std::function<const JointRows&()>& joint_rows, const Assembly& assembly,
                     double threshold, const std::string& method, const Options& options,
                     std::vector<BodyFrame>& bodies, std::vector<Vec3>& impact, Report& report) {
  impact.assign(sites.size(), Vec3{});
  std::vector<BodyVelocity> v = start_velocities(bodies);
  JointRows locked;
  std::vector<ContactSite> active;
  std::vector<std::size_t> index;
  for (int reflection = 0; reflection < most_reflections; ++reflection) {
    active.clear(), index.clear();
    bool bounces = reflection > 0;
    for (std::size_t i = 0; i < sites.size(); ++i) {
      const double u = dot(sites[i].normal, relative_velocity(sites[i], v));
      if (u >= -threshold || sites[i].gap + assembly.h * u > 0) continue;
      active.push_back(sites[i]), index.push_back(i);
      bounces = bounces || sites[i].material.restitution > 0;
    }
    if (active.empty() || !bounces) return reflection > 0;
    if (reflection == 0) locked = locked_rows(joint_rows());
    for (std::size_t i = 0; i < bodies.size(); ++i)
      bodies[i].free_velocity = v[i].linear, bodies[i].free_omega = v[i].angular;
    const Problem problem = assemble(model, bodies, active, locked, {assembly.h, 0, true});
    const Solution s = solve(problem, method, options);
    add_solution(s, report);
    apply_impulses(problem, s.x, v);
    for (std::size_t k = 0; k < active.size(); ++k) {
      std::array<double, 3> t1, t2;
      contact_tangents(active[k].normal.array(), t1, t2);
      impact[index[k]] +=
          s.x[3 * k] * active[k].normal + s.x[3 * k + 1] * to_vec3(t1) + s.x[3 * k + 2] * to_vec3(t2);
    }
    for (std::size_t i = 0; i < bodies.size(); ++i)
      bodies[i].velocity = v[i].linear, bodies[i].omega = v[i].angular;
  }
  return true;
}

}  // namespace amontons
