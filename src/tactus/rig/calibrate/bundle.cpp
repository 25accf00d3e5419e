#include "tactus/rig/calibrate/bundle.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/at.h"
#include "tactus/base/error.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/rig/calibrate/board_pose.h"

#ifdef TACTUS_WITH_CERES
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>

#include "tactus/geom/camera/lens_maths.h"
#endif

namespace tactus {

std::string calibration_missing() {
#ifdef TACTUS_WITH_CERES
  return "";
#else
  return "cameras can't be calibrated: Tactus was built without Ceres (Debian: libceres-dev)";
#endif
}

#ifndef TACTUS_WITH_CERES
std::vector<CalibratedCamera> calibrate_lenses(const Board&, std::span<const BoardView>,
                                               std::span<const std::string>, std::span<const Vec2i>,
                                               const BundleOptions&) {
  throw Error(calibration_missing());
}
BundleResult calibrate_poses(const Board&, std::span<const BoardView>, std::span<const CalibratedCamera>,
                             const BundleOptions&) {
  throw Error(calibration_missing());
}
#else
namespace {

constexpr int kIntrinsics = 18;  ///< fx fy cx cy and 14 of the lens

/// Numbers that Ceres changes. Poses: vector of the rotation, translation.
struct State {
  std::vector<std::array<double, kIntrinsics> > intrinsics;
  std::vector<std::array<double, 6> > cameras;  ///< T_cam_first
  std::vector<std::array<double, 6> > boards;   ///< T_first_board, by instant
  std::vector<bool> has_board;
};

std::array<double, 6> packed(const Rigidd& T) {
  const Vec3d v = vector_of_rotation(T.R);
  return {v.x, v.y, v.z, T.t.x, T.t.y, T.t.z};
}
Rigidd unpacked(const std::array<double, 6>& p) {
  return {rotation_from_vector({p[0], p[1], p[2]}), {p[3], p[4], p[5]}};
}

/// Where a corner of the board is seen, less where it was seen.
struct CornerResidual {
  Vec3d corner_m;
  Vec2d px;
  LensModel lens;
  bool one_focal_length;
  template <class T>
  bool operator()(const T* K, const T* camera, const T* board, T* residual) const {
    const T corner[3] = {T(corner_m.x), T(corner_m.y), T(corner_m.z)};
    T world[3], p[3];
    ceres::AngleAxisRotatePoint(board, corner, world);
    for (int i = 0; i < 3; ++i) world[i] += board[3 + i];
    ceres::AngleAxisRotatePoint(camera, world, p);
    for (int i = 0; i < 3; ++i) p[i] += camera[3 + i];
    if (p[2] < 1e-9) return false;
    T x = p[0] / p[2], y = p[1] / p[2];
    if (lens == LensModel::brown) lens_maths::distort_brown(K + 4, x, y);
    if (lens == LensModel::fisheye) lens_maths::distort_fisheye(K + 4, x, y);
    if (lens == LensModel::omni) lens_maths::distort_omni(K + 4, x, y);
    if (lens == LensModel::eucm) lens_maths::distort_eucm(K + 4, x, y);
    if (lens == LensModel::double_sphere) lens_maths::distort_double_sphere(K + 4, x, y);
    residual[0] = K[0] * x + K[2] - px.x;
    residual[1] = (one_focal_length ? K[0] : K[1]) * y + K[3] - px.y;
    return true;
  }
};

/// Indices of the intrinsics that stay as they are.
std::vector<int> constant_intrinsics(LensModel lens, const BundleOptions& options) {
  std::vector<int> constant;
  if (options.fix_aspect) constant.push_back(1);
  const int free =
      lens == LensModel::brown ? options.lens_coefficients : (lens == LensModel::fisheye ? 4 : 0);
  for (int i = 0; i < 14; ++i) {
    if (i >= std::min(free, 8)) constant.push_back(4 + i);
  }
  return constant;
}

class Bundle {
 public:
  Bundle(const Board& board, std::span<const BoardView> views, std::span<const CalibratedCamera> cameras,
         const BundleOptions& options)
      : board_(board),
        views_(views),
        cameras_(cameras.begin(), cameras.end()),
        options_(options),
        used_(views.size(), true) {
    Index instants = 0;
    for (const BoardView& v : views) instants = std::max(instants, v.instant + 1);
    for (const CalibratedCamera& c : cameras_) {
      state_.intrinsics.push_back({c.camera.fx_px, c.camera.fy_px, c.camera.cx_px, c.camera.cy_px});
      std::copy(c.lens.k.begin(), c.lens.k.end(), state_.intrinsics.back().begin() + 4);
      seen_.push_back(false);
    }
    state_.boards.resize(static_cast<std::size_t>(instants));
    state_.has_board.resize(static_cast<std::size_t>(instants));
    place();
  }

  BundleResult run() {
    solve(0);
    if (options_.loss_px > 0) solve(options_.loss_px);
    if (options_.outlier_factor > 0 && leave_out()) solve(options_.loss_px);
    return result();
  }

 private:
  /// First guesses of cameras and boards from single views.
  void place() {
    std::vector<std::optional<Rigidd> > poses;
    for (const BoardView& v : views_) poses.push_back(board_pose(board_, v, cameras_.at(at(v.camera))));
    for (const Rigidd& T : first_poses(views_, poses, cameras_)) state_.cameras.push_back(packed(T));
    std::vector<std::size_t> most(state_.boards.size());
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const std::size_t instant = at(views_[i].instant);
      if (!poses[i] || views_[i].corners.size() <= most[instant]) continue;
      most[instant] = views_[i].corners.size();
      state_.boards[instant] = packed(inverse(unpacked(state_.cameras[at(views_[i].camera)])) * *poses[i]);
      state_.has_board[instant] = true;
    }
    for (std::size_t i = 0; i < views_.size(); ++i) used_[i] = state_.has_board[at(views_[i].instant)];
  }

  void solve(double loss_px) {
    ceres::Problem problem;
    build(problem, loss_px);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (std::size_t i = 0; i < state_.boards.size(); ++i) {
      if (problem.HasParameterBlock(state_.boards[i].data()))
        ordering->AddElementToGroup(state_.boards[i].data(), 0);
    }
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      for (double* block : {state_.intrinsics[c].data(), state_.cameras[c].data()}) {
        if (problem.HasParameterBlock(block)) ordering->AddElementToGroup(block, 1);
      }
    }
    options.linear_solver_ordering = ordering;
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-12;
    options.parameter_tolerance = 1e-12;
    options.num_threads = 2;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) throw Error("calibration: the solver failed: " + summary.message);
  }

  void build(ceres::Problem& problem, double loss_px) {
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (!used_[i]) continue;
      const BoardView& v = views_[i];
      const std::size_t c = at(v.camera);
      seen_[c] = true;
      for (const BoardCorner& corner : v.corners) {
        problem.AddResidualBlock(
            new ceres::AutoDiffCostFunction<CornerResidual, 2, kIntrinsics, 6, 6>(new CornerResidual{
                board_.corner_m(corner.id), corner.px, cameras_[c].lens.model, options_.fix_aspect}),
            loss_px > 0 ? new ceres::HuberLoss(loss_px) : nullptr, state_.intrinsics[c].data(),
            state_.cameras[c].data(), state_.boards[at(v.instant)].data());
      }
    }
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      if (!seen_[c]) continue;
      if (options_.refine_intrinsics) {
        problem.SetManifold(
            state_.intrinsics[c].data(),
            new ceres::SubsetManifold(kIntrinsics, constant_intrinsics(cameras_[c].lens.model, options_)));
      } else {
        problem.SetParameterBlockConstant(state_.intrinsics[c].data());
      }
    }
    problem.SetParameterBlockConstant(state_.cameras[0].data());
  }

  double view_square_sum(std::size_t i) const {
    const BoardView& v = views_[i];
    const std::size_t c = at(v.camera);
    double sum = 0;
    for (const BoardCorner& corner : v.corners) {
      double r[2];
      const CornerResidual residual{board_.corner_m(corner.id), corner.px, cameras_[c].lens.model,
                                    options_.fix_aspect};
      if (!residual(state_.intrinsics[c].data(), state_.cameras[c].data(),
                    state_.boards[at(v.instant)].data(), r))
        return 1e12;
      sum += r[0] * r[0] + r[1] * r[1];
    }
    return sum;
  }
  double view_rms_px(std::size_t i) const {
    return std::sqrt(view_square_sum(i) /
                     static_cast<double>(std::max<std::size_t>(1, views_[i].corners.size())));
  }

  /// Views that stand out among those of their camera. @returns whether there is any.
  bool leave_out() {
    bool any = false;
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      std::vector<double> all;
      for (std::size_t i = 0; i < views_.size(); ++i) {
        if (used_[i] && at(views_[i].camera) == c) all.push_back(view_rms_px(i));
      }
      if (all.size() < 5) continue;
      std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
      const double most = options_.outlier_factor * std::max(all[all.size() / 2], 0.05);
      for (std::size_t i = 0; i < views_.size(); ++i) {
        if (!used_[i] || at(views_[i].camera) != c || view_rms_px(i) <= most) continue;
        used_[i] = false;
        any = true;
      }
    }
    return any;
  }

  BundleResult result() {
    BundleResult out;
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      CalibratedCamera camera = cameras_[c];
      const auto& K = state_.intrinsics[c];
      camera.camera.fx_px = K[0];
      camera.camera.fy_px = options_.fix_aspect ? K[0] : K[1];
      camera.camera.cx_px = K[2];
      camera.camera.cy_px = K[3];
      std::copy(K.begin() + 4, K.end(), camera.lens.k.begin());
      camera.camera.T_cam_world = unpacked(state_.cameras[c]);
      out.cameras.push_back(camera);
    }
    for (std::size_t i = 0; i < state_.boards.size(); ++i)
      out.T_world_board.push_back(state_.has_board[i] ? std::optional(unpacked(state_.boards[i]))
                                                      : std::nullopt);
    add_residuals(out);
    add_covariance(out);
    return out;
  }

  void add_residuals(BundleResult& out) const {
    std::vector<double> sum(cameras_.size());
    std::vector<std::int64_t> count(cameras_.size());
    double all = 0;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const BoardView& v = views_[i];
      const bool placed = state_.has_board[at(v.instant)];
      out.views.push_back({v.camera, v.instant, static_cast<Index>(v.corners.size()),
                           placed ? view_rms_px(i) : 0, !used_[i]});
      if (!used_[i]) continue;
      sum[at(v.camera)] += view_square_sum(i);
      count[at(v.camera)] += std::ssize(v.corners);
    }
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      out.camera_rms_px.push_back(count[c] > 0 ? std::sqrt(sum[c] / static_cast<double>(count[c])) : 0);
      all += sum[c];
      out.corners += count[c];
    }
    out.rms_px = out.corners > 0 ? std::sqrt(all / static_cast<double>(out.corners)) : 0;
  }

  /// (J^T J)^-1 of the cameras with the boards eliminated, times the variance of the residuals.
  void add_covariance(BundleResult& out) {
    ceres::Problem problem;
    build(problem, options_.loss_px);
    ceres::Problem::EvaluateOptions evaluate;
    std::vector<int> intrinsics_begin(cameras_.size(), -1), pose_begin(cameras_.size(), -1);
    int n = 0;
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      if (!seen_[c]) continue;
      double *K = state_.intrinsics[c].data(), *pose = state_.cameras[c].data();
      if (!problem.IsParameterBlockConstant(K)) {
        evaluate.parameter_blocks.push_back(K);
        intrinsics_begin[c] = n;
        n += problem.ParameterBlockTangentSize(K);
      }
      if (!problem.IsParameterBlockConstant(pose)) {
        evaluate.parameter_blocks.push_back(pose);
        pose_begin[c] = n;
        n += 6;
      }
    }
    int boards = 0;
    for (auto& b : state_.boards) {
      if (!problem.HasParameterBlock(b.data())) continue;
      evaluate.parameter_blocks.push_back(b.data());
      ++boards;
    }
    std::vector<double> residuals;
    ceres::CRSMatrix J;
    problem.Evaluate(evaluate, nullptr, &residuals, nullptr, &J);
    const Eigen::MatrixXd S = reduced(J, n, boards);
    double sum = 0;
    for (const double r : residuals) sum += r * r;
    const double variance = sum / std::max(1.0, static_cast<double>(residuals.size()) - n - 6.0 * boards);
    // Turns: from differences of the vector to the small turn that follows R. Near half a turn they differ
    // much.
    Eigen::MatrixXd D = Eigen::MatrixXd::Identity(n, n);
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      if (pose_begin[c] >= 0) D.block<3, 3>(pose_begin[c], pose_begin[c]) = turn_by_vector(state_.cameras[c]);
    }
    const Eigen::MatrixXd covariance =
        D * (variance * S.ldlt().solve(Eigen::MatrixXd::Identity(n, n))) * D.transpose();
    out.camera_parameters = n;
    out.covariance.assign(covariance.data(), covariance.data() + covariance.size());
    for (std::size_t c = 0; c < cameras_.size(); ++c)
      out.deviations.push_back(deviations(covariance, c, intrinsics_begin[c], pose_begin[c]));
  }

  /// d with R(v + dv) = R(d dv) R(v), by first differences.
  static Eigen::Matrix3d turn_by_vector(const std::array<double, 6>& pose) {
    const Mat3d R = unpacked(pose).R;
    Eigen::Matrix3d by;
    for (int k = 0; k < 3; ++k) {
      std::array<double, 6> p = pose;
      p[static_cast<std::size_t>(k)] += 1e-6;
      const Vec3d turn = 1e6 * vector_of_rotation(unpacked(p).R * transpose(R));
      for (int i = 0; i < 3; ++i) by(i, k) = turn[i];
    }
    return by;
  }

  /// Schur complement of J^T J on the first n columns; the others are independent blocks of 6.
  static Eigen::MatrixXd reduced(const ceres::CRSMatrix& J, int n, int boards) {
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n);
    std::vector<Eigen::MatrixXd> B(static_cast<std::size_t>(boards), Eigen::MatrixXd::Zero(n, 6));
    std::vector<Eigen::Matrix<double, 6, 6> > C(static_cast<std::size_t>(boards),
                                                Eigen::Matrix<double, 6, 6>::Zero());
    for (int row = 0; row < J.num_rows; ++row) {
      const int begin = J.rows[static_cast<std::size_t>(row)],
                end = J.rows[static_cast<std::size_t>(row) + 1];
      for (int p = begin; p < end; ++p) {
        for (int q = begin; q < end; ++q) {
          const int i = J.cols[static_cast<std::size_t>(p)], j = J.cols[static_cast<std::size_t>(q)];
          const double value = J.values[static_cast<std::size_t>(p)] * J.values[static_cast<std::size_t>(q)];
          if (i < n && j < n) S(i, j) += value;
          if (j < n) continue;
          const auto b = static_cast<std::size_t>((j - n) / 6);
          if (i < n) {
            B[b](i, (j - n) % 6) += value;
          } else {
            C[b]((i - n) % 6, (j - n) % 6) += value;
          }
        }
      }
    }
    for (std::size_t b = 0; b < C.size(); ++b) S -= B[b] * C[b].ldlt().solve(B[b].transpose());
    return S;
  }

  CameraDeviations deviations(const Eigen::MatrixXd& covariance, std::size_t c, int intrinsics,
                              int pose) const {
    CameraDeviations d;
    const auto root = [&](int i) { return std::sqrt(std::max(0.0, covariance(i, i))); };
    if (intrinsics >= 0) {
      std::vector<double> all(kIntrinsics);
      const std::vector<int> constant = constant_intrinsics(cameras_[c].lens.model, options_);
      int at_free = intrinsics;
      for (int i = 0; i < kIntrinsics; ++i) {
        if (std::find(constant.begin(), constant.end(), i) != constant.end()) continue;
        all[static_cast<std::size_t>(i)] = root(at_free++);
        if (i >= 4) d.lens.push_back(all[static_cast<std::size_t>(i)]);
      }
      d.fx_px = all[0];
      d.fy_px = options_.fix_aspect ? all[0] : all[1];
      d.cx_px = all[2];
      d.cy_px = all[3];
    }
    if (pose >= 0) {
      // The centre is -R^T t: its covariance follows from both by first differences.
      const Rigidd T = unpacked(state_.cameras[c]);
      Eigen::Matrix<double, 3, 6> D;
      for (int k = 0; k < 6; ++k) {
        Rigidd moved = T;
        Vec3d turn;
        (k < 3 ? turn[k] : moved.t[k - 3]) += 1e-7;
        moved.R = rotation_from_vector(turn) * T.R;
        const Vec3d by = 1e7 * (inverse(moved).t - inverse(T).t);
        for (int i = 0; i < 3; ++i) D(i, k) = by[i];
      }
      const Eigen::Matrix3d center = D * covariance.block<6, 6>(pose, pose) * D.transpose();
      for (int i = 0; i < 3; ++i) {
        d.rotation_rad[i] = root(pose + i);
        d.center_m[i] = std::sqrt(std::max(0.0, center(i, i)));
      }
    }
    return d;
  }

  Board board_;
  std::span<const BoardView> views_;
  std::vector<CalibratedCamera> cameras_;
  BundleOptions options_;
  std::vector<bool> used_, seen_;
  State state_;
};

}  // namespace

std::vector<CalibratedCamera> calibrate_lenses(const Board& board, std::span<const BoardView> views,
                                               std::span<const std::string> names,
                                               std::span<const Vec2i> size_px, const BundleOptions& options) {
  std::vector<CalibratedCamera> cameras;
  for (std::size_t c = 0; c < names.size(); ++c) {
    CalibratedCamera camera = first_intrinsics(board, views, static_cast<Index>(c), names[c], size_px[c]);
    camera.lens.model = options.lens;
    std::vector<BoardView> own;
    for (const BoardView& v : views) {
      if (v.camera != static_cast<Index>(c)) continue;
      own.push_back(v);
      own.back().camera = 0;
    }
    BundleOptions alone = options;
    alone.refine_intrinsics = true;
    camera = Bundle(board, own, {&camera, 1}, alone).run().cameras[0];
    cameras.push_back(camera);
  }
  return cameras;
}

BundleResult calibrate_poses(const Board& board, std::span<const BoardView> views,
                             std::span<const CalibratedCamera> cameras, const BundleOptions& options) {
  if (cameras.empty()) throw Error("calibration: no camera");
  return Bundle(board, views, cameras, options).run();
}
#endif

}  // namespace tactus
