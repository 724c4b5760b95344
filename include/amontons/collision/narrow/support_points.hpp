#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "amontons/base/math.hpp"

namespace amontons {

// A contact point for the selection of few from many. It has a place, the gap now, and the predicted gap at
// the end of the step (m; equal if there is no prediction).
struct SupportPoint {
  Vec3 point;
  double gap, end;
};

// Selects those points of two bodies with about one normal that carry the same load as all of them. A force
// at a point inside a polygon is a sum of forces at its corners, with the same direction. The constraint gap
// >= 0 is linear in the plane across the normal. So the corners of the support polygon matter, and the points
// on which the bodies would stand after a small turn. The other points follow from these, or cannot be
// reached within the step.
class SupportPoints {
 public:
  // Sets kept[i] to 1 for the points to keep, and does not change the others; kept has the size of points.
  // `tolerance` (m): how deep the bodies may sink in because of an omitted point. Points that are equal
  // within rounding are chosen by their order, so that the choice does not flicker.
  void select(std::span<const SupportPoint> points, const Vec3& normal, double tolerance,
              std::span<unsigned char> kept);

 private:
  // A point in the plane across the normal, with one of its two heights.
  struct Site {
    double u, v, height;
    std::uint32_t point;
  };

  const Site& lowest(double tolerance, std::span<const unsigned char> kept) const;
  // Keeps the corners of the support polygon; the lowest point, and those that are lowest after small turns.
  void keep_outline(double tolerance, std::span<unsigned char> kept);
  void keep_under_turns(double height, std::span<unsigned char> kept);
  void make_outline();
  void simplify_outline();

  std::vector<Site> sites_, flat_, outline_;
  std::vector<Site> near_;      // places from the lowest point, of those that a turn may bring down
  std::vector<double> losses_;  // per corner of the outline: twice the area that its removal would cost
};

}  // namespace amontons
