// Geometric stiffness of joint forces, implicitly: docs/algorithm.md (29).
//
// A force F that a joint exerts on a body at the arm r from its centre of mass has the torque r x F. When the
// body turns by a small angle d, r turns with it and the torque changes by (d x r) x F = -K d, K = (r.F) 1 -
// r F' (Tournier, Nesme, Gilles, Faure, "Stable constrained dynamics", SIGGRAPH 2015). A light link under the
// tension of a heavy load is such a rotational spring. Its frequency sqrt(K / I) may be far above 1 / h. A
// step that takes the arms from its start is then unstable although every constraint is satisfied.
//
// Implicit Euler for that torque, with F from the last step, is (I + h^2 K) w+ = I w + h torque + ...: the
// effective inertia changes, and the spin w is damped. The inertia alone suffices for stability, and keeps
// the energy of swinging mechanisms (make_free_velocities has both). Only the part of the symmetric h^2 K
// that exceeds I is added (eigenvalues of the pencil above 1; symplectic Euler is stable up to 4). Mechanisms
// that the step resolves thus keep their inertia exactly.
#include "multibody/joints/stiffening.hpp"

#include <Eigen/Dense>

namespace amontons {

namespace {

// K of one force, symmetrised.
Mat3 stiffness(const Vec3& r, const Vec3& F) {
  const double rF = dot(r, F);
  Mat3 K = Mat3::diagonal(rF, rF, rF);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) K(i, j) -= 0.5 * (r[i] * F[j] + F[i] * r[j]);
  return K;
}

Eigen::Matrix3d to_eigen(const Mat3& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&m.row[0].x);
}

double frobenius_squared(const Mat3& m) {
  return norm_squared(m.row[0]) + norm_squared(m.row[1]) + norm_squared(m.row[2]);
}

// The inverse of max(I, S) in the sense of the pencil (S, I). With I = L L' and L^-1 S L^-T = Q diag(s) Q'
// that is max(I, S) = L Q diag(max(1, s)) Q' L'. S becomes what I gains. False if no s exceeds 1.
bool stiffen(const Mat3& inertia, Mat3& S, Mat3& inverse_inertia) {
  const Eigen::Matrix3d L = to_eigen(inertia).llt().matrixL();
  const Eigen::Matrix3d inner =
      L.triangularView<Eigen::Lower>().solve(L.triangularView<Eigen::Lower>().solve(to_eigen(S)).transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> pencil(0.5 * (inner + inner.transpose()));
  const Eigen::Vector3d more = (pencil.eigenvalues().array() - 1.0).cwiseMax(0.0).matrix();
  const Eigen::Matrix3d F = L * pencil.eigenvectors(), added = F * more.asDiagonal() * F.transpose();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) S(i, j) = 0.5 * (added(i, j) + added(j, i));
  if (!(more.maxCoeff() > 0)) return false;
  const Eigen::Matrix3d B = L.transpose().triangularView<Eigen::Upper>().solve(pencil.eigenvectors());
  const Eigen::Vector3d weights = pencil.eigenvalues().cwiseMax(1.0).cwiseInverse();
  const Eigen::Matrix3d sum = B * weights.asDiagonal() * B.transpose();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) inverse_inertia(i, j) = 0.5 * (sum(i, j) + sum(j, i));
  return true;
}

}  // namespace

// K of a body is the sum over its joints, with the force of each in the last step: F on A, -F on B, at the
// origin of frame_a. Contact forces are left out: they do not turn with a body. Compressive forces have
// negative K and are no stiff springs; eigenvalues below 1 are not changed.
void stiffen_rotations(const Model& model, const State& state, double square, const BodyFrames& frames,
                       const JointContexts& joints, Stiffened& stiffened) {
  auto& [mobility, added, any] = stiffened;
  any = false;
  if (state.impulse_step <= 0 || model.joints() == 0) return;
  added.assign(frames.size(), Mat3{});
  const auto add = [&](Index body, const Vec3& point, const Vec3& F) {
    if (model.is_dynamic(body)) added[body] = added[body] + stiffness(point - frames[body].centre, F);
  };
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Joint& joint = *joints[j].joint;
    const JointPose& pose = joints[j].pose;
    const Vec3 F = rotate(pose.b.rotation, state.joint_wrenches[j].force) / state.impulse_step;
    add(joint.body_a, pose.a.position, F);
    add(joint.body_b, pose.a.position, -F);
  }
  // The forces are those of the last step. A force within a single step is no spring.
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Mat3& S = added[i];
    S = square * S;
    // No eigenvalue exceeds |S| |I^-1| in Frobenius' norm; this test makes other bodies cheap.
    const bool maybe = frobenius_squared(S) * frobenius_squared(mobility[i].inverse_inertia) > 1;
    if (!maybe) S = Mat3{};
    if (!maybe || !stiffen(frames[i].inertia, S, mobility[i].inverse_inertia)) continue;
    mobility[i].stiffened = true;
    any = true;
  }
}

}  // namespace amontons
