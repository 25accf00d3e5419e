#include "tactus/track/pose_fit.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "tactus/geom/rotation.h"

namespace tactus {
namespace {

constexpr double kBlur_px = 0.5;                        // of a mask that is read between its pixels
constexpr double kCell_px = 16;                         // within which contours are off together
constexpr double kStep_px = 0.75;                       // of the sums along normals
constexpr double kLeast_px2 = 0.02;                     // variance of a residual
constexpr double kMemory = 0.8;                         // of that of the solution, from frame to frame
constexpr double kLeastOff_px = 0.3, kFarOff_px = 1.5;  // of residuals that are believed, near and at first
constexpr int kMostIterations = 12;

float mask_at(const Image<float>& window, double x, double y) {
  const auto x0 = static_cast<Index>(std::floor(x)), y0 = static_cast<Index>(std::floor(y));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= window.width_px || y0 + 1 >= window.height_px) return 0;
  const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
  const float* p = &window(x0, y0);
  const float upper = p[0] + fx * (p[1] - p[0]);
  p += window.width_px;
  const float lower = p[0] + fx * (p[1] - p[0]);
  return upper + fy * (lower - upper);
}

/// Of a mask along a normal.
struct Profile {
  const Image<float>& window;
  Vec2d from_px, along;
  double at(double s) const {
    return static_cast<double>(mask_at(window, from_px.x + s * along.x, from_px.y + s * along.y));
  }
  double sum(double from, double to) const {
    const int n = std::max(1, static_cast<int>(std::ceil((to - from) / kStep_px)));
    const double step = (to - from) / n;
    double all = 0;
    for (int i = 0; i < n; ++i) all += at(from + (i + 0.5) * step);
    return all * step;
  }
};

/// How far a point's picture goes along a direction of the picture, per motion of the point [px/m].
Vec3d image_gradient(const Camera& camera, Vec3d p_m, Vec2d along) {
  const Vec3d p = camera.T_cam_world * p_m;
  const Vec3d by_camera{
      along.x * camera.fx_px, along.x * camera.skew_px + along.y * camera.fy_px,
      -(along.x * (camera.fx_px * p.x + camera.skew_px * p.y) + along.y * camera.fy_px * p.y) / p.z};
  return (1 / p.z) * (transpose(camera.T_cam_world.R) * by_camera);
}

/// A covariance of twists in other axes.
Matrix6 turned(const Matrix6& covariance, const Mat3d& R) {
  Matrix6 both;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) both(i, j) = both(3 + i, 3 + j) = R(i, j);
  return both * covariance * transpose(both);
}

}  // namespace

Rigidd moved(const Rigidd& T_world_model, Vec3d center_m, const Twist& by) {
  const Vec3d c_m = T_world_model * center_m;
  const Mat3d turned = rotation_from_vector({by[0], by[1], by[2]}) * T_world_model.R;
  const Mat3d R = rotation_matrix(quaternion_of(turned));  // stays a rotation
  return {R, c_m + Vec3d{by[3], by[4], by[5]} - R * center_m};
}

Twist twist_between(const Rigidd& from, const Rigidd& to, Vec3d center_m) {
  const Vec3d turn = vector_of_rotation(to.R * transpose(from.R)), shift_m = to * center_m - from * center_m;
  return {turn.x, turn.y, turn.z, shift_m.x, shift_m.y, shift_m.z};
}

PoseFitter::PoseFitter(const OutlineMesh& mesh, std::span<const Camera> cameras,
                       const PoseFitSettings& settings)
    : mesh_(&mesh), cameras_(cameras.begin(), cameras.end()), settings_(settings), views_(cameras.size()) {}

void PoseFitter::open_windows(std::span<const BitMask> masks, const Rigidd& T, double reach_px) {
  tbb::parallel_for(std::size_t{0}, views_.size(), [&](std::size_t c) {
    views_[c].window.width_px = 0;
    if (!masks[c].words.empty()) open_window(c, masks[c], T, reach_px);
  });
}

void PoseFitter::open_window(std::size_t camera, const BitMask& mask, const Rigidd& T, double reach_px) {
  View& view = views_[camera];
  Vec2d low{1e9, 1e9}, high{-1e9, -1e9};
  for (const Vec3d& p_m : mesh_->vertices_m) {
    const Pixel p = project(cameras_[camera], T * p_m);
    if (!(p.z_m > 0)) return;
    low = {std::min(low.x, p.u_px), std::min(low.y, p.v_px)};
    high = {std::max(high.x, p.u_px), std::max(high.y, p.v_px)};
  }
  const auto first = [&](double x) { return static_cast<Index>(std::floor(std::max(x - reach_px, 0.0))); };
  const auto end = [&](double x, Index size) {
    return static_cast<Index>(std::ceil(std::clamp(x + reach_px + 1, 0.0, static_cast<double>(size))));
  };
  if (!(low.x < mask.width_px && low.y < mask.height_px)) return;
  view.x_px = first(low.x);
  view.y_px = first(low.y);
  const Index width = end(high.x, mask.width_px) - view.x_px,
              height = end(high.y, mask.height_px) - view.y_px;
  if (width < 2 || height < 2) return;
  view.window.width_px = width;
  view.window.height_px = height;
  view.window.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (Index y = 0; y < height; ++y) {
    for (Index x = 0; x < width; ++x) view.window(x, y) = mask(view.x_px + x, view.y_px + y) ? 1.F : 0.F;
  }
}

void PoseFitter::look(const Rigidd& T, double reach_px) {
  tbb::parallel_for(std::size_t{0}, views_.size(), [&](std::size_t c) { look(c, T, reach_px); });
}

/// The mask along each normal, from the middle of the model to outside: what it has more than the model. It
/// is linear in the mask, so the errors of pixels average out, on parts thinner than a pixel, too.
void PoseFitter::look(std::size_t camera, const Rigidd& T, double reach_px) {
  View& view = views_[camera];
  view.residuals.clear();
  view.inner_px = view.missing_px = view.extra_px = 0;
  if (view.window.width_px == 0) return;
  if (!view.outline.find(*mesh_, T, cameras_[camera], settings_.spacing_px, reach_px)) return;
  const Vec3d center_m = T * mesh_->center_m;
  const auto in_picture = [&](Vec2d p) {
    return p.x >= 0 && p.y >= 0 && p.x <= cameras_[camera].width_px - 1 &&
           p.y <= cameras_[camera].height_px - 1;
  };
  for (const OutlinePoint& p : view.outline.points()) {
    const Profile mask{
        view.window, p.px - Vec2d{static_cast<double>(view.x_px), static_cast<double>(view.y_px)}, p.normal};
    if (p.outer_px < 0.5 || !in_picture(p.px) || !in_picture(p.px + p.outer_px * p.normal)) continue;
    const double inner = mask.sum(-p.inner_px, 0), outer = mask.sum(0, p.outer_px);
    view.inner_px += p.inner_px;
    view.missing_px += p.inner_px - inner;
    if (mask.at(p.outer_px) > 0.5) continue;  // something else covers it
    view.extra_px += outer;
    // Of what is thinner than the blur of a mask, only a part shows.
    const double gain = std::erf(p.thickness_px / (2 * std::sqrt(2.0) * blur_px_));
    const Vec3d g = gain * image_gradient(cameras_[camera], p.at_m, p.normal),
                by_turn = cross(p.at_m - center_m, g);
    view.residuals.push_back(
        {.j = {by_turn.x, by_turn.y, by_turn.z, g.x, g.y, g.z},
         .normal = gain * p.normal,
         .off_px = inner - p.inner_px + outer,
         .cell = static_cast<Index>(p.px.y / kCell_px) * 4096 + static_cast<Index>(p.px.x / kCell_px)});
  }
}

/// By Tukey's biweight of the residuals, scaled by their median.
void PoseFitter::weigh(double least_px) {
  sizes_.clear();
  for (const View& view : views_)
    for (const Residual& r : view.residuals) sizes_.push_back(std::abs(r.off_px));
  if (sizes_.empty()) return;
  const auto middle = sizes_.begin() + static_cast<std::ptrdiff_t>(sizes_.size() / 2);
  std::nth_element(sizes_.begin(), middle, sizes_.end());
  const double most_px = 4.685 * std::max(least_px, 1.4826 * *middle);
  for (View& view : views_) {
    for (Residual& r : view.residuals) {
      const double x = r.off_px / most_px;
      r.weight = std::abs(x) < 1 ? (1 - x * x) * (1 - x * x) : 0;
    }
  }
}

/// Gauss and Newton's.
Twist PoseFitter::step(const Rigidd& T, const PosePrior* prior) {
  double a[6][6]{}, x[6]{};
  for (const View& view : views_) {
    for (const Residual& r : view.residuals) {
      for (int i = 0; i < 6; ++i) {
        const double wj = r.weight * r.j[i];
        for (int j = 0; j <= i; ++j) a[i][j] += wj * r.j[j];
        x[i] += wj * r.off_px;
      }
    }
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) normal_(i, j) = normal_(j, i) = a[i][j];
  // What masks say nothing about stays: as if one residual of a pixel spoke of a radian, and of a metre.
  for (int i = 0; i < 6; ++i) a[i][i] = a[i][i] * (1 + 1e-4) + 1;
  solve_cholesky(a, x);
  Twist by;
  std::copy(x, x + 6, by.begin());
  if (prior == nullptr || !noise_) return by;
  const Twist back = twist_between(T, prior->T_world_model, mesh_->center_m);
  const Matrix6 known = inverse_of_definite(turned(*noise_, T.R));
  SmallMatrix<6, 1> seen, before;
  for (int i = 0; i < 6; ++i) {
    seen(i, 0) = by[static_cast<std::size_t>(i)];
    before(i, 0) = back[static_cast<std::size_t>(i)];
  }
  const SmallMatrix<6, 1> both =
      inverse_of_definite(known + prior->information) * (known * seen + prior->information * before);
  for (int i = 0; i < 6; ++i) by[static_cast<std::size_t>(i)] = both(i, 0);
  return by;
}

void PoseFitter::sum_up(PoseFit& fit) const {
  double inner = 0, missing = 0, extra = 0, off2 = 0, weights = 0;
  fit.points = 0;
  for (const View& view : views_) {
    inner += view.inner_px;
    missing += view.missing_px;
    extra += view.extra_px;
    for (const Residual& r : view.residuals) {
      fit.points += r.weight > 0 ? 1 : 0;
      off2 += r.weight * r.off_px * r.off_px;
      weights += r.weight;
    }
  }
  fit.missing = inner > 0 ? missing / inner : 1;
  fit.wrong = inner > 0 ? (missing + extra) / inner : 2;
  fit.rms_px = weights > 0 ? std::sqrt(off2 / weights) : 0;
}

/// Residuals of one cell of a picture are off together. Their sums say by how much more the solution varies
/// than if all were independent (Liang & Zeger 1986).
void PoseFitter::add_covariance(PoseFit& fit) {
  Matrix6 between, shifted;
  int cells = 0;
  for (View& view : views_) {
    std::sort(view.residuals.begin(), view.residuals.end(),
              [](const Residual& a, const Residual& b) { return a.cell < b.cell; });
    SmallMatrix<6, 2> by_shift;
    SmallMatrix<6, 1> score;
    for (std::size_t k = 0; k < view.residuals.size(); ++k) {
      const Residual& r = view.residuals[k];
      for (int i = 0; i < 6; ++i) {
        score(i, 0) += r.weight * r.j[i] * r.off_px;
        by_shift(i, 0) += r.weight * r.j[i] * r.normal.x;
        by_shift(i, 1) += r.weight * r.j[i] * r.normal.y;
      }
      if (k + 1 < view.residuals.size() && view.residuals[k + 1].cell == r.cell) continue;
      between = between + score * transpose(score);
      score = {};
      ++cells;
    }
    shifted = shifted + by_shift * transpose(by_shift);
  }
  const Matrix6 inverse = inverse_of_definite(normal_ + Matrix6::diagonal(1));
  // Where residuals are as large as the parts are thick, the solution is no longer linear in them, and varies
  // more: measured, 2 at one pixel.
  const double few = (cells > 12 ? cells / (cells - 6.0) : 2) * (1 + fit.rms_px * fit.rms_px);
  const Matrix6 noise =
      turned(few * (inverse * between * inverse) + kLeast_px2 * inverse, transpose(fit.T_world_model.R));
  noise_ = noise_ ? kMemory * *noise_ + (1 - kMemory) * noise : noise;
  fit.noise = turned(*noise_, fit.T_world_model.R);
  blur_px_ = std::sqrt(kBlur_px * kBlur_px + fit.rms_px * fit.rms_px);
  // A wrong direction of view shifts a picture: half of the variance along each of its axes.
  fit.calibration = (settings_.calibration_px * settings_.calibration_px / 2) * (inverse * shifted * inverse);
}

PoseFit PoseFitter::fit(std::span<const BitMask> masks, const Rigidd& T_start, double search_px,
                        const PosePrior* prior) {
  PoseFit fit;
  fit.T_world_model = T_start;
  double reach_px = std::max(search_px, settings_.reach_px);
  open_windows(masks, T_start, 2 * reach_px + settings_.reach_px + 2);
  for (; fit.iterations < kMostIterations; ++fit.iterations) {
    look(fit.T_world_model, reach_px);
    weigh(reach_px > settings_.reach_px ? kFarOff_px : kLeastOff_px);
    Twist by = step(fit.T_world_model, prior);
    const double turn = length(Vec3d{by[0], by[1], by[2]}), shift_m = length(Vec3d{by[3], by[4], by[5]});
    const double shrink = std::min({1.0, 0.3 / std::max(turn, 1e-12), 0.05 / std::max(shift_m, 1e-12)});
    // Of this step, in standard deviations of what the masks say.
    SmallMatrix<6, 1> size;
    for (int i = 0; i < 6; ++i) size(i, 0) = by[static_cast<std::size_t>(i)];
    const Matrix6 known = noise_ ? inverse_of_definite(turned(*noise_, fit.T_world_model.R)) : normal_;
    const double sigmas2 = (transpose(size) * (known * size))(0, 0);
    for (double& x : by) x *= shrink;
    fit.T_world_model = moved(fit.T_world_model, mesh_->center_m, by);
    if (reach_px > settings_.reach_px) {
      if (sigmas2 < 4) reach_px = settings_.reach_px;
    } else if (sigmas2 < 0.05) {
      ++fit.iterations;
      break;
    }
  }
  sum_up(fit);
  add_covariance(fit);
  return fit;
}

double PoseFitter::wrong(std::span<const BitMask> masks, const Rigidd& T_world_model) {
  PoseFit fit;
  open_windows(masks, T_world_model, settings_.reach_px + 1);
  look(T_world_model, settings_.reach_px);
  sum_up(fit);
  return fit.wrong;
}

}  // namespace tactus
