#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "amontons/base/math.hpp"

namespace amontons {

// A contact point as the choice of few out of many sees it: where it is, its gap now and where the motion
// that is known would take that gap by the end of the step (m; equal where nothing is known).
struct SupportPoint {
  Vec3 point;
  double gap, end;
};

// Chooses, of the points of two bodies with about one normal, those that hold what all of them hold. A force
// at a point inside a polygon is a sum of forces at its corners, with the same direction, and the
// constraint gap >= 0 is linear over the plane across the normal: what matters are the corners of the support
// polygon and the points on which the bodies would stand after a small turn. Everything else follows from
// these, or cannot be reached before the body has moved on.
class SupportPoints {
 public:
  // Sets kept[i] to 1 for the points to keep, and leaves it alone for the others; kept has the size of
  // points. `tolerance` (m): what missing a point may let the bodies sink in. The choice depends on the
  // order of the points where they are alike within rounding, so that it does not flicker.
  void select(std::span<const SupportPoint> points, const Vec3& normal, double tolerance,
              std::span<unsigned char> kept);

 private:
  // Across the normal, with one of the two heights of the point.
  struct Site {
    double u, v, height;
    std::uint32_t point;
  };

  const Site& lowest(double tolerance, std::span<const unsigned char> kept) const;
  // The corners of the support polygon; the lowest point, and those that are lowest after small turns.
  void keep_outline(double tolerance, std::span<unsigned char> kept);
  void keep_under_turns(double height, std::span<unsigned char> kept) const;
  void make_outline();
  void simplify_outline();

  std::vector<Site> sites_, flat_, outline_;
  std::vector<double> losses_;  // by corner of the outline: twice the area that would go with it
};

}  // namespace amontons
