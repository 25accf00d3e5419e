#include "tactus/cli/info_file.h"

#include <cmath>
#include <cstdio>
#include <map>

#include "tactus/base/error.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/geom/mesh/point_box.h"
#include "tactus/io/labels/label_file.h"
#include "tactus/io/mesh/mesh_file.h"

namespace tactus {
namespace {

nlohmann::json json_of(Vec3d v) { return {v.x, v.y, v.z}; }

void print_box(const char* name, const PointBox& box) {
  const Vec3d size = box.extent();
  std::printf("%-12s (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g) m, size %.6g x %.6g x %.6g m\n", name,
              box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z, size.x, size.y, size.z);
}

nlohmann::json print_mesh(const std::string& path, double unit_m) {
  const ImportedMesh imported = import_mesh(path, unit_m);
  const TriangleMesh& mesh = imported.mesh;
  const MeshTopology t = topology(mesh);
  const EdgeDefects edges = find_edge_defects(mesh);
  const SelfCrossings crossings = find_self_crossings(mesh);
  PointBox box;
  for (const Vec3f p : mesh.positions_m) box.add(vec_cast<double>(p) + imported.origin_m);
  const double volume = volume_m3(mesh), area = area_m2(mesh);
  std::printf("%-12s %zu vertices, %zu triangles\n", "mesh", mesh.positions_m.size(), mesh.triangles.size());
  print_box("bounds", box);
  std::printf("%-12s %.6g m^3 (%.6g l), surface %.6g m^2%s\n", "volume", volume, 1e3 * volume, area,
              !edges.bounds_solid() ? "; of no solid" : (volume < 0 ? "; its triangles face inwards" : ""));
  std::printf("%-12s %lld\n", "open edges", static_cast<long long>(edges.open.count));
  std::printf("%-12s %lld\n", "pieces", static_cast<long long>(t.components));
  if (!edges.bounds_solid()) std::printf("%-12s %s\n", "no solid", edges.text().c_str());
  if (edges.crowded.count > 0)
    std::printf("%-12s %lld edges of more than two triangles\n", "no manifold",
                static_cast<long long>(edges.crowded.count));
  if (crossings.pairs > 0)
    std::printf("%-12s %lld pairs of triangles cross\n", "overlaps", static_cast<long long>(crossings.pairs));
  if (!(imported.origin_m == Vec3d{}))
    std::printf("%-12s its middle is taken as its origin: it lies %.4g km from that of its file\n", "far",
                1e-3 * length(imported.origin_m));
  return {{"kind", "mesh"},
          {"vertices", mesh.positions_m.size()},
          {"triangles", mesh.triangles.size()},
          {"min_m", json_of(box.min)},
          {"max_m", json_of(box.max)},
          {"volume_m3", volume},
          {"area_m2", area},
          {"open_edges", edges.open.count},
          {"bounds_solid", edges.bounds_solid()},
          {"crossing_pairs", crossings.pairs},
          {"pieces", t.components}};
}

/// Voxels of one label.
struct LabelCount {
  std::int64_t voxels = 0;
  Vec3i min{1 << 30, 1 << 30, 1 << 30}, max{-1, -1, -1};
};

/// In the body's coordinates, around the voxels of the label.
PointBox box_of(const LabelVolume& volume, const LabelCount& label) {
  PointBox box;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3d p;
    for (int k = 0; k < 3; ++k)
      p[k] = double{volume.origin_m[k]} +
             double{volume.voxel_size_m[k]} * ((corner >> k & 1) != 0 ? label.max[k] + 1 : label.min[k]);
    box.add(volume.R_body_volume * p);
  }
  return box;
}

nlohmann::json print_labels(const std::string& path) {
  const LabelVolume volume = read_label_volume(path);
  const Vec3d size = vec_cast<double>(volume.voxel_size_m);
  std::map<int, LabelCount> labels;
  std::size_t i = 0;
  for (Index z = 0; z < volume.dims.z; ++z) {
    for (Index y = 0; y < volume.dims.y; ++y) {
      for (Index x = 0; x < volume.dims.x; ++x) {
        const int number = volume.labels[i++];
        if (number == 0) continue;
        LabelCount& label = labels[number];
        ++label.voxels;
        label.min = min(label.min, Vec3i{x, y, z});
        label.max = max(label.max, Vec3i{x, y, z});
      }
    }
  }
  std::printf("%-12s %d x %d x %d voxels of %.4g x %.4g x %.4g mm\n", "labels", volume.dims.x, volume.dims.y,
              volume.dims.z, 1e3 * size.x, 1e3 * size.y, 1e3 * size.z);
  nlohmann::json list = nlohmann::json::array();
  for (const auto& [number, label] : labels) {
    const double volume_m3 = static_cast<double>(label.voxels) * size.x * size.y * size.z;
    const PointBox box = box_of(volume, label);
    std::printf("\n%-12s %d\n%-12s %.6g m^3 (%.6g l)\n", "label", number, "volume", volume_m3,
                1e3 * volume_m3);
    print_box("bounds", box);
    list.push_back({{"label", number},
                    {"volume_m3", volume_m3},
                    {"min_m", json_of(box.min)},
                    {"max_m", json_of(box.max)}});
  }
  return {{"kind", "labels"},
          {"dims", {volume.dims.x, volume.dims.y, volume.dims.z}},
          {"voxel_size_m", json_of(size)},
          {"labels", list}};
}

}  // namespace

nlohmann::json print_file_info(const std::string& path, double unit_m) {
  if (is_mesh_path(path)) return print_mesh(path, unit_m);
  if (is_label_volume(path)) return print_labels(path);
  const bool is_yaml = path.ends_with(".yaml") || path.ends_with(".yml");
  throw Error(path + ": no mesh and no label volume, expected " + kLabelFormats +
              ", or a mesh: " + mesh_endings(path) +
              (is_yaml ? " (a scene: info --frame or --parameters; a rig: doctor)" : ""));
}

}  // namespace tactus
