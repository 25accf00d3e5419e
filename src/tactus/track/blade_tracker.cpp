#include "tactus/track/blade_tracker.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "tactus/compute/cpu_for.h"
#include "tactus/geom/image/mask_growth.h"
#include "tactus/geom/image/rasterize.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/geom/maths/symmetric_eigen.h"

namespace tactus {
namespace {

constexpr double kMostMissing = 0.5;  // of the model's picture
constexpr int kLeastPoints = 40;      // of outlines
constexpr int kMostLostFrames = 5;    // in which it is expected to come back where it went
constexpr double kFarWorse = 1.6;     // times PoseFit::wrong of the best pose: worse poses go
constexpr double kLeastSpread = 0.1;  // 1 sigma of differences of surprise, from frame to frame
constexpr std::size_t kMostHypotheses = 4;
constexpr double kExpected = 1.3, kLeastExpected = 0.05;  // more than the last frame's is suspect
constexpr int kPause_frames = 5;  // before thin parts that aren't the tool are tried again
constexpr int kBeside_px = 3;     // by how much a silhouette may be wider than the tool
constexpr double kPointSearch_px = 8, kMostSearch_px = 16;
/// Iterations of a fit that a prediction begins: later ones change less than the next frame does. Poses that
/// compete get more, to be compared at their best.
constexpr int kSteps = 5, kStepsToCompare = 12;
constexpr std::size_t kFramesToSettle = 3;
/// Largest share of the outline where the tool may be missing all through. At this share, contours are off by
/// three quarters of its thickness (1 sigma: so much of a normal distribution lies beyond half of the
/// thickness), and stated errors no longer hold.
constexpr double kMostGone = 0.25;
/// Times PoseFit::wrong of the best pose: a tool elsewhere that is no worse than this is as good.
constexpr double kTwin = 1.25;
constexpr int kFramesOfShape = 2, kFramesOfTwoShapes = 4;
constexpr double kClearMisfit = 2;    // times the refused one
constexpr double kMostCovered = 0.5;  // of the outline along the edge, or at its tip

/// Radius of a model about its long axis in each camera's picture, at a place; a pixel more, rounded up.
std::vector<int> radii_px(const OutlineMesh& mesh, std::span<const Camera> cameras, Vec3d middle_m) {
  const double radius_m = long_axis(mesh).radius_m;
  std::vector<int> radii;
  for (const Camera& camera : cameras) {
    const double away_m = std::max(length(camera.center_world() - middle_m), 0.1);
    radii.push_back(1 + static_cast<int>(std::ceil(radius_m * camera.fx_px / away_m)));
  }
  return radii;
}

template <class Mask>
auto& word_at(Mask& mask, Index word, Index row) {
  return mask.words[static_cast<std::size_t>(row) * static_cast<std::size_t>(mask.words_per_row()) +
                    static_cast<std::size_t>(word)];
}

}  // namespace

const char* blade_state_name(BladeState state) {
  constexpr const char* kNames[] = {"absent", "ambiguous", "misfit", "twins", "unsure", "jumped", "known"};
  return kNames[static_cast<std::size_t>(state)];
}

BladeTracker::BladeTracker(const BladeModel& model, std::span<const Camera> cameras, Vec3d middle_m,
                           const BladeTrackerSettings& settings)
    : model_((check_blade_model(model), model)),
      mesh_(model.mesh, model.name.c_str()),
      settings_(settings),
      cameras_(cameras.begin(), cameras.end()),
      radius_px_(radii_px(mesh_, cameras, middle_m)),
      search_(mesh_, cameras, radius_px_, settings.fit) {}

std::array<Vec3d, 2> BladeTracker::axis_m() const {
  const LongAxis axis = long_axis(mesh_);
  return {mesh_.center_m + axis.begin_m * axis.direction, mesh_.center_m + axis.end_m * axis.direction};
}

const TrackedBlade& BladeTracker::update(std::span<const BitMask> masks, double dt_s,
                                         std::span<const BitMask> taken, const PoseEvidence& more) {
  if (!(dt_s > 0)) {
    hypotheses_.clear();
    last_edge_m_.clear();
  }
  since_known_s_ += dt_s;
  // Pixels of a still picture are off as before: counted again and again, they would draw the pose with them.
  const bool are_the_same = remember(masks);
  const bool is_still = are_the_same && hypotheses_.size() == 1 && more.points.empty() && more.depths.empty();
  for (Hypothesis& h : hypotheses_) {
    if (is_still && h.lost_frames == 0)
      h.filter.stay();
    else
      follow(h, masks, dt_s, more);
  }
  std::erase_if(hypotheses_, [](const Hypothesis& h) { return h.lost_frames > kMostLostFrames; });
  drop_worse();
  if (is_twin_ && --twin_frames_ < 0) hypotheses_.clear();  // one may have gone
  if (hypotheses_.empty() && --pause_frames_ < 0) {
    const bool has_tried = seek(masks, taken, more);
    pause_frames_ = hypotheses_.empty() && has_tried ? kPause_frames : 0;
    if (hypotheses_.empty() && has_tried) unexplained_frames_ += kPause_frames + 1;
    is_twin_ = more.points.empty() && !hypotheses_.empty() && has_twin(masks, taken);
    twin_frames_ = kPause_frames;
  }
  judge();
  return now_;
}

bool BladeTracker::remember(std::span<const BitMask> masks) {
  last_masks_.resize(masks.size());
  std::atomic<bool> are_the_same = true;
  cpu_for(masks.size(), 1, [&](std::size_t c) {
    if (last_masks_[c] == masks[c]) return;
    last_masks_[c] = masks[c];
    are_the_same = false;
  });
  return are_the_same;
}

void BladeTracker::follow(Hypothesis& h, std::span<const BitMask> masks, double dt_s,
                          const PoseEvidence& more) {
  h.filter.predict(dt_s);
  const PosePrior& prior = h.filter.prior();
  const Matrix6 covariance = h.filter.covariance();
  const double variance_m2 = std::max({covariance(3, 3), covariance(4, 4), covariance(5, 5)});
  const Camera& camera = h.fitter.cameras().front();
  const double px_m = camera.fx_px / length(camera.center_world() - h.filter.pose() * mesh_.center_m);
  const double search_px =
      std::clamp(2 * std::sqrt(variance_m2) * px_m, settings_.fit.reach_px, kMostSearch_px);
  // Things near the tool mislead a wide search: first search where it is expected.
  const double expected = kExpected * h.fit.wrong + kLeastExpected;
  const int most = hypotheses_.size() > 1 ? kStepsToCompare : kSteps;
  h.fit = h.fitter.fit(masks, prior.T_world_model, settings_.fit.reach_px, &prior, most, more);
  if (h.fit.wrong > expected && search_px > settings_.fit.reach_px) {
    const PoseFit far = h.fitter.fit(masks, prior.T_world_model, search_px, &prior, kStepsToCompare, more);
    if (far.wrong < h.fit.wrong) h.fit = far;
  }
  if (h.fit.missing >= kMostMissing || h.fit.points < kLeastPoints) {
    ++h.lost_frames;
    return;
  }
  h.filter.update(h.fit);
  h.lost_frames = 0;
  h.shape.begin_frame();
  h.fitter.add_to(h.shape);
  if (hypotheses_.size() > 1) h.surprises.push_back(h.fit.surprise);
}

/// By the paired differences of how much masks surprise: one goes when the leader is better by four standard
/// errors of their mean.
void BladeTracker::drop_worse() {
  const auto mean = [](const Hypothesis& h) {
    return std::accumulate(h.surprises.begin(), h.surprises.end(), 0.0) /
           static_cast<double>(h.surprises.size());
  };
  std::stable_sort(hypotheses_.begin(), hypotheses_.end(),
                   [&](const Hypothesis& a, const Hypothesis& b) { return mean(a) < mean(b); });
  const auto is_worse = [&](const Hypothesis& h) {
    const Hypothesis& best = hypotheses_.front();
    if (&h == &best) return false;
    if (!is_other_pose(h.filter.pose(), best.filter.pose(), mesh_.center_m)) return true;
    const std::size_t n = std::min(h.surprises.size(), best.surprises.size());
    if (n < kFramesToSettle) return false;
    double sum = 0, squares = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const double d =
          h.surprises[h.surprises.size() - n + k] - best.surprises[best.surprises.size() - n + k];
      sum += d;
      squares += d * d;
    }
    const auto count = static_cast<double>(n);
    const double middle = sum / count, variance = std::max(squares / count - middle * middle, 0.0);
    return middle > 4 * std::max(std::sqrt(variance / (count - 1)), kLeastSpread / std::sqrt(count));
  };
  for (std::size_t k = hypotheses_.size(); k-- > 1;)
    if (is_worse(hypotheses_[k])) hypotheses_.erase(hypotheses_.begin() + static_cast<std::ptrdiff_t>(k));
}

bool BladeTracker::seek(std::span<const BitMask> masks, std::span<const BitMask> taken,
                        const PoseEvidence& more) {
  const std::optional<Rigidd> by_points = pose_of_points(cameras_, more.points);
  const std::vector<Rigidd> tries =
      by_points ? std::vector{*by_points} : search_.find(masks, taken, more.points);
  const double search_px = by_points ? kPointSearch_px : settings_.fit.reach_px;
  for (const Rigidd& pose : tries) {
    Hypothesis h{PoseFitter(mesh_, cameras_, settings_.fit),
                 PoseFilter(mesh_.center_m, settings_.motion),
                 {},
                 ShapeEvidence(mesh_, model_.edge_m),
                 {}};
    h.fit = h.fitter.fit(masks, pose, search_px, nullptr, kStepsToCompare, more);
    if (h.fit.missing >= kMostMissing || h.fit.points < kLeastPoints) continue;
    h.filter.start(h.fit, settings_.fit.calibration_px);
    h.shape.begin_frame();
    h.fitter.add_to(h.shape);
    h.surprises.push_back(h.fit.surprise);
    hypotheses_.push_back(std::move(h));
  }
  // The best, and others in its place: elsewhere is another tool.
  std::sort(hypotheses_.begin(), hypotheses_.end(),
            [](const Hypothesis& a, const Hypothesis& b) { return a.fit.wrong < b.fit.wrong; });
  std::vector<Hypothesis> kept;
  for (Hypothesis& h : hypotheses_) {
    const bool is_new = std::all_of(kept.begin(), kept.end(), [&](const Hypothesis& k) {
      return is_other_pose(h.filter.pose(), k.filter.pose(), mesh_.center_m);
    });
    const bool is_there = kept.empty() || length(h.filter.pose() * mesh_.center_m -
                                                 kept[0].filter.pose() * mesh_.center_m) < mesh_.radius_m;
    if (is_new && is_there && kept.size() < kMostHypotheses &&
        (kept.empty() || h.fit.wrong < kFarWorse * kept[0].fit.wrong))
      kept.push_back(std::move(h));
  }
  hypotheses_ = std::move(kept);
  frames_ = 0;
  return !tries.empty();
}

/// The largest of the edge's points, each by its 3x3 covariance. No eigenvalue is larger than the root of the
/// sum of all squares, so few points are looked at as closely as that.
double BladeTracker::two_sigma_m(const Hypothesis& of) const {
  const Matrix6 covariance = of.filter.covariance();
  const auto of_point = [&](Vec3f p) {
    const Vec3d arm_m = of.filter.pose().R * (vec_cast<double>(p) - mesh_.center_m);
    SmallMatrix<3, 6> by;  // turn x arm + shift
    const Mat3d cross_arm{{{0, arm_m.z, -arm_m.y}, {-arm_m.z, 0, arm_m.x}, {arm_m.y, -arm_m.x, 0}}};
    for (int i = 0; i < 3; ++i) {
      by(i, 3 + i) = 1;
      for (int j = 0; j < 3; ++j) by(i, j) = cross_arm(i, j);
    }
    const SmallMatrix<3> product = by * covariance * transpose(by);
    Mat3d m = Mat3d::zero();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) m(i, j) = product(i, j);
    return m;
  };
  const auto bound = [](const Mat3d& m) {
    double squares = 0;
    for (const Vec3d& row : m.row) squares += dot(row, row);
    return (1 + 1e-9) * std::sqrt(squares);  // rounding
  };
  Vec3f worst = model_.edge_m.front();
  for (const Vec3f p : model_.edge_m)
    if (bound(of_point(p)) > bound(of_point(worst))) worst = p;
  double most_m2 = std::max(symmetric_eigen(of_point(worst)).values[0], 0.0);
  for (const Vec3f p : model_.edge_m)
    if (const Mat3d m = of_point(p); bound(m) > most_m2)
      most_m2 = std::max(most_m2, symmetric_eigen(m).values[0]);
  return 2 * std::sqrt(most_m2);
}

/// Searches the masks without the best pose's own pixels, and compares the model's fits there with the best.
bool BladeTracker::has_twin(std::span<const BitMask> masks, std::span<const BitMask> taken) {
  std::vector<BitMask> others(taken.begin(), taken.end());
  if (others.empty())
    for (const BitMask& mask : masks) others.emplace_back(mask.width_px, mask.height_px);
  add_to(others);
  const PoseFit& best = hypotheses_.front().fit;
  int twins = 0;
  std::vector<Rigidd> places;
  for (const Rigidd& pose : search_.find(masks, others, {})) {
    const auto is_apart = [&](const Rigidd& from) {
      return length(pose * mesh_.center_m - from * mesh_.center_m) > mesh_.radius_m / 2;
    };
    if (!is_apart(hypotheses_.front().filter.pose()) || !std::all_of(places.begin(), places.end(), is_apart))
      continue;
    const PoseFit fit = PoseFitter(mesh_, cameras_, settings_.fit)
                            .fit(masks, pose, settings_.fit.reach_px, nullptr, kStepsToCompare);
    if (fit.missing >= kMostMissing || fit.points < kLeastPoints) continue;
    if (fit.wrong > kTwin * best.wrong + kLeastExpected) continue;
    places.push_back(fit.T_world_model);
    ++twins;
  }
  return twins >= settings_.equal_tools;
}

void BladeTracker::judge() {
  now_.edge_m.clear();
  now_.state = hypotheses_.empty() ? BladeState::absent : BladeState::ambiguous;
  if (hypotheses_.empty()) return;
  const Hypothesis& h = hypotheses_.front();
  now_.misfit_px = h.shape.misfit_px();
  now_.edge_covered = h.shape.edge_covered();
  now_.residual_px = h.fit.rms_px;
  // Another shape may fit badly in two ways for ever; so do wrong poses of the right one in noise, a little.
  const bool are_several = hypotheses_.size() > 1;
  const int least = are_several ? kFramesOfTwoShapes : kFramesOfShape;
  const bool is_misfit = std::all_of(hypotheses_.begin(), hypotheses_.end(), [&](const Hypothesis& any) {
    return any.shape.frames() >= least && shows_another(any, are_several ? kClearMisfit : 1);
  });
  if (hypotheses_.size() != 1 && !is_misfit) return;
  now_.T_world_model = h.filter.pose();
  now_.covariance = h.filter.covariance();
  now_.two_sigma_m = two_sigma_m(h);
  now_.missing = h.fit.missing;
  ++frames_;
  double displacement_m = 0;
  for (std::size_t i = 0; i < model_.edge_m.size(); ++i) {
    now_.edge_m.push_back(vec_cast<float>(now_.T_world_model * vec_cast<double>(model_.edge_m[i])));
    if (!last_edge_m_.empty())
      displacement_m =
          std::max(displacement_m, static_cast<double>(length(now_.edge_m[i] - last_edge_m_[i])));
  }
  // Twins of a tool of another shape are not asked for: anything fits it as badly.
  if (is_misfit)
    now_.state = BladeState::misfit;
  else if (is_twin_)
    now_.state = h.shape.frames() < kFramesOfShape ? BladeState::ambiguous : BladeState::twins;
  else
    now_.state = state_of(h, displacement_m);
  if (now_.state == BladeState::misfit) ++unexplained_frames_;
  if (now_.state < BladeState::jumped) return;
  unexplained_frames_ = 0;
  since_known_s_ = 0;
  last_edge_m_ = now_.edge_m;
}

/// A pose that is known to few millimetres may be that of another shape: it is asked first.
bool BladeTracker::shows_another(const Hypothesis& h, double times) const {
  const double most_px = settings_.most_misfit_px + settings_.most_misfit_of_noise * h.fit.rms_px;
  return h.shape.misfit_px() > times * most_px || h.shape.edge_covered() > kMostCovered;
}

BladeState BladeTracker::state_of(const Hypothesis& h, double displacement_m) const {
  if (h.lost_frames > 0 || frames_ < 3 || h.fit.gone > kMostGone || now_.two_sigma_m > settings_.two_sigma_m)
    return BladeState::unsure;
  if (!last_edge_m_.empty() && displacement_m > settings_.most_m_s * since_known_s_)
    return BladeState::jumped;
  return BladeState::known;
}

TriangleMesh BladeTracker::posed() const {
  TriangleMesh mesh = model_.mesh;
  const Rigidd& T = hypotheses_.front().filter.pose();
  for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(T * vec_cast<double>(p));
  return mesh;
}

/// Faces that look away are left out: the others cover the same pixels.
TriangleMesh BladeTracker::facing(const TriangleMesh& posed, const Camera& camera) const {
  TriangleMesh mesh;
  mesh.positions_m = posed.positions_m;
  mesh.triangles.reserve(posed.triangles.size());
  const Vec3d eye_m = inverse(camera.T_cam_world * hypotheses_.front().filter.pose()).t;
  for (std::size_t f = 0; f < posed.triangles.size(); ++f)
    if (dot(mesh_.normals[static_cast<Index>(f)], eye_m) > mesh_.offsets_m[f])
      mesh.triangles.push_back(posed.triangles[f]);
  return mesh;
}

BladeTracker::Part BladeTracker::part(const TriangleMesh& posed, std::size_t camera, int around_px) const {
  Camera of = cameras_[camera];
  Vec2d low{1e9, 1e9}, high{-1e9, -1e9};
  for (const Vec3d& corner_m : mesh_.box_m) {
    const Pixel at = project(of, hypotheses_.front().filter.pose() * corner_m);
    if (!(at.z_m > 0)) return {};
    low = {std::min(low.x, at.u_px), std::min(low.y, at.v_px)};
    high = {std::max(high.x, at.u_px), std::max(high.y, at.v_px)};
  }
  const auto within = [&](double x, Index size) {
    return static_cast<Index>(std::clamp(x, 0.0, static_cast<double>(size)));
  };
  const double around = around_px;
  Part part{within(low.x - around, of.width_px) / 32, within(low.y - around, of.height_px), {}};
  of.cx_px -= 32 * part.first_word;
  of.cy_px -= part.first_row;
  of.width_px = within(high.x + around, of.width_px) - 32 * part.first_word;
  of.height_px = within(high.y + around, of.height_px) - part.first_row;
  if (of.width_px < 1 || of.height_px < 1) return {};
  grow_mask(render_silhouette(facing(posed, of), of), kBeside_px, part.own);
  return part;
}

void BladeTracker::add_to(std::span<BitMask> masks) const {
  if (hypotheses_.empty()) return;
  const TriangleMesh mesh = posed();
  cpu_for(masks.size(), 1, [&](std::size_t c) {
    if (masks[c].words.empty()) return;
    const Part shown = part(mesh, c, kBeside_px + 1);
    for (Index y = 0; y < shown.own.height_px; ++y)
      for (Index w = 0; w < shown.own.words_per_row(); ++w)
        word_at(masks[c], shown.first_word + w, shown.first_row + y) |= word_at(shown.own, w, y);
  });
}

void BladeTracker::take_from(std::span<BitMask> masks) const {
  if (hypotheses_.empty() || now_.state == BladeState::misfit || is_twin_) return;
  const TriangleMesh mesh = posed();
  cpu_for(masks.size(), 1, [&](std::size_t c) {
    if (masks[c].words.empty()) return;
    const Part shown = part(mesh, c, kBeside_px + 2 * radius_px_[c] + 3);
    BitMask near(shown.own.width_px, shown.own.height_px);
    const auto last_bits = near.width_px % 32 == 0 ? ~0U : (1U << (near.width_px % 32)) - 1;
    for (Index y = 0; y < near.height_px; ++y) {
      for (Index w = 0; w < near.words_per_row(); ++w)
        word_at(near, w, y) = word_at(masks[c], shown.first_word + w, shown.first_row + y) &
                              (w + 1 < near.words_per_row() ? ~0U : last_bits);
    }
    if (near.words.empty()) return;
    const BitMask thin = thin_pixels(near, radius_px_[c]);
    for (Index y = 0; y < near.height_px; ++y)
      for (Index w = 0; w < near.words_per_row(); ++w)
        word_at(masks[c], shown.first_word + w, shown.first_row + y) &=
            ~(word_at(shown.own, w, y) & word_at(thin, w, y));
  });
}

}  // namespace tactus
