#include "tactus/cli/run_pictures.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/safe_file.h"

namespace tactus {
namespace {

ViewCamera view_camera(const ViewCameraDescription& description) {
  constexpr double kRadPerDeg = 3.14159265358979323846 / 180;
  const Vec3d offset = description.eye() - description.target_m;
  const double distance = length(offset);
  ViewCamera camera;
  camera.target_m = vec_cast<float>(description.target_m);
  camera.distance_m = static_cast<float>(distance);
  camera.azimuth_rad = static_cast<float>(std::atan2(offset.x, offset.z));
  camera.elevation_rad = static_cast<float>(std::asin(offset.y / distance));
  camera.fov_rad = static_cast<float>(description.field_of_view_deg * kRadPerDeg);
  return camera;
}

/// The triangles of a mesh for which `chosen` is `value`, on the same vertices.
TriangleMesh part_of(const TriangleMesh& mesh, const std::vector<std::uint8_t>& chosen, std::uint8_t value) {
  TriangleMesh part{mesh.positions_m, mesh.normals, {}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (chosen[t] == value) part.triangles.push_back(mesh.triangles[t]);
  }
  return part;
}

constexpr Vec3f kElementColor{0.72F, 0.16F, 0.18F}, kMatchedColor{0.16F, 0.38F, 0.66F};

}  // namespace

RunPictures::RunPictures(const Scene& scene, const Rig& rig, float voxel_size_m, const std::string& stem,
                         double fps)
    : scene_(scene),
      renderer_({.width_px = scene.view.size_px.x, .height_px = scene.view.size_px.y}),
      camera_(view_camera(scene.view.camera)),
      sheet_path_(stem + ".png") {
  if (scene.output.video)
    video_ = std::make_unique<VideoWriter>(stem + ".mp4", scene.view.size_px.x, scene.view.size_px.y, fps);
  if (scene.output.contact_sheet) {
    output_is_writable(sheet_path_);
    sheet_ = std::make_unique<ContactSheet>(scene.name);
  }
  if (scene.view.show_frusta) {
    const float depth_m = 0.12F * length(rig.workspace_m.extent());
    for (const Camera& camera : rig.cameras) add_frustum(view_, camera, depth_m);
    for (const Camera& camera : rig.depth_cameras) add_frustum(view_, camera, depth_m, {0.62F, 0.35F, 0.20F});
  }
  add_box(view_, rig.workspace_m);
  if (scene.view.photographs > 0) {
    photos_ = std::make_shared<ViewPhotos>(
        ViewPhotos{.cameras = rig.cameras,
                   .images = {},
                   .k = std::min(scene.view.photographs, static_cast<int>(rig.cameras.size())),
                   .voxel_size_m = voxel_size_m,
                   .center_m = rig.workspace_m.center()});
  }
}

void RunPictures::show_models(std::vector<std::vector<std::uint8_t>> element_triangles) {
  element_triangles_ = std::move(element_triangles);
}

void RunPictures::add(FrameSnapshot snapshot, const std::vector<ColorImage>& photos,
                      const std::string& overlay, const std::string& caption) {
  view_.meshes.clear();
  view_.meshes.push_back({"real", std::move(snapshot.real), clay_material()});
  if (photos_ && !photos.empty()) {
    photos_->images = photos;
    view_.meshes.back().photos = photos_;
  }
  for (std::size_t b = 0; b < snapshot.bodies.size(); ++b) {
    Material material = soft_material();
    if (!element_triangles_.empty()) {
      for (const std::uint8_t elements : {std::uint8_t{0}, std::uint8_t{1}}) {
        material.color = elements != 0 ? kElementColor : kMatchedColor;
        view_.meshes.push_back(
            {scene_.bodies[b].name, part_of(snapshot.bodies[b], element_triangles_[b], elements), material});
      }
      continue;
    }
    material.color = vec_cast<float>(scene_.bodies[b].colour);
    view_.meshes.push_back({scene_.bodies[b].name, std::move(snapshot.bodies[b]), material});
  }
  renderer_.render(view_, camera_, picture_);
  if (sheet_) sheet_->add(picture_, caption);
  if (scene_.view.overlay) draw_text(picture_, overlay, 16, scene_.view.size_px.y - 16, 18);
  if (video_) video_->add(picture_);
  ++frames_;
}

void RunPictures::finish() {
  if (video_) video_->finish();
  if (sheet_ && frames_ > 0) write_png(sheet_path_, sheet_->image());
}

}  // namespace tactus
