#include "tactus/track/shape_evidence.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/math.h"

namespace tactus {
namespace {

constexpr double kEvidenceMemory = 0.9;   // from frame to frame
constexpr std::size_t kLeastOfPlace = 3;  // of a view, at a place
constexpr double kLeastViews = 2.5;       // at a place: fewer tell no mean from noise
constexpr double kNearEnd = 0.15;  // of the length: an edge that comes so near to an end has its tip there
constexpr double kMostOff_px = 4;

}  // namespace

ShapeEvidence::ShapeEvidence(const OutlineMesh& mesh, std::span<const Vec3f> edge_m)
    : axis_(long_axis(mesh)), center_m_(mesh.center_m), places_(kSlices * kSides), offs_px_(places_.size()) {
  double from_m = axis_.end_m, to_m = axis_.begin_m;
  for (const Vec3f p : edge_m) {
    const double along_m = dot(vec_cast<double>(p) - center_m_, axis_.direction);
    from_m = std::min(from_m, along_m);
    to_m = std::max(to_m, along_m);
  }
  const double length_m = axis_.end_m - axis_.begin_m;
  for (int s = 0; s < kSlices; ++s) {
    const double middle_m = axis_.begin_m + (s + 0.5) / kSlices * length_m;
    for (int side = 0; side < kSides; ++side)
      places_[static_cast<std::size_t>(s * kSides + side)].is_edge = middle_m > from_m && middle_m < to_m;
  }
  places_[1].is_tip = from_m < axis_.begin_m + kNearEnd * length_m;  // the first slice, facing back
  places_[(kSlices - 1) * kSides].is_tip = to_m > axis_.end_m - kNearEnd * length_m;
}

std::size_t ShapeEvidence::place_of(const Vec3d& at_m, const Vec3d& out) const {
  const double share =
      (dot(at_m - center_m_, axis_.direction) - axis_.begin_m) / (axis_.end_m - axis_.begin_m);
  const int slice = std::clamp(static_cast<int>(kSlices * share), 0, kSlices - 1);
  const double faces[3] = {dot(out, axis_.direction), dot(out, axis_.across[0]), dot(out, axis_.across[1])};
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(faces[k]) > std::abs(faces[axis])) axis = k;
  return static_cast<std::size_t>(slice * kSides + 2 * axis + (faces[axis] < 0 ? 1 : 0));
}

void ShapeEvidence::begin_frame() {
  ++frames_;
  for (Place& p : places_) {
    for (double* sum : {&p.covered, &p.gone, &p.gone_px, &p.seen}) *sum *= kEvidenceMemory;
    for (Place::View& view : p.views) view = {kEvidenceMemory * view.weight, kEvidenceMemory * view.sum_px};
  }
}

/// Adds the median of a view at each place: things near the tool reach into some of its points.
void ShapeEvidence::add(std::size_t number, const Camera& camera, const Rigidd& T,
                        std::span<const OutlineResidual> points) {
  for (std::vector<double>& offs : offs_px_) offs.clear();
  const Rigidd back = inverse(T);
  const Mat3d R_model_camera = back.R * transpose(camera.T_cam_world.R);
  for (const OutlineResidual& p : points) {
    const std::size_t k = place_of(back * p.at_m, R_model_camera * Vec3d{p.normal.x, p.normal.y, 0});
    Place& place = places_[k];
    if (p.kind == OutlineResidual::Kind::covered) {
      place.covered += 1;
    } else if (p.kind == OutlineResidual::Kind::gone) {
      place.gone += 1;
      place.gone_px += p.off_px;
    } else {
      place.seen += 1;
      offs_px_[k].push_back(std::clamp(p.off_px, -kMostOff_px, kMostOff_px));
    }
  }
  for (std::size_t k = 0; k < places_.size(); ++k) {
    std::vector<double>& offs = offs_px_[k];
    if (offs.size() < kLeastOfPlace) continue;
    const auto middle = offs.begin() + static_cast<std::ptrdiff_t>(offs.size() / 2);
    std::nth_element(offs.begin(), middle, offs.end());
    const auto weight = static_cast<double>(offs.size());
    std::vector<Place::View>& views = places_[k].views;
    if (views.size() <= number) views.resize(number + 1);
    views[number].weight += weight;
    views[number].sum_px += weight * *middle;
  }
}

std::optional<double> ShapeEvidence::common_px2(const Place& place, double& weight) {
  double sum_px = 0, squares = 0, spread_px2 = 0;
  weight = 0;
  for (const Place::View& view : place.views) {
    weight += view.weight;
    squares += view.weight * view.weight;
    sum_px += view.sum_px;
  }
  const double views = squares > 0 ? weight * weight / squares : 0;
  if (views < kLeastViews) return {};
  const double mean_px = sum_px / weight;
  for (const Place::View& view : place.views)
    if (view.weight > 0) spread_px2 += view.weight * sqr(view.sum_px / view.weight - mean_px);
  return mean_px * mean_px - spread_px2 / weight / (views - 1);
}

double ShapeEvidence::misfit_px() const {
  double sum_px2 = 0, all = 0;
  for (const Place& p : places_) {
    const double points = p.covered + p.gone + p.seen;
    if (2 * p.covered > points) continue;
    if (2 * p.gone > points) {
      sum_px2 += p.gone * sqr(p.gone_px / p.gone);
      all += p.gone;
      continue;
    }
    double weight = 0;
    const std::optional<double> common = common_px2(p, weight);
    if (!common) continue;
    sum_px2 += weight * *common;
    all += weight;
  }
  return all > 0 ? std::sqrt(std::max(sum_px2 / all, 0.0)) : 0;
}

double ShapeEvidence::edge_covered() const {
  double covered[2] = {0, 0}, all[2] = {0, 0};  // along the edge, at the tip
  for (const Place& p : places_) {
    for (const int k : {0, 1}) {
      if (k == 0 ? !p.is_edge : !p.is_tip) continue;
      covered[k] += p.covered;
      all[k] += p.covered + p.gone + p.seen;
    }
  }
  const auto share = [&](int k) { return all[k] > 0 ? covered[k] / all[k] : 0; };
  return std::max(share(0), share(1));
}

}  // namespace tactus
