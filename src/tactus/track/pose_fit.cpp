#include "tactus/track/pose_fit.h"

#include <algorithm>
#include <cmath>

#include "tactus/compute/cpu_for.h"
#include "tactus/geom/maths/rotation.h"

namespace tactus {
namespace {

constexpr double kBlur_px = 0.5;          // of a mask that is read between its pixels
constexpr double kStep_px = 0.75;         // of the sums along normals
constexpr double kLeastWhite_px2 = 0.02;  // variance of a residual
constexpr double kLeastContour_px = 0.05;
constexpr double kFarWhite_px2 = 0.5;                   // while the pose is off: far residuals are no field
constexpr double kNoiseMemory = 0.9;                    // of the noise's size, from frame to frame
constexpr double kLeastOff_px = 0.3, kFarOff_px = 1.5;  // of residuals that are believed, near and at first
constexpr double kMostPointOff_px = 6;                  // of a marker's corner: more is another's
/// Squares of steps, in standard deviations of all unknowns together (22 of eight cameras). The error left
/// after a step of the first adds 1 % to the variance. Smaller steps than the second that don't get smaller
/// come from the outline's points: they are found anew in each iteration.
constexpr double kSettled2 = 0.3, kJitter2 = 2;
constexpr double kSeenThrough_px = 1;  // parts thinner than this show holes, anyway

/// A mask along a normal.
struct Profile {
  const MaskWindow& window;
  Vec2d from_px, along;
  double at(double s) const { return window.at(from_px.x + s * along.x, from_px.y + s * along.y); }
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

/// By how much contours of a part of the model lie farther out than the model, on average, when a field of a
/// variance moves them: a part is seen only where the field leaves something of it.
double outward_bias_px(double thickness_px, double contour_px) {
  const double a = thickness_px / (2 * contour_px);
  if (a > 4) return 0;
  const double density = std::exp(-0.5 * a * a) / std::sqrt(2 * M_PI),
               gone = 0.5 * std::erfc(a / std::sqrt(2.0));
  if (thickness_px > kSeenThrough_px) return contour_px * density / (1 - gone);  // those gone don't count
  return contour_px * (density - a * gone);
}

/// Where an outline goes behind or before another part, the blur of that part reaches it.
void leave_breaks(std::vector<ContourPoint>& points) {
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].at_break = !points[i].follows || i + 1 == points.size() || !points[i + 1].follows;
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
    : mesh_(&mesh), cameras_(cameras.begin(), cameras.end()), settings_(settings), views_(cameras.size()) {
  noise_.correlation_px = settings.correlation_px;
}

void PoseFitter::open_windows(std::span<const BitMask> masks, const Rigidd& T, double reach_px) {
  cpu_for(views_.size(), 1, [&](std::size_t c) {
    views_[c].window.close();
    if (!masks[c].words.empty()) open_window(c, masks[c], T, reach_px);
  });
}

/// Around the picture of the model's box.
void PoseFitter::open_window(std::size_t camera, const BitMask& mask, const Rigidd& T, double reach_px) {
  Vec2d low{1e9, 1e9}, high{-1e9, -1e9};
  for (const Vec3d& p_m : mesh_->box_m) {
    const Pixel p = project(cameras_[camera], T * p_m);
    if (!(p.z_m > 0)) return;
    low = {std::min(low.x, p.u_px), std::min(low.y, p.v_px)};
    high = {std::max(high.x, p.u_px), std::max(high.y, p.v_px)};
  }
  const Vec2d reach{reach_px, reach_px};
  views_[camera].window.open(mask, low - reach, high + reach);
}

void PoseFitter::look(const Rigidd& T, double reach_px) {
  looked_at_ = T;
  cpu_for(views_.size(), 1, [&](std::size_t c) { look(c, T, reach_px); });
}

/// Residuals are sums of the mask along each normal, from the middle of the model to outside, less those of
/// the model. They are linear in the mask, so the errors of pixels average out, on parts thinner than a
/// pixel, too.
void PoseFitter::look(std::size_t camera, const Rigidd& T, double reach_px) {
  View& view = views_[camera];
  view.points.clear();
  view.residuals.clear();
  view.inner_px = view.missing_px = view.extra_px = 0;
  view.gone = 0;
  if (!view.window.is_open()) return;
  if (!view.outline.find(*mesh_, T, cameras_[camera], settings_.spacing_px, reach_px)) return;
  const Vec3d center_m = T * mesh_->center_m;
  const bool is_near = reach_px <= settings_.reach_px;
  const auto in_picture = [&](Vec2d p) {
    return p.x >= 0 && p.y >= 0 && p.x <= cameras_[camera].width_px - 1 &&
           p.y <= cameras_[camera].height_px - 1;
  };
  const double contour_px = has_noise_ && is_near ? noise_.contour_px : 1e-3;
  const Vec2d begin_px{static_cast<double>(view.window.x_px()), static_cast<double>(view.window.y_px())};
  Vec2d before_px{-1e9, -1e9};
  for (const OutlinePoint& p : view.outline.points()) {
    const Profile mask{view.window, p.px - begin_px, p.normal};
    if (p.outer_px < 0.5 || !in_picture(p.px) || !in_picture(p.px + p.outer_px * p.normal)) continue;
    const double inner = mask.sum(-p.inner_px, 0), outer = mask.sum(0, p.outer_px);
    view.inner_px += p.inner_px;
    view.missing_px += p.inner_px - inner;
    if (mask.at(p.outer_px) > 0.5) {  // something else covers it
      view.residuals.push_back({p.at_m, p.normal, p.outer_px, OutlineResidual::Kind::covered});
      continue;
    }
    // A part that is missing all through says nothing of where its sides are.
    if (is_near && p.thickness_px > kSeenThrough_px && mask.at(-p.inner_px) < 0.5) {
      ++view.gone;
      view.residuals.push_back({p.at_m, p.normal, -2 * p.inner_px, OutlineResidual::Kind::gone});
      continue;
    }
    view.extra_px += outer;
    // Parts thinner than the blur of a mask show only partly.
    const double gain = std::erf(p.thickness_px / (2 * std::sqrt(2.0) * blur_px_));
    const Vec3d g = gain * image_gradient(cameras_[camera], p.at_m, p.normal),
                by_turn = cross(p.at_m - center_m, g);
    const bool follows = std::hypot(p.px.x - before_px.x, p.px.y - before_px.y) < 2 * settings_.spacing_px;
    before_px = p.px;
    const double off_px = inner - p.inner_px + outer - outward_bias_px(p.thickness_px, contour_px);
    view.residuals.push_back({p.at_m, p.normal, off_px, OutlineResidual::Kind::seen});
    view.points.push_back({.px = p.px,
                           .j = {by_turn.x, by_turn.y, by_turn.z, g.x, g.y, g.z},
                           .normal = gain * p.normal,
                           .gain = gain,
                           .off_px = off_px,
                           .follows = follows});
  }
  leave_breaks(view.points);
}

/// By Tukey's biweight of the residuals, scaled by their median.
void PoseFitter::weigh(double least_px) {
  sizes_.clear();
  for (const View& view : views_)
    for (const ContourPoint& r : view.points) sizes_.push_back(std::abs(r.off_px));
  if (sizes_.empty()) return;
  const auto middle = sizes_.begin() + static_cast<std::ptrdiff_t>(sizes_.size() / 2);
  std::nth_element(sizes_.begin(), middle, sizes_.end());
  const double most_px = 4.685 * std::max(least_px, 1.4826 * *middle);
  for (View& view : views_) {
    for (ContourPoint& r : view.points) {
      const double x = r.off_px / most_px;
      r.weight = std::abs(x) < 1 && !r.at_break ? (1 - x * x) * (1 - x * x) : 0;
    }
  }
}

void PoseFitter::assemble(const PoseFit& fit, double least_white_px2) {
  ContourNoise noise = noise_;
  noise.white_px2 = std::max(noise.white_px2, least_white_px2);
  cpu_for(views_.size(), 1, [&](std::size_t c) {
    views_[c].equations.assemble(views_[c].points, settings_.spacing_px,
                                 {fit.shifts_px[2 * c], fit.shifts_px[2 * c + 1]}, noise);
  });
}

/// A wrong direction of view shifts a picture: half of the variance along each of its axes.
double PoseFitter::shift_information() const {
  const double sigma_px = std::max(settings_.calibration_px, 1e-3);
  return 2 / (sigma_px * sigma_px);
}

/// Each point has two residuals: where it is seen less where the model has it.
void PoseFitter::add_points(PoseFit& fit, std::span<const SeenPoint> points, bool is_near) {
  const Vec3d center_m = fit.T_world_model * mesh_->center_m;
  for (const SeenPoint& point : points) {
    const Camera& camera = cameras_[point.camera];
    const Vec3d p_m = fit.T_world_model * point.model_m;
    const Pixel at = project(camera, p_m);
    if (!(at.z_m > 0)) continue;
    const std::size_t shift = 2 * point.camera;
    const Vec2d off_px{point.px.x - at.u_px - fit.shifts_px[shift],
                       point.px.y - at.v_px - fit.shifts_px[shift + 1]};
    if (is_near && std::hypot(off_px.x, off_px.y) > kMostPointOff_px) continue;
    const double weight = 1 / (point.sigma_px * point.sigma_px);
    for (int axis = 0; axis < 2; ++axis) {
      const Vec3d g = image_gradient(camera, p_m, axis == 0 ? Vec2d{1, 0} : Vec2d{0, 1}),
                  by_turn = cross(p_m - center_m, g);
      const double row[7] = {by_turn.x, by_turn.y, by_turn.z, g.x, g.y, g.z, 1},
                   off = axis == 0 ? off_px.x : off_px.y;
      const auto place = [&](int i) { return i < 6 ? i : 6 + static_cast<int>(shift) + axis; };
      for (int i = 0; i < 7; ++i) {
        step_(place(i), 0) += weight * row[i] * off;
        for (int k = 0; k < 7; ++k) fit.information(place(i), place(k)) += weight * row[i] * row[k];
      }
    }
  }
}

/// Along each ray, the distance that is measured less that of the model. A motion of the surface by x, whose
/// normal is n, moves where the ray d meets it by x . n / (d . n). With the variance s² of a pixel and b² of
/// the error that all have in common, the inverse covariance is (1 - b² / (s² + N b²) 1 1^T) / s² (Sherman
/// and Morrison).
void PoseFitter::add_depth(PoseFit& fit, const SeenDepth& depth) {
  if (depth.image->empty()) return;
  const Vec3d center_m = fit.T_world_model * mesh_->center_m;
  const double own = sqr(settings_.depth_m), common = sqr(settings_.depth_bias_m),
               most_m = 4 * std::sqrt(own + common);
  double square[6][6]{}, sum[6]{}, right[6]{}, off_sum_m = 0;
  int count = 0;
  for (const DepthRays::Hit& hit : rays_.find(*mesh_, fit.T_world_model, *depth.camera)) {
    const double off_m = double{(*depth.image)(hit.x_px, hit.y_px)} - hit.distance_m;
    if (!(std::abs(off_m) < most_m)) continue;  // 0 or NaN: nothing was measured
    const Vec3d by_shift = (1 / dot(hit.along, hit.normal)) * hit.normal,
                by_turn = cross(hit.at_m - center_m, by_shift);
    const double row[6] = {by_turn.x, by_turn.y, by_turn.z, by_shift.x, by_shift.y, by_shift.z};
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 6; ++k) square[i][k] += row[i] * row[k];
      sum[i] += row[i];
      right[i] += row[i] * off_m;
    }
    off_sum_m += off_m;
    ++count;
  }
  const double less = common / (own + count * common);
  for (int i = 0; i < 6; ++i) {
    step_(i, 0) += (right[i] - less * sum[i] * off_sum_m) / own;
    for (int k = 0; k < 6; ++k) fit.information(i, k) += (square[i][k] - less * sum[i] * sum[k]) / own;
  }
}

/// Gauss and Newton's.
double PoseFitter::step(PoseFit& fit, const PosePrior* prior, const PoseEvidence& more, bool is_near) {
  const int n = 6 + 2 * static_cast<int>(views_.size());
  fit.information.reset(n, n);
  step_.reset(n, 1);
  for (std::size_t c = 0; c < views_.size(); ++c) {
    const ContourEquations& own = views_[c].equations;
    const auto at = [&](int i) { return i < 6 ? i : i + 2 * static_cast<int>(c); };
    for (int i = 0; i < ContourEquations::kUnknowns; ++i) {
      step_(at(i), 0) += own.right[i];
      for (int k = 0; k < ContourEquations::kUnknowns; ++k)
        fit.information(at(i), at(k)) += own.information[i][k];
    }
  }
  add_points(fit, more.points, is_near);
  for (const SeenDepth& depth : more.depths) add_depth(fit, depth);
  normal_ = fit.information;
  // Motions without evidence stay 0: as if one residual of a pixel spoke of a radian, and of a metre.
  for (int i = 0; i < 6; ++i) normal_(i, i) += 1e-4 * normal_(i, i) + 1;
  if (prior != nullptr) {
    const Twist back = twist_between(fit.T_world_model, prior->T_world_model, mesh_->center_m);
    const auto lack = [&](int k) {
      const auto i = static_cast<std::size_t>(k);
      return k < 6 ? back[i] : prior->shifts_px[i - 6] - fit.shifts_px[i - 6];
    };
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < n; ++k) {
        normal_(i, k) += prior->information(i, k);
        step_(i, 0) += prior->information(i, k) * lack(k);
      }
    }
  } else {
    for (int i = 6; i < n; ++i) {
      normal_(i, i) += shift_information();
      step_(i, 0) -= shift_information() * fit.shifts_px[static_cast<std::size_t>(i - 6)];
    }
  }
  factorize(normal_);
  solve_lower(normal_, step_);
  double sigmas2 = 0;
  for (double x : step_.v) sigmas2 += x * x;
  solve_upper(normal_, step_);
  return sigmas2;
}

/// By second moments: errors that neighbouring bins have in common are the contour's, others the pixels'.
void PoseFitter::measure_noise() {
  ContourEquations::Moments sum;
  for (const View& view : views_) {
    const ContourEquations::Moments& own = view.equations.moments();
    sum.squares += own.squares;
    sum.square_gains += own.square_gains;
    sum.shares += own.shares;
    sum.products += own.products;
    sum.product_gains += own.product_gains;
    sum.length_px += own.length_px;
  }
  if (!(sum.product_gains > 0 && sum.shares > 0)) return;
  // So many independent errors, of which a pose takes six.
  const double errors = sum.length_px / (std::sqrt(M_PI) * settings_.correlation_px),
               lost = std::max(1 - 6 / errors, 0.3);
  const double contour_px2 = std::max(sum.products / sum.product_gains, 0.0) / lost;
  const double white_px2 =
      std::max((sum.squares - contour_px2 * lost * sum.square_gains) / sum.shares, kLeastWhite_px2);
  const double memory = std::min(kNoiseMemory, noise_frames_ / (noise_frames_ + 1.0));
  const auto mean = [&](double before, double now) { return memory * before + (1 - memory) * now; };
  noise_.contour_px = std::sqrt(std::max(mean(noise_.contour_px * noise_.contour_px, contour_px2),
                                         kLeastContour_px * kLeastContour_px));
  noise_.white_px2 = mean(noise_.white_px2, white_px2);
  has_noise_ = true;
  ++noise_frames_;
}

void PoseFitter::sum_up(PoseFit& fit) const {
  double inner = 0, missing = 0, extra = 0, off2 = 0, weights = 0;
  fit.points = 0;
  int bins = 0, gone = 0, seen = 0;
  fit.surprise = 0;
  for (const View& view : views_) {
    fit.surprise += view.equations.moments().surprise;
    bins += view.equations.moments().bins;
    gone += view.gone;
    seen += static_cast<int>(view.points.size());
    inner += view.inner_px;
    missing += view.missing_px;
    extra += view.extra_px;
    for (const ContourPoint& r : view.points) {
      fit.points += r.weight > 0 ? 1 : 0;
      off2 += r.weight * r.off_px * r.off_px;
      weights += r.weight;
    }
  }
  fit.gone = gone + seen > 0 ? static_cast<double>(gone) / (gone + seen) : 1;
  fit.surprise /= std::max(bins, 1);
  fit.missing = inner > 0 ? missing / inner : 1;
  fit.wrong = inner > 0 ? (missing + extra) / inner : 2;
  fit.rms_px = weights > 0 ? std::sqrt(off2 / weights) : 0;
}

/// Masks say so much of the pose while nothing is known of the shifts but how large they may be.
void PoseFitter::state_covariance(PoseFit& fit) {
  // Where residuals are as large as the parts are thick, the solution is no longer linear in them: squares of
  // errors over twelve strokes were 1.23 times those stated without this, at residuals of 0.85 px.
  const double spread = 1 / (1 + fit.rms_px * fit.rms_px / 3);
  for (double& x : fit.information.v) x *= spread;
  DenseMatrix all = fit.information;
  for (int i = 0; i < all.rows; ++i) all(i, i) += i < 6 ? 1 : shift_information();
  const DenseMatrix inverse = inverse_of_definite(std::move(all));
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) fit.covariance(i, k) = inverse(i, k);
}

PoseFit PoseFitter::fit(std::span<const BitMask> masks, const Rigidd& T_start, double search_px,
                        const PosePrior* prior, int most_iterations, const PoseEvidence& more) {
  PoseFit fit;
  fit.T_world_model = T_start;
  fit.shifts_px.assign(2 * views_.size(), 0);
  if (prior != nullptr) {
    fit.shifts_px = prior->shifts_px;
  } else {
    noise_ = {.correlation_px = settings_.correlation_px};  // the learned noise is another pose's
    has_noise_ = false;
    blur_px_ = kBlur_px;
  }
  double reach_px = std::max(search_px, settings_.reach_px);
  open_windows(masks, T_start, 2 * reach_px + settings_.reach_px + 2);
  double last_sigmas2 = 0;
  for (; fit.iterations < most_iterations; ++fit.iterations) {
    const bool is_far = reach_px > settings_.reach_px;
    look(fit.T_world_model, reach_px);
    weigh(is_far ? kFarOff_px : kLeastOff_px);
    assemble(fit, is_far ? kFarWhite_px2 : has_noise_ ? 0 : kFarWhite_px2);
    const double sigmas2 = step(fit, prior, more, !is_far && fit.iterations > 0);
    Twist by;
    std::copy(step_.v.begin(), step_.v.begin() + 6, by.begin());
    const double turn = length(Vec3d{by[0], by[1], by[2]}), shift_m = length(Vec3d{by[3], by[4], by[5]});
    const double shrink = std::min({1.0, 0.3 / std::max(turn, 1e-12), 0.05 / std::max(shift_m, 1e-12)});
    for (double& x : by) x *= shrink;
    fit.T_world_model = moved(fit.T_world_model, mesh_->center_m, by);
    for (std::size_t i = 0; i < fit.shifts_px.size(); ++i) fit.shifts_px[i] += shrink * step_.v[6 + i];
    if (is_far) {
      if (sigmas2 < 4) reach_px = settings_.reach_px;
    } else if (!has_noise_ && sigmas2 < 4) {
      noise_frames_ = 0;
      measure_noise();
      noise_frames_ = 0;
    } else if (sigmas2 < kSettled2 || (sigmas2 < kJitter2 && sigmas2 > 0.5 * last_sigmas2)) {
      ++fit.iterations;
      break;
    }
    last_sigmas2 = sigmas2;
  }
  measure_noise();
  sum_up(fit);
  fit.surprise += surprise_of(more.points, fit);
  state_covariance(fit);
  blur_px_ = std::sqrt(kBlur_px * kBlur_px + fit.rms_px * fit.rms_px);
  return fit;
}

/// As of contours: a mean, but for a constant.
double PoseFitter::surprise_of(std::span<const SeenPoint> points, const PoseFit& fit) const {
  double sum = 0;
  for (const SeenPoint& point : points) {
    const Pixel at = project(cameras_[point.camera], fit.T_world_model * point.model_m);
    sum += sqr(std::hypot(point.px.x - at.u_px, point.px.y - at.v_px) / point.sigma_px);
  }
  return points.empty() ? 0 : sum / static_cast<double>(2 * points.size());
}

std::optional<Rigidd> pose_of_points(std::span<const Camera> cameras, std::span<const SeenPoint> points) {
  std::vector<Vec3d> model_m, world_m;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d& at_m = points[i].model_m;
    if (std::find(model_m.begin(), model_m.end(), at_m) != model_m.end()) continue;
    // The point nearest to all rays.
    SmallMatrix<3> sum;
    SmallMatrix<3, 1> right;
    int rays = 0;
    for (std::size_t k = i; k < points.size(); ++k) {
      if (points[k].model_m != at_m) continue;
      const Camera& camera = cameras[points[k].camera];
      const Vec3d from_m = camera.center_world(),
                  along = pixel_ray_world(camera, points[k].px.x, points[k].px.y);
      ++rays;
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          const double across = (a == b ? 1 : 0) - along[a] * along[b];
          sum(a, b) += across;
          right(a, 0) += across * from_m[b];
        }
    }
    if (rays < 2) continue;
    const SmallMatrix<3, 1> x = inverse_of_definite(sum) * right;
    model_m.push_back(at_m);
    world_m.push_back({x(0, 0), x(1, 0), x(2, 0)});
  }
  if (model_m.size() < 3) return std::nullopt;
  const auto axes = [](const std::vector<Vec3d>& p) {
    const Vec3d x = normalized(p[1] - p[0]), across = cross(x, p[2] - p[0]), z = normalized(across);
    return std::pair{Mat3d{{x, cross(z, x), z}}, length(across)};
  };
  const auto [of_model, model_size_m2] = axes(model_m);
  const auto [of_world, world_size_m2] = axes(world_m);
  if (!(model_size_m2 > 1e-12 && world_size_m2 > 1e-12)) return std::nullopt;
  const Mat3d R = transpose(of_world) * of_model;
  return Rigidd{R, world_m[0] - R * model_m[0]};
}

void PoseFitter::add_to(ShapeEvidence& shape) const {
  for (std::size_t c = 0; c < views_.size(); ++c)
    if (views_[c].window.is_open()) shape.add(c, cameras_[c], looked_at_, views_[c].residuals);
}

double PoseFitter::wrong(std::span<const BitMask> masks, const Rigidd& T_world_model) {
  PoseFit fit;
  open_windows(masks, T_world_model, settings_.reach_px + 1);
  look(T_world_model, settings_.reach_px);
  sum_up(fit);
  return fit.wrong;
}

}  // namespace tactus
