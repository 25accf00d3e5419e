#include "tactus/reconstruct/texture/surface_texture.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/reconstruct/normal_kernels.h"
#include "tactus/reconstruct/texture/atlas_kernels.h"

namespace tactus {
namespace {

void check_capacity(const char* what, const MeshView& mesh, Index capacity) {
  if (mesh.positions_m.size() > capacity)
    throw Error(std::string(what) + ": the mesh has capacity for " + std::to_string(mesh.positions_m.size()) +
                " vertices, max_vertices is " + std::to_string(capacity));
}

void check_k(Index k, std::size_t cameras) {
  const Index most = std::min(static_cast<Index>(cameras), Index{PhotoChoice::kMostBlended});
  if (k >= 1 && k <= most) return;
  throw usage_error("texture: k = " + std::to_string(k) + " cameras a vertex, expected 1 to " +
                    std::to_string(most) + " (of " + std::to_string(cameras) + " cameras)");
}

TextureCamera device_camera(const Camera& camera) {
  TextureCamera out{};
  set_projection(out, camera);
  out.eye_m = vec_cast<float>(camera.center_world());
  out.axis = vec_cast<float>(camera.axis_world());
  return out;
}

}  // namespace

SurfaceNormals::SurfaceNormals(Device& device, Index max_vertices)
    : sums_(device, max_vertices), normals_(device, max_vertices) {}

void SurfaceNormals::compute(ExecContext& ctx, const MeshView& mesh, float edge_m, int smoothing_steps) {
  check_capacity("normals", mesh, normals_.size());
  if (!(edge_m > 0)) throw Error("normals: edge_m is " + std::to_string(edge_m) + ", must be > 0");
  const Count vertices = mesh.vertex_count, triangles = mesh.triangle_count;
  ctx.fill_bytes(sums_.view(), 0);
  ctx.parallel_for("normals/faces", triangles,
                   AddFaceNormals{mesh.positions_m, mesh.triangles, 1.F / (edge_m * edge_m), sums_.view()});
  ctx.parallel_for("normals/normalize", vertices, NormalizeSums{sums_.const_view(), normals_.view()});
  for (int i = 0; i < smoothing_steps; ++i) {
    ctx.fill_bytes(sums_.view(), 0);
    ctx.parallel_for("normals/smooth", triangles,
                     AddCornerNormals{normals_.const_view(), mesh.triangles, sums_.view()});
    ctx.parallel_for("normals/normalize", vertices, NormalizeSums{sums_.const_view(), normals_.view()});
  }
}

SurfaceTexture::SurfaceTexture(ExecContext& ctx, std::span<const Camera> cameras,
                               const TextureOptions& options)
    : options_(options), cameras_(cameras.begin(), cameras.end()) {
  if (cameras.empty() || cameras.size() > kMaxCameras)
    throw Error("texture: " + std::to_string(cameras.size()) + " cameras, expected 1 to " +
                std::to_string(kMaxCameras));
  check_k(options.k, cameras.size());
  if (!(options.voxel_size_m > 0))
    throw Error("texture: voxel_size_m is " + std::to_string(options.voxel_size_m) + ", must be > 0");
  std::int64_t photo_pixels = 0, map_texels = 0;
  std::vector<Vec2i> map_rows;
  for (const Camera& camera : cameras) {
    check_camera(camera);
    TextureCamera c = device_camera(camera);
    const float texel = PhotoChoice::texel_px(camera, options.voxel_size_m, options.center_m);
    c.texels_per_px = 1 / texel;
    const auto texels = [texel](Index pixels) {
      return static_cast<Index>(std::ceil(static_cast<float>(pixels) / texel)) + 2;
    };
    c.map_width = texels(camera.width_px);
    c.map_height = texels(camera.height_px);
    c.photo_begin = static_cast<Index>(photo_pixels);
    c.map_begin = static_cast<Index>(map_texels);
    photo_pixels += std::int64_t{camera.width_px} * camera.height_px;
    map_texels += std::int64_t{c.map_width} * c.map_height;
    if (photo_pixels >= std::int64_t{1} << 31)
      throw Error("texture: the photos have more pixels in all than can be indexed");
    for (Index y = 0; y < c.map_height; ++y) map_rows.push_back({static_cast<Index>(layout_.size()), y});
    layout_.push_back(c);
  }
  Device& device = ctx.device();
  device_cameras_ = to_device(ctx, layout_);
  photos_ = Buffer<Rgb8>(device, photo_pixels);
  staging_ = HostBuffer<Rgb8>(device, photo_pixels);
  map_rows_ = to_device(ctx, map_rows);
  widened_ = Buffer<std::uint32_t>(device, map_texels);
  maps_ = Buffer<std::uint32_t>(device, map_texels);
  colors_ = Buffer<std::uint32_t>(device, options.max_vertices);
  sums_ = Buffer<std::uint64_t>(device, options.max_vertices);
  triangle_cameras_ = Buffer<Index>(device, options.max_triangles);
}

void SurfaceTexture::upload(ExecContext& ctx, std::span<const ColorImage> photos) {
  if (photos.size() != cameras_.size())
    throw Error("texture: " + std::to_string(photos.size()) + " photos for " +
                std::to_string(cameras_.size()) + " cameras");
  for (std::size_t c = 0; c < photos.size(); ++c) {
    const Camera& camera = cameras_[c];
    if (photos[c].empty() ||
        (photos[c].width_px == camera.width_px && photos[c].height_px == camera.height_px))
      continue;
    throw Error("camera '" + camera.name + "': the photo has " + std::to_string(photos[c].width_px) + "x" +
                std::to_string(photos[c].height_px) + " pixels, its calibration says " +
                std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px));
  }
  ctx.synchronize();  // the staging memory may still be on its way from the last frame
  live_ = 0;
  for (std::size_t c = 0; c < photos.size(); ++c) {
    if (photos[c].empty()) continue;
    live_ |= camera_bit(static_cast<int>(c));
    std::copy(photos[c].pixels.begin(), photos[c].pixels.end(), staging_.data() + layout_[c].photo_begin);
  }
  ctx.upload(staging_.span(), photos_.view());
}

void SurfaceTexture::shade(ExecContext& ctx, const MeshView& mesh, View<const Vec3f> normals,
                           std::optional<Vec3f> eye_m) {
  check_capacity("texture", mesh, colors_.size());
  const Count vertices = mesh.vertex_count, triangles = mesh.triangle_count;
  ctx.fill_bytes(maps_.view(), 0);
  ctx.parallel_for(
      "texture/depth_maps", ceil_div(vertices.capacity, DrawDepthMaps::kThreads),
      DrawDepthMaps{device_cameras_.const_view(), mesh.positions_m, normals, vertices, maps_.view()});
  ctx.parallel_for("texture/widen", map_rows_.size(),
                   WidenDepthMaps{device_cameras_.const_view(), map_rows_.const_view(), maps_.const_view(),
                                  widened_.view()});
  ctx.parallel_for("texture/outlines", map_rows_.size(),
                   MarkOutlines{device_cameras_.const_view(), map_rows_.const_view(), widened_.const_view(),
                                maps_.view()});
  ctx.parallel_for(
      "texture/colors", ceil_div(vertices.capacity, ColorVertices::kThreads),
      ColorVertices{device_cameras_.const_view(), mesh.positions_m, normals, vertices,
                    PhotoScore{maps_.const_view(), PhotoChoice::kBiasVoxels * options_.voxel_size_m,
                               options_.k == 1 ? 1.F : 0.F},
                    photos_.const_view(), live_, eye_m.has_value(), eye_m.value_or(Vec3f{}), options_.k,
                    colors_.view()});
  if (options_.fill_steps > 0) ctx.fill_bytes(sums_.view(), 0);
  for (int i = 0; i < options_.fill_steps; ++i) {
    ctx.parallel_for("texture/neighbours", triangles,
                     AddNeighbourColors{mesh.triangles, colors_.const_view(), sums_.view()});
    ctx.parallel_for("texture/fill", vertices, FillColors{sums_.view(), colors_.view()});
  }
}

void SurfaceTexture::choose(ExecContext& ctx, const MeshView& mesh, View<const Vec3f> normals) {
  if (mesh.triangles.size() > triangle_cameras_.size())
    throw Error("texture: the mesh has capacity for " + std::to_string(mesh.triangles.size()) +
                " triangles, max_triangles is " + std::to_string(triangle_cameras_.size()));
  const PhotoScore score{maps_.const_view(), PhotoChoice::kBiasVoxels * options_.voxel_size_m, 0};
  ctx.parallel_for("texture/triangles", mesh.triangle_count,
                   ChooseTrianglePhotos{device_cameras_.const_view(), mesh.positions_m, normals,
                                        mesh.triangles, score, live_, triangle_cameras_.view()});
}

std::vector<Rgb8> to_rgb(std::span<const std::uint32_t> packed) {
  std::vector<Rgb8> colors;
  colors.reserve(packed.size());
  for (const std::uint32_t c : packed) {
    const auto byte = [c](int shift) { return static_cast<std::uint8_t>(c >> shift & 0xFFU); };
    colors.push_back(c == 0 ? Rgb8{128, 128, 128} : Rgb8{byte(0), byte(8), byte(16)});
  }
  return colors;
}

}  // namespace tactus
