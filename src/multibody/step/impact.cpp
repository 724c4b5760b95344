// Restitution by generalised reflections (Smith, Kaufman, Vouga, Tamstorf, Grinspun, SIGGRAPH 2012): all
// contacts that approach are reflected together, then those that approach now, until none does. Contacts that
// do not approach take no part, so that momentum travels through a row of balls instead of stopping in it.
// Energy does not grow in any reflection: see limit_energy.
#include <algorithm>
#include <cmath>

#include "amontons/solvers/solvers.hpp"
#include "multibody/step/step.hpp"

namespace amontons {

namespace {

// Reflections of one step. What still approaches afterwards is stopped by the step itself.
constexpr int most_reflections = 64;

// Impacts are over before springs, motors, dry friction or stabilisation act: locked directions only.
JointRows locked_rows(const JointRows& rows) {
  JointRows locked;
  locked.auxiliary_inverse_mass = rows.auxiliary_inverse_mass;
  for (std::size_t i = 0; i < rows.tags.size(); ++i) {
    if (rows.tags[i].kind != RowKind::locked && rows.tags[i].kind != RowKind::coupling) continue;
    locked.jacobian.push_back(rows.jacobian[i]);
    locked.compliance.push_back(rows.compliance[i]);
    locked.tags.push_back(rows.tags[i]);
  }
  locked.c.assign(locked.jacobian.size(), 0.0);
  locked.cones.add_free(locked.jacobian.size());
  return locked;
}

// The work of impulses x on a system that moves with u0 before, per row: x' (u0 + A x / 2).
double work(const std::vector<double>& x, const std::vector<double>& u0, const std::vector<double>& Ax) {
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * (u0[i] + 0.5 * Ax[i]);
  return sum;
}

std::vector<double> difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> c(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) c[i] = a[i] - b[i];
  return c;
}

// Newton's u_n^+ = -e u_n^- with friction may create energy where friction turns the slip of an excentric
// impact round (Kane and Levinson, Dynamics, 1985; Stronge, Proc. R. Soc. A 431, 1990). The impact without
// restitution never does: with x0 complementary to u0^+ its work is -x0' A x0 / 2 at most. Hence, where s has
// done work, the impulses go back towards x0 until the work is zero: cone and joints are kept, being convex,
// and so is u_n^+ >= 0.
void limit_energy(const Problem& problem, const std::vector<ContactSite>& sites, const std::string& method,
                  const Options& options, Solution& s, Report& report) {
  Problem inelastic = problem;
  for (std::size_t i = 0; i < sites.size(); ++i)
    inelastic.b[3 * i] /= 1 + sites[i].material.restitution;  // all of them approach
  const std::vector<double> Ax = difference(s.u, problem.b);
  double stored = 0;
  for (std::size_t i = 0; i < Ax.size(); ++i) stored += 0.5 * s.x[i] * Ax[i];
  if (work(s.x, inelastic.b, Ax) <= options.tolerance * stored) return;
  const Solution plastic = solve(inelastic, method, options);
  add_solution(plastic, report);
  const std::vector<double> Ax0 = difference(plastic.u, inelastic.b), d = difference(s.x, plastic.x),
                            Ad = difference(Ax, Ax0);
  // The work at x0 + share d is a + b share + c share^2 with a <= 0 <= c.
  double a = work(plastic.x, inelastic.b, Ax0), b = 0, c = 0;
  for (std::size_t i = 0; i < d.size(); ++i) b += d[i] * (inelastic.b[i] + Ax0[i]), c += 0.5 * d[i] * Ad[i];
  a = std::min(a, 0.0);
  const double root = std::sqrt(b * b - 4 * a * c);
  const double share = b > 0 ? -2 * a / (b + root) : c > 0 ? (root - b) / (2 * c) : 0;
  for (std::size_t i = 0; i < d.size(); ++i) s.x[i] = plastic.x[i] + std::clamp(share, 0.0, 1.0) * d[i];
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

bool resolve_impacts(const Model& model, const std::vector<BodyMobility>& mobility,
                     const std::vector<ContactSite>& sites,
                     const std::function<const JointRows&()>& joint_rows, const Assembly& assembly,
                     double threshold, const std::string& method, const Options& options,
                     std::vector<BodyVelocity>& v, Impact& impact, Report& report) {
  impact.contacts.assign(sites.size(), Vec3{});
  impact.joints.assign(model.joints(), JointWrench{});
  Options timed = options;
  const auto begin = Clock::now();
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
    const Problem problem = assemble(model, mobility, v, active, locked, {assembly.h, 0, true});
    if (options.deadline < infinity) timed.deadline = std::max(1e-6, options.deadline - seconds_since(begin));
    Solution s = solve(problem, method, timed);
    add_solution(s, report);
    limit_energy(problem, active, method, timed, s, report);
    apply_impulses(problem, s.x, v);
    for (std::size_t k = 0; k < active.size(); ++k) {
      std::array<double, 3> t1, t2;
      contact_tangents(active[k].normal.array(), t1, t2);
      impact.contacts[index[k]] +=
          s.x[3 * k] * active[k].normal + s.x[3 * k + 1] * to_vec3(t1) + s.x[3 * k + 2] * to_vec3(t2);
    }
    for (std::size_t i = 0; i < locked.tags.size(); ++i) {
      const RowTag& tag = locked.tags[i];
      if (tag.kind != RowKind::locked) continue;
      const double x = s.x[3 * active.size() + i];
      impact.joints[tag.joint].force += x * tag.force, impact.joints[tag.joint].torque += x * tag.torque;
    }
  }
  return true;
}

}  // namespace amontons
