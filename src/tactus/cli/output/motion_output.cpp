#include "tactus/cli/output/motion_output.h"

#include <algorithm>
#include <cmath>

#include "tactus/geom/figures/figures.h"

namespace tactus {
namespace {

nlohmann::json to_json(Vec3d v) { return {v.x, v.y, v.z}; }

/// Against the known motion of a figure: every vertex of a small mesh, some thousand of a large one.
void compare(const TriangleMesh& mesh, std::span<const Vec3f> velocities, const Figure& figure, double time_s,
             float near_m, nlohmann::json& row) {
  const FigureShape shape = figure.at(time_s);
  double error = 0, truth = 0;
  std::size_t n = 0;
  const std::size_t stride = mesh.positions_m.size() / 4000 + 1;
  for (std::size_t i = 0; i < mesh.positions_m.size(); i += stride) {
    if (shape.distance_m(mesh.positions_m[i]) > near_m) continue;
    const Vec3f expected = figure.velocity_m_s(mesh.positions_m[i], time_s), off = velocities[i] - expected;
    error += static_cast<double>(dot(off, off));
    truth += static_cast<double>(dot(expected, expected));
    ++n;
  }
  if (n == 0) return;
  row["velocity_rms"] = std::sqrt(error / static_cast<double>(n));
  row["speed_rms"] = std::sqrt(truth / static_cast<double>(n));
}

const char* text(MotionSource source) {
  switch (source) {
    case MotionSource::centroid:
      return "centroid";
    case MotionSource::rigid:
      return "rigid";
    case MotionSource::carried:
      return "carried";
    case MotionSource::too_fast:
      return "too fast";
    default:
      return "still";
  }
}

}  // namespace

/// Large surfaces have capacity for many times their mesh: the tracker's capacity follows the mesh.
std::vector<Index> MotionOutput::track(const MeshView& surface, const TriangleMesh& mesh, double dt_s) {
  static constexpr Index kSmall = 1 << 20;
  const auto vertices = static_cast<Index>(mesh.positions_m.size());
  const Index triangles = std::min(
      surface.triangles.size(), to_host(ctx_, View<const Index>(surface.triangle_count.device_count, 1))[0]);
  MeshView part = surface;
  part.positions_m = surface.positions_m.part(0, std::max(vertices, Index{1}));
  part.triangles = surface.triangles.part(0, std::max(triangles, Index{1}));
  if (!surface.normals.empty()) part.normals = surface.normals.part(0, std::max(vertices, Index{1}));
  const bool has_capacity = tracker_ && tracker_->settings().max_vertices >= vertices &&
                            tracker_->settings().max_triangles >= triangles;
  if (!has_capacity) {
    const auto capacity = [](Index count, Index most) {
      return std::max(std::min(most, std::max(count + count / 2, kSmall)), Index{1});
    };
    const Index most = capacity(triangles, surface.triangles.size());
    tracker_.emplace(ctx_.device(),
                     RealSurfaceSettings{.sample_spacing_m = voxel_size_m_,
                                         .max_vertices = capacity(vertices, surface.positions_m.size()),
                                         .max_triangles = most,
                                         .max_raw_samples = std::max(2 * most, 1 << 18),
                                         .max_samples = std::max(most, 1 << 16)});
  }
  tracker_->update(ctx_, part, static_cast<float>(dt_s));
  report_ = tracker_->report(ctx_);
  return tracker_->vertex_components(ctx_, vertices);
}

nlohmann::json MotionOutput::describe(MeshComponent p, Index tracked) {
  const bool is_tracked = tracked != kNoComponent;
  const auto of = static_cast<std::size_t>(std::max(tracked, Index(0)));
  const SurfaceMotion& motion = report_.motions.at(of);
  const Index label = is_tracked ? report_.components.component[of].label : -1;
  if (is_tracked) {
    if (const auto before = axes_.find(label); before != axes_.end())
      p.axes = with_signs_of(before->second, p.axes);
    axes_[label] = p.axes;
  }
  return {{"label", label},
          {"vertices", p.vertices},
          {"triangles", p.triangles},
          {"volume_m3", p.volume_m3},
          {"area_m2", p.area_m2},
          {"centroid_m", to_json(p.centroid_m)},
          {"axes", {to_json(p.axes.row[0]), to_json(p.axes.row[1]), to_json(p.axes.row[2])}},
          {"extent_m", to_json(p.extent_m)},
          {"velocity_m_s", to_json(vec_cast<double>(motion.velocity_at(vec_cast<float>(p.centroid_m), 0)))},
          {"spin_rad_s", to_json(vec_cast<double>(motion.spin_rad_s))},
          {"velocity_source", is_tracked ? text(motion.source) : "borrowed"}};
}

void MotionOutput::add(const MeshView& surface, const TriangleMesh& mesh, const FrameSet& frame,
                       const FrameSource& source, nlohmann::json& row) {
  const double dt_s = last_time_s_ ? frame.time_s - *last_time_s_ : 0;
  last_time_s_ = frame.time_s;
  const std::vector<Index> tracked = track(surface, mesh, dt_s);
  const MeshComponents components = find_components(mesh);
  std::vector<Index> number(components.components.size(), kNoComponent);
  for (std::size_t v = 0; v < tracked.size(); ++v) {
    if (components.of_vertex[v] >= 0) number[static_cast<std::size_t>(components.of_vertex[v])] = tracked[v];
  }
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t i = 0; i < components.components.size(); ++i)
    list.push_back(describe(components.components[i], number[i]));
  row["motions"] = std::move(list);
  const Figure* truth = source.truth();
  if (truth == nullptr || !(dt_s > 0)) return;
  std::vector<Vec3f> velocities;
  for (std::size_t v = 0; v < tracked.size(); ++v)
    velocities.push_back(report_.motions.at(static_cast<std::size_t>(std::max(tracked[v], Index(0))))
                             .velocity_at(mesh.positions_m[v], 0));
  compare(mesh, velocities, *truth, frame.time_s, voxel_size_m_, row);
}

}  // namespace tactus
