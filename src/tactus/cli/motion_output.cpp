#include "tactus/cli/motion_output.h"

#include <cmath>

#include "tactus/rig/synthetic_source.h"

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

}  // namespace

void MotionOutput::add(const TriangleMesh& mesh, const FrameSet& frame, const FrameSource& source,
                       nlohmann::json& row) {
  MeshComponents components = find_components(mesh);
  tracker_.update(components);
  const double dt_s = last_time_s_ ? frame.time_s - *last_time_s_ : 0;
  last_time_s_ = frame.time_s;
  const std::span<const PieceMotion> motions = velocity_.update(mesh, components, dt_s);
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t i = 0; i < components.pieces.size(); ++i) {
    const MeshComponent& p = components.pieces[i];
    list.push_back({{"label", p.label},
                    {"vertices", p.vertices},
                    {"triangles", p.triangles},
                    {"volume_m3", p.volume_m3},
                    {"area_m2", p.area_m2},
                    {"centroid_m", to_json(p.centroid_m)},
                    {"axes", {to_json(p.axes.row[0]), to_json(p.axes.row[1]), to_json(p.axes.row[2])}},
                    {"extent_m", to_json(p.extent_m)},
                    {"velocity_m_s", to_json(motions[i].at(p.centroid_m))},
                    {"spin_rad_s", to_json(motions[i].spin_rad_s)},
                    {"velocity_source", to_string(motions[i].source)}});
  }
  row["pieces"] = std::move(list);
  const auto* synthetic = dynamic_cast<const SyntheticSource*>(&source);
  if (synthetic != nullptr && dt_s > 0)
    compare(mesh, vertex_velocities(mesh, components, motions), synthetic->figure(), frame.time_s,
            voxel_size_m_, row);
}

}  // namespace tactus
