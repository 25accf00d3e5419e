#include "tactus/cli/output/texture_output.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/cli/output/sheet_colors.h"
#include "tactus/geom/maths/symmetric_eigen.h"
#include "tactus/reconstruct/texture/photo_atlas.h"
#include "tactus/reconstruct/texture/seam_levelling.h"
#include "tactus/view/renderer.h"

namespace tactus {
namespace {

constexpr Index kShot_px = 250;

/// Turns the world so that up is up: data sets have their own. Rigs are rings, so up is the ring's axis,
/// where there is one; its sign is that of the cameras' mean up direction or, when the photos lie on their
/// side, that of the side that the cameras look from.
Mat3f upright(const Rig& rig) {
  const auto count = static_cast<double>(rig.cameras.size());
  Vec3d up{}, middle{};
  for (const Camera& camera : rig.cameras) {
    up -= 1 / count * camera.T_cam_world.R.row[1];
    middle += 1 / count * camera.center_world();
  }
  Mat3d spread = Mat3d::zero();
  for (const Camera& camera : rig.cameras)
    spread = spread + outer(camera.center_world() - middle, camera.center_world() - middle);
  const SymmetricEigen ring = symmetric_eigen(spread);
  if (ring.values.z < 0.3 * ring.values.y) {
    const Vec3d axis = ring.vectors.row[2];
    const Vec3d center = vec_cast<double>(0.5F * (rig.workspace_m.min + rig.workspace_m.max));
    const double side = std::abs(dot(axis, up)) > 0.3 ? dot(axis, up) : dot(axis, middle - center);
    up = (side < 0 ? -1.0 : 1.0) * axis;
  }
  const Vec3f y = vec_cast<float>(normalized(up, Vec3d{0, 1, 0}));
  const Vec3f x = normalized(cross(y, std::abs(y.z) < 0.9F ? Vec3f{0, 0, 1} : Vec3f{1, 0, 0}));
  return {{x, y, cross(x, y)}};
}

/// Looks at all of the mesh from that side, as near as it fits a square.
ViewCamera near_view(const TriangleMesh& mesh, float azimuth_rad, float elevation_rad) {
  ViewCamera camera = frame_box(bounds(mesh), azimuth_rad, elevation_rad, 1.F);
  const Mat3f R = camera.T_cam_world().R;
  const float tangent = 0.95F * std::tan(0.5F * camera.fov_rad);
  float distance_m = 0;
  for (const Vec3f p : mesh.positions_m) {
    const Vec3f q = R * (p - camera.target_m);
    distance_m = max(distance_m, q.z + max(std::abs(q.x), std::abs(q.y)) / tangent);
  }
  if (distance_m > 0) camera.distance_m = distance_m;
  return camera;
}

void paste(const ColorImage& from, ColorImage& to, Index x0, Index y0) {
  for (Index y = 0; y < from.height_px; ++y) {
    for (Index x = 0; x < from.width_px; ++x) to(x0 + x, y0 + y) = from(x, y);
  }
}

}  // namespace

TextureOutput::TextureOutput(DeviceSet& devices, const Rig& rig, const VisualHull& hull,
                             const Box3f& workspace_m, Index k)
    : devices_(devices),
      rig_(rig),
      workspace_m_(workspace_m),
      voxel_size_m_(hull.voxel_size_m()),
      k_(k),
      texture_(devices.context(0), rig.cameras,
               {.k = k,
                .voxel_size_m = hull.voxel_size_m(),
                .center_m = workspace_m.center(),
                .max_vertices = hull.mesh().positions_m.size(),
                .max_triangles = hull.mesh().triangles.size(),
                .fill_steps = 8}) {}

void TextureOutput::shade(const FrameSet& frame, const MeshView& surface, View<const Vec3f> normals) {
  if (frame.colors.empty())
    throw Error(
        "--texture: the source has no photos (masks need a 'photo' beside each 'mask' in the rig file)");
  ExecContext& ctx = devices_.context(0);
  texture_.upload(ctx, frame.colors);
  texture_.shade(ctx, surface, normals);
}

std::vector<Rgb8> TextureOutput::colors(Index vertices) const {
  return to_rgb(to_host(devices_.context(0), texture_.colors().part(0, vertices)));
}

TexturedMesh TextureOutput::textured(const FrameSet& frame, const MeshView& surface,
                                     View<const Vec3f> normals, const TriangleMesh& mesh) {
  ExecContext& ctx = devices_.context(0);
  texture_.choose(ctx, surface, normals);
  const std::vector<Index> cameras =
      to_host(ctx, texture_.triangle_cameras().part(0, static_cast<Index>(mesh.triangles.size())));
  TexturedMesh textured = make_photo_atlas(mesh, cameras, colors(static_cast<Index>(mesh.positions_m.size())),
                                           rig_.cameras, frame.colors);
  const SeamSteps steps = level_seams(textured);
  log_debug("texture: " + std::to_string(steps.seams) + " places on seams, whose sides differed by " +
            std::to_string(100 * steps.before) + " %, now by " + std::to_string(100 * steps.after) + " %");
  return textured;
}

ColorImage TextureOutput::picture(const MeshView& surface, View<const Vec3f> normals,
                                  const TriangleMesh& mesh) {
  const Mat3f R_view_world = upright(rig_);
  TriangleMesh turned = mesh;
  for (Vec3f& p : turned.positions_m) p = R_view_world * p;
  ViewScene scene;
  scene.ground = false;
  scene.background = kPaper;
  const auto vertices = static_cast<Index>(mesh.positions_m.size());
  ViewMesh view{.name = "hull", .colors = colors(vertices), .R_world_mesh = R_view_world};
  view.device =
      DeviceSurface{.ctx = &devices_.context(0),
                    .positions_m = surface.positions_m.part(0, vertices),
                    .normals = normals.part(0, vertices),
                    .triangles = surface.triangles.part(0, static_cast<Index>(mesh.triangles.size())),
                    .box_m = bounds(mesh),
                    .photos = texture_.photos(),
                    .live_photos = texture_.live_photos()};
  scene.meshes.push_back(std::move(view));
  Renderer renderer({.width_px = kShot_px, .height_px = kShot_px, .samples = 4, .shadow_map_px = 0});
  log_debug("the surface for OpenGL: " + Renderer::sharing(devices_.device(0)));
  static constexpr float kAzimuths_rad[] = {0.4F, 2.5F, 4.6F};
  ColorImage sheet(3 * kShot_px, 2 * kShot_px), cell;
  for (const Index row : {0, 1}) {
    const Index k = row == 0 ? 1 : k_;
    scene.meshes.front().photos = std::make_shared<ViewPhotos>(ViewPhotos{.cameras = rig_.cameras,
                                                                          .images = {},
                                                                          .k = k,
                                                                          .voxel_size_m = voxel_size_m_,
                                                                          .center_m = workspace_m_.center()});
    for (Index column = 0; column < 3; ++column) {
      renderer.render(scene, near_view(turned, kAzimuths_rad[column], 0.3F), cell);
      draw_text(cell, "k = " + std::to_string(k), 10, kShot_px - 10, 15);
      paste(cell, sheet, column * kShot_px, row * kShot_px);
    }
  }
  return sheet;
}

}  // namespace tactus
