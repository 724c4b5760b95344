#pragma once
#include "multibody/joints/wide_rows.hpp"

// The course of a spatial tendon: straight parts, arcs on obstacles, and the places where it rubs.
namespace amontons {

// A place at which a tendon rubs on a body, between two parts of it.
struct Rub {
  Index body = world;
  double grip = 0;  // friction coefficient times the angle by which the tendon turns there
};

// A tendon as the parts between its rubs: one more than rubs. A belt has one rub and two parts. A part ends
// at points of the bodies that it meets: the rate of its length is that of rope which does not slip there.
struct TendonCourse {
  std::vector<Line> parts;
  std::vector<Rub> rubs;
};
TendonCourse course_of(const Model& model, const BodyFrames& bodies, const Tendon& tendon);

// The number of rubs of a tendon. It does not depend on the pose: a rope that passes clear of a pulley keeps
// its rub, without grip. So the state has a fixed place for the impulses of each.
std::size_t rubs_of(const Tendon& tendon);

}  // namespace amontons
