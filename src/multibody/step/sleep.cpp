// A step is a function of the state without its time, and of islands that no row joins each is a function of
// its own part. An island rests in a step that leaves its part as it was, to the bit: poses, velocities,
// loads, controls, coordinates, and the impulses from which solves start. The next step then finds the same
// for it, as long as nothing changes this part and no other body comes near. So there is no tolerance, and
// nothing drifts.
//
// Some rules of a step depend on the whole scene. Those for closed contacts depend on the number of contacts
// and on the deepest overlap. Sleepers keep their part. If a step misses its tolerance or applies another
// rule, all wake and the step is made again. A correction of positions leaves islands that stand without an
// error as they are (step/positions).
//
// Bodies with tendons, couplings, drives of their own or bonds do not fall asleep: their rows depend on more.
//
// Joints asleep have no rows. Their impulses are kept, and the state gets them as those of known efforts. The
// rates of all trees are found together, to a precision that depends on the fastest. So trees asleep stay
// among them, with the impulses on their bodies.
//
// Why the others keep their bits. The search treats bodies asleep as fixed. So it finds no pair of two of
// them, and each pair of one with a body awake. If such a pair has a point in reach, its island wakes. Until
// then its contacts are those of the step before. Contacts of a pair are a function of the poses and free
// velocities of its bodies (contacts/standing_pairs). Flush neighbours and redundant points follow from the
// other contacts of these bodies. Rows and b follow from contacts and the rules that the sleepers keep. The
// impulses in the state solve the problem to rounding, so that they are its solution again. The other islands
// are solved as the same part of the problem, whether those left out rest or sleep (step/rest). Sums over the
// scene have zeros of those asleep, as the work along mean velocities has. Their velocities without impulses
// are known, so that a look ahead compares the same changes.
//
// Stages write arrays with an entry per body or geom. A step visits the bodies awake alone (Visited), because
// the entries of the others are those that it would write. Only the first step beside a set of islands visits
// all. Some passes over all bodies remain. Users may change any entry of the state, so that it is compared
// with the last one, and what differs is copied. The potential energy is a sum over all. The products of the
// problem have all bodies, with zeros for those that no row touches.
//
// Impulses in the frame of a contact and back would carry over rounding from step to step. Contacts of
// islands at rest keep those of the state (step/move_on).
#include "multibody/step/sleep.hpp"

#include <algorithm>

#include "multibody/step/assemble.hpp"
#include "multibody/step/changes.hpp"
#include "multibody/step/second_order.hpp"

namespace amontons {

namespace {

// Bodies whose motion depends on more than their own part of the state, their contacts and their joints. A
// tendon, a coupling or a bond may join two islands without a row. A control that pushes a body is no part of
// a joint.
std::vector<unsigned char> find_linked(const Model& model) {
  const ModelDescription& d = model.description();
  std::vector<unsigned char> linked(model.bodies(), 0);
  const auto link = [&](Index body) {
    if (body >= 0) linked[static_cast<std::size_t>(body)] = 1;
  };
  const auto link_joint = [&](Index j) {
    if (j < 0) return;
    link(model.joint(j).body_a);
    link(model.joint(j).body_b);
  };
  for (const Tendon& t : d.tendons) {
    for (const PathElement& p : t.path) link(p.body);
    for (const TendonTerm& term : t.terms) link_joint(term.joint);
  }
  for (const Coupling& c : d.couplings) {
    link_joint(c.joint_a);
    link_joint(c.joint_b);
  }
  for (const Actuator& a : d.actuators) {
    link(a.transmission.body);
    link(a.transmission.reference_body);
  }
  for (const Bond& b : d.bonds) {
    link(b.body_a);
    link(b.body_b);
  }
  return linked;
}

// The pair of geoms in the order of a search.
std::pair<Index, Index> in_order(const Contact& c) { return std::minmax(c.geom_a, c.geom_b); }
bool is_before(const Contact& a, const Contact& b) { return in_order(a) < in_order(b); }

bool has_impulse(const Contact& c) { return !(c.impulse == Vec3{}); }

void list_visited(const Model& model, Sleepers& s) {
  std::vector<unsigned char> visited(model.bodies());
  for (std::size_t i = 0; i < visited.size(); ++i) visited[i] = s.group[i] < 0;
  for (const Joint& joint : model.description().joints)
    for (const Index body : {joint.body_a, joint.body_b})
      if (body >= 0) visited[static_cast<std::size_t>(body)] = 1;
  s.number = next_number();
  s.visited_bodies.clear();
  s.visited_geoms.clear();
  for (std::size_t i = 0; i < visited.size(); ++i)
    if (visited[i]) s.visited_bodies.push_back(static_cast<Index>(i));
  const auto& geoms = model.description().geoms;
  for (std::size_t g = 0; g < geoms.size(); ++g)
    if (geoms[g].body >= 0 && visited[static_cast<std::size_t>(geoms[g].body)])
      s.visited_geoms.push_back(static_cast<Index>(g));
}

// Makes what follows from the contacts asleep, and from the groups that sleep.
void count(const Model& model, Sleepers& s) {
  if (std::none_of(s.groups.begin(), s.groups.end(), [](const Sleepers::Group& g) { return g.sleeps; })) {
    s = {};
    return;
  }
  s.overlap = s.penetration = 0;
  s.stays.assign(model.bodies(), 0);
  s.bears.assign(model.bodies(), 0);
  for (std::size_t i = 0; i < model.bodies(); ++i)
    s.stays[i] = s.group[i] >= 0 || !model.is_dynamic(static_cast<Index>(i));
  for (const Contact& c : s.contacts) {
    if (!(c.material.compliance > 0)) s.overlap = std::max(s.overlap, -c.gap);
    s.penetration = std::max(s.penetration, -c.gap);
    if (c.body_b >= 0 && !model.is_dynamic(c.body_b)) s.bears[static_cast<std::size_t>(c.body_b)] = 1;
  }
  s.joints.assign(model.joints(), 0);
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    s.joints[j] = s.contains(joint.body_a) || s.contains(joint.body_b);
    for (const Index body : {joint.body_a, joint.body_b})
      if (s.joints[j] && body >= 0 && !model.is_dynamic(body)) s.bears[static_cast<std::size_t>(body)] = 1;
  }
  list_visited(model, s);
  // Groups that woke leave no number behind.
  std::vector<Index> number(s.groups.size(), -1);
  Index kept = 0;
  s.maps = {};
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (!s.groups[i].sleeps) continue;
    s.maps.add(s.groups[i].maps);
    s.groups[static_cast<std::size_t>(kept)] = s.groups[i];
    number[i] = kept++;
  }
  s.groups.resize(static_cast<std::size_t>(kept));
  for (Index& home : s.group)
    if (home >= 0) home = number[static_cast<std::size_t>(home)];
}

// Wakes the groups that no longer sleep.
void wake_marked(const Model& model, Sleepers& s, std::vector<GeomPair>& touching) {
  const auto wakes = [&](Index body) {
    const Index home = s.group[static_cast<std::size_t>(body)];
    return home >= 0 && !s.groups[static_cast<std::size_t>(home)].sleeps;
  };
  std::erase_if(s.carried, [&](const CarriedContact& c) { return wakes(model.geom(c.geom_a).body); });
  std::erase_if(s.contacts, [&](const Contact& c) {
    const bool awake = wakes(c.body_a);
    if (awake && has_impulse(c)) touching.push_back({c.body_a, c.body_b, c.geom_a, c.geom_b});
    return awake;
  });
  std::erase_if(s.efforts, [&](const Sleepers::Known& e) { return wakes(e.body); });
  std::erase_if(s.rows, [&](const Sleepers::Known& row) { return wakes(row.body); });
  std::erase_if(s.pushes, [&](const Sleepers::Push& push) { return wakes(push.body); });
  for (std::size_t i = 0; i < s.group.size(); ++i)
    if (wakes(static_cast<Index>(i))) s.group[i] = -1;
  count(model, s);
}

// Keeps islands awake of which a joint changed, hangs on a driven body that moves, or also holds a body of
// another island: a rope that is slack joins two of them without a row.
template <class Moves, class Keep>
void keep_with_joints(const StepAtRest& in, Moves&& moves, Keep&& keep) {
  const Model& model = in.step.model;
  const std::vector<Index>& home = in.problem.graph.islands.of_body;
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    const Index a = joint.body_a, b = joint.body_b;
    const bool both = a >= 0 && b >= 0 && model.is_dynamic(a) && model.is_dynamic(b);
    if ((!both || home[a] == home[b]) && !moves(a) && !moves(b) && same_joints(model, in.before, in.after, j))
      continue;
    keep(a);
    keep(b);
  }
  for_each_pushed(in.step.tree, in.before, in.after, keep);
}

// The islands of a step that may fall asleep, by their number.
//
// A contact that a look ahead added is not found by the first search of the next step, so that its island is
// not left out. The slip of a contact at rest is that of a moving surface, and it is compared with a limit
// that depends on the fastest body of the scene. A contact that turns ahead takes its turn from the
// velocities of the start, which no comparison sees.
std::vector<unsigned char> find_tired(const StepAtRest& in, const std::vector<Contact>& contacts) {
  const Islands& graph = in.problem.graph.islands;
  std::vector<unsigned char> tired(graph.count, 0);
  for (std::size_t i = 0; i < tired.size(); ++i) tired[i] = in.islands.each[i].rests;
  const auto keep = [&](Index body) {
    if (body < 0) return;
    if (const Index home = graph.of_body[static_cast<std::size_t>(body)]; home >= 0) tired[home] = 0;
  };
  const auto turns = [&](std::size_t k) { return !in.posed.turns.empty() && !(in.posed.turns[k] == Vec3{}); };
  const auto moves = [&](Index body) {
    return body >= 0 && !in.step.model.is_dynamic(body) &&
           !same_bodies(in.before, in.after, static_cast<std::size_t>(body), 1);
  };
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const Contact& c = contacts[k];
    if (k >= in.found || !(c.slip == Vec3{}) || turns(k) || moves(c.body_b)) tired[graph.of_block[k]] = 0;
  }
  if (std::none_of(tired.begin(), tired.end(), [](unsigned char t) { return t; })) return {};
  for_each_changed(in.before, in.after, [&](std::size_t i) { keep(static_cast<Index>(i)); });
  for_each_changed(in.step.model, in.before.contacts, in.after.contacts, keep);
  const std::vector<unsigned char> linked = find_linked(in.step.model);
  for (std::size_t i = 0; i < linked.size(); ++i)
    if (linked[i]) keep(static_cast<Index>(i));
  keep_with_joints(in, moves, keep);
  return tired;
}

// An island needs more of its last step than its contacts. Rows are identified by their tags, so that the
// state gets their impulses without them. Efforts along joints have no rows in any step. The impulses on
// bodies of trees are those of contacts and rows together, in the order in which the problem sums them.
//
// Appends the impulses along the joints of the groups from number `first` on.
void take_impulses(const StepAtRest& in, Index first, Sleepers& s) {
  const ModelDescription& d = in.step.model.description();
  const JointRows& rows = in.posed.rows;
  const auto falls = [&](Index body) { return s.contains(body) && s.group[body] >= first; };
  for (const KnownImpulse& e : rows.efforts) {
    const Index j =
        e.tag.kind == RowKind::actuator ? d.actuators[e.tag.joint].transmission.joint : e.tag.joint;
    if (j < 0) continue;
    for (const Index body : {d.joints[j].body_a, d.joints[j].body_b}) {
      if (!falls(body)) continue;
      s.efforts.push_back({body, e});
      break;
    }
  }
  // Rows of joints come last.
  const std::size_t before = in.problem.rows() - rows.tags.size();
  for (std::size_t i = 0; i < rows.tags.size(); ++i) {
    const JacobianRow& row = rows.jacobian[i];
    const auto bodies = static_cast<Index>(s.group.size());
    if (row.body_a >= bodies || row.body_b >= bodies) continue;
    if (falls(row.body_a) || falls(row.body_b))
      s.rows.push_back({falls(row.body_a) ? row.body_a : row.body_b, {rows.tags[i], in.x[before + i]}});
  }
  if (!in.step.tree.moves()) return;
  const std::span<const double> w = impulses_on_bodies(in.problem, in.x);
  for (std::size_t i = 0; i < s.group.size(); ++i) {
    if (s.group[i] < first || !in.step.tree.moves(i)) continue;
    Sleepers::Push& push = s.pushes.emplace_back();
    push.body = static_cast<Index>(i);
    std::copy_n(w.begin() + static_cast<std::ptrdiff_t>(6 * i), 6, push.impulse.begin());
  }
}

}  // namespace

std::size_t fall_asleep(const StepAtRest& in, std::vector<Contact>& contacts, Sleepers& s) {
  if (!in.islands.any_rests || in.islands.slow) return in.found;
  const std::vector<unsigned char> tired = find_tired(in, contacts);
  if (std::none_of(tired.begin(), tired.end(), [](unsigned char t) { return t; })) return in.found;
  const Model& model = in.step.model;
  const Islands& graph = in.problem.graph.islands;
  s.group.resize(model.bodies(), -1);
  const auto first = static_cast<Index>(s.groups.size());
  for (std::size_t i = 0; i < tired.size(); ++i)
    s.groups.push_back({in.islands.each[i].start, tired[i] != 0});
  for (std::size_t i = 0; i < model.bodies(); ++i)
    if (const Index home = graph.of_body[i]; home >= 0 && tired[home]) s.group[i] = first + home;
  s.closing = in.posed.assembly.closing;
  s.slack = in.posed.assembly.slack;
  std::size_t kept = 0, found = 0;
  const auto slept = static_cast<std::ptrdiff_t>(s.contacts.size());
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (tired[graph.of_block[k]]) {
      s.contacts.push_back(contacts[k]);
    } else {
      found += k < in.found;
      contacts[kept++] = contacts[k];
    }
  }
  contacts.resize(kept);
  // Those that slept already are sorted.
  std::stable_sort(s.contacts.begin() + slept, s.contacts.end(), is_before);
  std::inplace_merge(s.contacts.begin(), s.contacts.begin() + slept, s.contacts.end(), is_before);
  s.carried.clear();
  for (const CarriedContact& c : in.after.contacts)
    if (s.contains(model.geom(c.geom_a).body)) s.carried.push_back(c);
  take_impulses(in, first, s);
  count(model, s);
  return found;
}

void find_changed(const State& before, const State& now, std::vector<Index>& changed) {
  changed.clear();
  for_each_changed(before, now, [&](std::size_t i) { changed.push_back(static_cast<Index>(i)); });
}

void wake_changed(const Tree& tree, const State& before, const State& now, std::span<const Index> changed,
                  Sleepers& s, std::vector<GeomPair>& touching) {
  const Model& model = tree.model();
  bool any = false, all = false;
  const auto wake_one = [&](Index body) {
    if (!s.contains(body)) return;
    s.groups[static_cast<std::size_t>(s.group[static_cast<std::size_t>(body)])].sleeps = false;
    any = true;
  };
  for (const Index i : s.visited_bodies) s.stays[i] = s.stays[i] != 0 || !model.is_dynamic(i);
  for (const Index i : changed) {
    wake_one(i);
    s.stays[static_cast<std::size_t>(i)] = 0;
    all = all || s.bears[static_cast<std::size_t>(i)];
  }
  for (std::size_t j = 0; j < s.joints.size(); ++j) {
    if (!s.joints[j] || same_joints(model, before, now, j)) continue;
    wake_one(model.joint(static_cast<Index>(j)).body_a);
    wake_one(model.joint(static_cast<Index>(j)).body_b);
  }
  for_each_pushed(tree, before, now, wake_one);
  // Those of bodies awake are in the state alone.
  for_each_changed(model, s.carried, now.contacts, wake_one);
  if (all) return wake_all(s, touching);
  if (any) wake_marked(model, s, touching);
}

void wake(const Model& model, std::span<const Index> bodies, Sleepers& s, std::vector<GeomPair>& touching) {
  for (const Index body : bodies)
    s.groups[static_cast<std::size_t>(s.group[static_cast<std::size_t>(body)])].sleeps = false;
  wake_marked(model, s, touching);
}

void wake_all(Sleepers& s, std::vector<GeomPair>& touching) {
  for (const Contact& c : s.contacts)
    if (has_impulse(c)) touching.push_back({c.body_a, c.body_b, c.geom_a, c.geom_b});
  s = {};
}

void stop_asleep(const Sleepers& s, const Subset& visited, BodyVelocities& v) {
  visited.each(s.group.size(), [&](std::size_t i) {
    if (s.group[i] >= 0) v[i] = {};
  });
}

void carry_asleep(const Sleepers& s, std::vector<CarriedContact>& carried) {
  if (s.carried.empty()) return;
  static thread_local std::vector<CarriedContact> awake;
  awake = carried;
  carried.clear();
  auto from = s.carried.begin();
  for (const CarriedContact& c : awake) {
    const auto next = std::lower_bound(from, s.carried.end(), c, carried_before);
    carried.insert(carried.end(), from, next);
    carried.push_back(c);
    from = next;
  }
  carried.insert(carried.end(), from, s.carried.end());
}

void know_asleep(const Sleepers& s, JointRows& rows) {
  for (const auto* known : {&s.efforts, &s.rows})
    for (const Sleepers::Known& k : *known) rows.efforts.push_back(k.impulse);
}

void push_asleep(const Sleepers& s, std::span<double> w) {
  for (const Sleepers::Push& push : s.pushes)
    for (std::size_t k = 0; k < 6; ++k) w[6 * static_cast<std::size_t>(push.body) + k] += push.impulse[k];
}

void join_contacts(const std::vector<Contact>& awake, std::size_t found, const Sleepers& s,
                   std::vector<Contact>& all) {
  const auto later = awake.begin() + static_cast<std::ptrdiff_t>(found);
  all.resize(awake.size() + s.contacts.size());
  const auto end =
      std::merge(awake.begin(), later, s.contacts.begin(), s.contacts.end(), all.begin(), is_before);
  std::copy(later, awake.end(), end);
}

}  // namespace amontons
