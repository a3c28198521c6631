#include "bundle/point_terms.h"

#include <Eigen/LU>

namespace skein {
namespace {

void SubtractFromPose(const PointTerms& point, int i, ExplicitSystem* system) {
  const ObservationTerm& a = point.terms[i];
  const Eigen::Matrix<double, 6, 3> Y = a.W * point.V_inverse;
  system->SubtractBlock(a.pose_row, a.pose_row, Y * a.W.transpose());
  for (int j = i + 1; j < point.size; ++j) {
    const ObservationTerm& b = point.terms[j];
    if (b.pose_row < 0) continue;
    if (a.pose_row < b.pose_row) {
      system->SubtractBlock(a.pose_row, b.pose_row, Y * b.W.transpose());
    } else if (a.pose_row == b.pose_row) {  // the point twice in one image
      const Eigen::Matrix<double, 6, 6> twice = Y * b.W.transpose();
      system->SubtractBlock(a.pose_row, a.pose_row, twice + twice.transpose());
    } else {
      system->SubtractBlock(b.pose_row, a.pose_row, b.W * Y.transpose());
    }
  }
  for (const Coupling& c : point.couplings) {
    system->SubtractBlock(a.pose_row, c.row, Y * c.W.topRows(c.size).transpose());
  }
}

void SubtractFromCameras(const PointTerms& point, ExplicitSystem* system) {
  for (const Coupling& a : point.couplings) {
    const Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxIntrinsics, 3> Y =
        a.W.topRows(a.size) * point.V_inverse;
    for (const Coupling& b : point.couplings) {
      if (a.row <= b.row) system->SubtractBlock(a.row, b.row, Y * b.W.topRows(b.size).transpose());
    }
  }
}

void AddSchurGradient(const PointTerms& point, ReducedSystem* system) {
  const Eigen::Vector3d v = point.V_inverse * point.gradient;
  for (int i = 0; i < point.size; ++i) {
    const ObservationTerm& term = point.terms[i];
    if (term.pose_row < 0) continue;
    system->schur_gradient.segment<6>(term.pose_row).noalias() += term.W * v;
  }
  for (const Coupling& c : point.couplings) {
    system->schur_gradient.segment(c.row, c.size) += c.W.topRows(c.size) * v;
  }
}

}  // namespace

void PointTerms::Set(const Bundle& bundle, const BundleLayout& layout, const RobustLoss& loss,
                     const BundlePoint& point, double lambda, int from, int stride) {
  if (static_cast<int>(terms.size()) < point.count) terms.resize(point.count);
  size = 0;
  V.setZero();
  gradient.setZero();
  for (int i = point.first + from; i < point.first + point.count; i += stride) {
    ObservationTerm& term = terms[size];
    if (!Linearise(bundle, layout, loss, point, bundle.observations[i], &term)) continue;
    V.noalias() += term.J_point.transpose() * term.J_point;
    gradient.noalias() += term.J_point.transpose() * term.residual;
    ++size;
  }
  damping = lambda * V.diagonal().cwiseMax(kMinDiagonal);
  V.diagonal() += damping;
  V_inverse = V.inverse();
}

void PointTerms::SetCouplings() {
  couplings.clear();
  for (int i = 0; i < size; ++i) {
    const ObservationTerm& term = terms[i];
    if (term.camera_row < 0) continue;
    Coupling* coupling = nullptr;
    for (Coupling& c : couplings) coupling = c.row == term.camera_row ? &c : coupling;
    if (coupling == nullptr) {
      couplings.emplace_back(term.camera_row, term.camera_size);
      coupling = &couplings.back();
    }
    coupling->W.topRows(term.camera_size) +=
        term.J_camera.leftCols(term.camera_size).transpose() * term.J_point;
  }
}

void AddDirect(const PointTerms& point, ReducedSystem* system) {
  for (int i = 0; i < point.size; ++i) {
    const ObservationTerm& term = point.terms[i];
    if (term.pose_row >= 0) {
      system->AddBlock(term.pose_row, term.pose_row, term.J_pose.transpose() * term.J_pose);
      system->gradient.segment<6>(term.pose_row) += term.J_pose.transpose() * term.residual;
    }
    if (term.camera_row < 0) continue;
    const auto J = term.J_camera.leftCols(term.camera_size);
    system->AddBlock(term.camera_row, term.camera_row, J.transpose() * J);
    system->gradient.segment(term.camera_row, term.camera_size) += J.transpose() * term.residual;
    if (term.pose_row < 0) continue;
    system->AddBlock(term.pose_row, term.camera_row, term.J_pose.transpose() * J);
  }
}

void EliminatePoint(PointTerms* point, ExplicitSystem* system) {
  point->SetCouplings();
  AddSchurGradient(*point, system);
  for (int i = 0; i < point->size; ++i) {
    if (point->terms[i].pose_row >= 0) SubtractFromPose(*point, i, system);
  }
  SubtractFromCameras(*point, system);
}

void EliminatePoint(PointTerms* point, ImplicitSystem* system) {
  point->SetCouplings();
  AddSchurGradient(*point, system);
  for (int i = 0; i < point->size; ++i) {
    const ObservationTerm& term = point->terms[i];
    if (term.pose_row >= 0) system->KeepPose(term.pose_row, term.W);
  }
  for (const Coupling& c : point->couplings) system->KeepCamera(c);
  system->EndPoint(point->V_inverse);
}

}  // namespace skein
