// Chunks, batches and lines: see contact_layout.hpp and pass_data.hpp.
#include "solvers/first_order/contact_layout.hpp"

#include <algorithm>
#include <bit>

#include "solvers/first_order/link_order.hpp"

namespace amontons {

namespace {

// A chunk of 2048 contacts holds 256 batches. Its passes read and write some 0.4 MB in ten microseconds,
// which is long beside the hand-over to a thread. More than 64 chunks only add copies of the bodies at their
// borders.
constexpr std::size_t contacts_per_chunk = 2048, max_chunks = 64;

using Link = ContactGraph::Link;

// Greedy filling of conflict-free batches. Up to 32 batches are open at a time, in a ring. A contact goes to
// the oldest one with room that contains neither of its bodies. present[body] has one bit per place in the
// ring, so that the batches without both bodies are one expression,
//  open & ~(present[a] | present[b]),
// and the oldest is its lowest bit counted from the place of the oldest batch. The number 32 is that of the
// bits of a word: about 256 contacts, a stretch of the curve that contains all contacts of a body.
//
// A batch that leaves the ring with free lanes keeps them inert (-1).
class Batcher {
 public:
  Batcher(const std::vector<Link>& links, const std::vector<bool>& is_hub, std::vector<Index>& lanes_out)
      : links_(links), is_hub_(is_hub), out_(lanes_out), present_(is_hub.size()) {}

  void add(std::uint32_t contact) {
    std::uint32_t usable = open_ & ~(present(links_[contact].a) | present(links_[contact].b));
    if (!usable) usable = open_batch();
    const int oldest = static_cast<int>(oldest_ % 32);
    // Rotated so that bit 0 is the oldest batch.
    const auto place =
        static_cast<std::uint32_t>((oldest + std::countr_zero(std::rotr(usable, oldest))) % 32);
    mark(links_[contact].a, place);
    mark(links_[contact].b, place);
    // From the place to the number of the batch: the first number from the oldest on that is congruent to it.
    const std::size_t batch = oldest_ + ((place - oldest_) % 32);
    out_[batch * lanes + fill_[place]] = static_cast<Index>(contact);
    if (++fill_[place] == lanes) open_ &= ~(1u << place);
  }

  void finish() {
    while (oldest_ < next_) close_oldest();
  }

 private:
  std::uint32_t present(Index body) const { return body < 0 ? 0 : present_[body]; }
  // Hubs are never marked: with a line per lane they have no conflicts.
  void mark(Index body, std::uint32_t place) {
    if (body >= 0 && !is_hub_[body]) present_[body] |= 1u << place;
  }
  std::uint32_t open_batch() {
    if (next_ - oldest_ == 32) close_oldest();
    const std::uint32_t place = next_++ % 32;
    fill_[place] = 0;
    out_.resize(next_ * lanes, -1);
    open_ |= 1u << place;
    return 1u << place;
  }
  // Makes room in the ring and clears the bits of the batch's bodies, as its place will mean another batch.
  void close_oldest() {
    const std::uint32_t bit = 1u << (oldest_ % 32);
    for (std::size_t l = 0; l < lanes; ++l) {
      const Index contact = out_[oldest_ * lanes + l];
      if (contact < 0) continue;
      for (Index body : {links_[contact].a, links_[contact].b})
        if (body >= 0) present_[body] &= ~bit;
    }
    open_ &= ~bit;
    ++oldest_;
  }

  const std::vector<Link>& links_;
  const std::vector<bool>& is_hub_;
  std::vector<Index>& out_;
  std::vector<std::uint32_t> present_;
  // oldest_, next_: batches oldest_ .. next_ - 1 are in the ring, at their number modulo 32. fill_: lanes
  // taken, by place. open_: the places with room.
  std::size_t oldest_ = 0, next_ = 0, fill_[32] = {};
  std::uint32_t open_ = 0;
};

// Numbers lines in the order in which a chunk first touches its bodies: neighbours in time are neighbours in
// memory. A chunk begins with a dummy line, for the world and fixed bodies. Lanes and rows without a body
// read and write it like any other. Its inverse mass is 0, so any sum there becomes velocity 0.
class LineNumbering {
 public:
  LineNumbering(std::vector<Index>& body, const std::vector<bool>& is_hub)
      : body_(body), is_hub_(is_hub), line_(is_hub.size(), none) {}

  void begin_chunk() {
    first_ = body_.size();
    hub_lines_.clear();
    body_.push_back(-1);  // the dummy
  }
  std::uint32_t line(Index body, std::size_t lane) {
    if (body < 0) return static_cast<std::uint32_t>(first_);
    if (is_hub_[body]) return hub_line(body, lane);
    // A number from an earlier chunk is less than first_.
    if (line_[body] == none || line_[body] < first_) line_[body] = append(body);
    return line_[body];
  }
  // A mass batch has eight lines; empty lines pad the last one of a chunk.
  void end_chunk() { body_.resize((body_.size() + lanes - 1) / lanes * lanes, -1); }

 private:
  static constexpr std::uint32_t none = UINT32_MAX;
  std::uint32_t append(Index body) {
    body_.push_back(body);
    return static_cast<std::uint32_t>(body_.size() - 1);
  }
  // A hub has up to eight lines in a chunk, one per lane, so that no two lanes of a batch add to the same
  // line.
  std::uint32_t hub_line(Index body, std::size_t lane) {
    if (line_[body] == none || line_[body] < first_) {
      line_[body] = static_cast<std::uint32_t>(first_ + hub_lines_.size() / lanes);
      hub_lines_.resize(hub_lines_.size() + lanes, none);
    }
    std::uint32_t& line = hub_lines_[(line_[body] - first_) * lanes + lane];
    if (line == none) line = append(body);
    return line;
  }

  std::vector<Index>& body_;
  const std::vector<bool>& is_hub_;
  std::vector<std::uint32_t> line_;  // for a hub: first_ + its index among the hubs of the chunk
  std::vector<std::uint32_t> hub_lines_;
  std::size_t first_ = 0;
};

// Ranks at which chunks begin. Each chunk has about the same work; a joint row counts half a contact. The
// cuts lie between ranks, so that sorted contacts of one body stay in one chunk.
std::vector<std::size_t> chunk_ranks(const Sorted& contacts, const Sorted& joints) {
  const std::size_t ranks = contacts.start.size() - 1;
  // In units of half a contact.
  const std::size_t work = 2 * contacts.index.size() + joints.index.size();
  const std::size_t count = std::clamp<std::size_t>(work / (2 * contacts_per_chunk), 1, max_chunks);
  std::vector<std::size_t> first{0};
  for (std::size_t r = 0; r < ranks && first.size() < count; ++r)
    // Chunk i begins where the fraction i / count of the work is done.
    if ((2 * contacts.start[r] + joints.start[r]) * count >= first.size() * work && r > first.back())
      first.push_back(r);
  first.push_back(ranks);
  return first;
}

// Lines of each body that has several, in ascending order, the order of their addition. `place` is 0 for a
// body not yet seen, else one more than the place of its next copy.
void find_copies(ContactLayout& layout, std::size_t bodies) {
  std::vector<std::uint32_t> count(bodies), place(bodies);
  for (Index body : layout.body)
    if (body >= 0) ++count[body];
  layout.first_copy.push_back(0);
  for (std::size_t line = 0; line < layout.body.size(); ++line) {
    const Index body = layout.body[line];
    if (body < 0 || count[body] < 2) continue;
    if (place[body] == 0) {
      place[body] = layout.first_copy.back() + 1;
      layout.first_copy.push_back(layout.first_copy.back() + count[body]);
      layout.copies.resize(layout.first_copy.back());
    }
    layout.copies[place[body]++ - 1] = static_cast<std::uint32_t>(line);
  }
}

}  // namespace

// Orders bodies, sorts contacts and rows by them and cuts into chunks. Then, per chunk, fills batches, and
// numbers lines as the batches first touch them, followed by those of the joint rows.
ContactLayout lay_out(const ContactSystem& A, const ContactGraph& graph, std::size_t contacts) {
  const std::size_t bodies = A.bodies.size();
  const std::vector<Link>& links = graph.links;  // contacts, then single rows
  const std::vector<bool> is_hub = find_hubs(bodies, links, contacts);
  ThreadPool alone(1);
  const BodyOrder order = order_bodies(A, graph, is_hub, alone);
  const std::size_t ranks = order.moving.size() + 1;  // the last rank is for links without a moving body
  // A common rank for contacts and rows, by which both are sorted and cut into chunks.
  std::vector<std::uint32_t> rank(links.size());
  for (std::size_t k = 0; k < links.size(); ++k) rank[k] = sort_rank(links[k], order, is_hub);
  const Sorted by_contact = sort_by_rank(rank, 0, contacts, ranks);
  const Sorted by_joint = sort_by_rank(rank, contacts, links.size(), ranks);
  const std::vector<std::size_t> first_rank = chunk_ranks(by_contact, by_joint);

  ContactLayout out;
  out.contact.reserve(contacts + contacts / 8 + 64);
  Batcher batcher(links, is_hub, out.contact);
  LineNumbering lines(out.body, is_hub);
  for (std::size_t c = 0; c + 1 < first_rank.size(); ++c) {
    Chunk chunk{};
    chunk.first_batch = out.batches();
    for (std::size_t k = by_contact.start[first_rank[c]]; k < by_contact.start[first_rank[c + 1]]; ++k)
      batcher.add(by_contact.index[k]);
    batcher.finish();
    chunk.last_batch = out.batches();

    chunk.first_line = out.body.size();
    lines.begin_chunk();
    // Lanes in the order of the passes: the first use of a body gives it a line.
    for (std::size_t at = chunk.first_batch * lanes; at < chunk.last_batch * lanes; ++at) {
      const Link link = out.contact[at] < 0 ? Link{-1, -1} : links[out.contact[at]];
      out.line_a.push_back(lines.line(link.a, at % lanes));
      out.line_b.push_back(lines.line(link.b, at % lanes));
    }
    chunk.first_joint = out.joint_batches();
    for (std::size_t k = by_joint.start[first_rank[c]]; k < by_joint.start[first_rank[c + 1]]; ++k) {
      // Joint rows access their bodies one at a time; for a hub they use the line of lane 0.
      const std::uint32_t row = by_joint.index[k];
      out.joint_row.push_back(static_cast<Index>(row - contacts));
      out.joint_line_a.push_back(lines.line(links[row].a, 0));
      out.joint_line_b.push_back(lines.line(links[row].b, 0));
    }
    while (out.joint_row.size() % lanes != 0) {
      out.joint_row.push_back(-1);
      out.joint_line_a.push_back(lines.line(-1, 0));
      out.joint_line_b.push_back(lines.line(-1, 0));
    }
    chunk.last_joint = out.joint_batches();
    lines.end_chunk();
    chunk.last_line = out.body.size();
    out.chunks.push_back(chunk);
  }
  find_copies(out, bodies);
  return out;
}

}  // namespace amontons
