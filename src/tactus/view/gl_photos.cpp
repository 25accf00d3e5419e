#include "tactus/view/gl_photos.h"

#include <algorithm>
#include <cmath>

#include "tactus/geom/camera/photo_choice.h"
#include "tactus/view/photo_shaders.h"
#include "tactus/view/shaders.h"

namespace tactus {
namespace {

/// PhotoChoice for GLSL.
const std::string& constants() {
  static const std::string text =
      "const int kMaxCameras = " + std::to_string(kMaxCameras) +
      ", kMostBlended = " + std::to_string(PhotoChoice::kMostBlended) +
      ";\nconst float kLeastCosine = " + std::to_string(PhotoChoice::kLeastCosine) +
      ", kFullCosine = " + std::to_string(PhotoChoice::kFullCosine) +
      ", kBorderPx = " + std::to_string(PhotoChoice::kBorderPx) +
      ", kOutlineWeight = " + std::to_string(PhotoChoice::kOutlineWeight) +
      ", kEpsilon = " + std::to_string(PhotoChoice::kEpsilon) + ";\n";
  return text;
}

GlTexture array_texture(GLenum format, GLint filter, Index width, Index height, Index layers) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
  glTextureStorage3D(name, 1, format, width, height, layers);
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, filter);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, filter);
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return GlTexture(name);
}

Index map_texels(Index pixels, float texel_px) {
  return static_cast<Index>(std::ceil(static_cast<float>(pixels) / texel_px)) + 2;
}

}  // namespace

GlPhotoPrograms::GlPhotoPrograms()
    : map("photo map", {shaders::kPhotoMapVertex}, {shaders::kPhotoMapFragment}),
      widen("photo map, widened", {shaders::kBackgroundVertex},
            {shaders::kPhotoMapTexel, shaders::kPhotoWidenFragment}),
      outline("photo map, outlines", {shaders::kBackgroundVertex},
              {shaders::kPhotoMapTexel, shaders::kPhotoOutlineFragment}),
      surface("photographed surface", {shaders::kSurfaceVertex},
              {constants().c_str(), shaders::kPhotoFragment}) {}

GlPhotos::GlPhotos() {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  framebuffer_ = GlFramebuffer(name);
}

/// Textures of the size that these photos need; those that fit are kept.
void GlPhotos::resize(const ViewPhotos& photos) {
  Index width = 0, height = 0, map_width = 0, map_height = 0;
  for (const Camera& c : photos.cameras) {
    const float texel = PhotoChoice::texel_px(c, photos.voxel_size_m, photos.center_m);
    width = std::max(width, c.width_px);
    height = std::max(height, c.height_px);
    map_width = std::max(map_width, map_texels(c.width_px, texel));
    map_height = std::max(map_height, map_texels(c.height_px, texel));
  }
  const auto layers = static_cast<Index>(photos.cameras.size());
  if (width != photo_width_ || height != photo_height_ || layers != layers_)
    photos_ = array_texture(GL_RGB8, GL_LINEAR, width, height, layers);
  if (map_width != map_width_ || map_height != map_height_ || layers != layers_) {
    drawn_ = array_texture(GL_R32F, GL_NEAREST, map_width, map_height, layers);
    widened_ = array_texture(GL_R32F, GL_NEAREST, map_width, map_height, layers);
    maps_ = array_texture(GL_RG32F, GL_NEAREST, map_width, map_height, layers);
  }
  photo_width_ = width;
  photo_height_ = height;
  map_width_ = map_width;
  map_height_ = map_height;
  layers_ = layers;
}

void GlPhotos::set_cameras(const ViewPhotos& photos, const Mat3f& R_world_mesh, CameraBits live) {
  const Mat3d R_mesh_world = transpose(mat_cast<double>(R_world_mesh));
  std::vector<float> texels;
  for (const Camera& c : photos.cameras)
    texels.push_back(PhotoChoice::texel_px(c, photos.voxel_size_m, photos.center_m));
  cameras_.clear();
  for (Camera c : photos.cameras) {
    c.T_cam_world.R = c.T_cam_world.R * R_mesh_world;
    const Projection p = projection(c);
    const float texel = texels[cameras_.size()];
    DeviceCamera d{};
    const auto put = [](float(&to)[4], Vec3d v, double w) {
      for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(v[i]);
      to[3] = static_cast<float>(w);
    };
    put(d.row_u, p.M.row[0], p.t.x);
    put(d.row_v, p.M.row[1], p.t.y);
    put(d.row_z, p.M.row[2], p.t.z);
    put(d.eye, c.center_world(), live >> cameras_.size() & 1);
    put(d.axis, c.axis_world(), 1.0 / static_cast<double>(texel));
    d.photo_width = static_cast<float>(c.width_px);
    d.photo_height = static_cast<float>(c.height_px);
    d.map_width = static_cast<float>(map_texels(c.width_px, texel));
    d.map_height = static_cast<float>(map_texels(c.height_px, texel));
    cameras_.push_back(d);
  }
  // The block has room for all cameras that the shader knows, in use or not.
  std::vector<DeviceCamera> block = cameras_;
  block.resize(static_cast<std::size_t>(kMaxCameras));
  camera_block_.upload(block.data(), block.size() * sizeof(DeviceCamera));
}

void GlPhotos::send_from_host(const ViewPhotos& photos) {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (Index c = 0; c < layers_; ++c) {
    const ColorImage& image = photos.images[static_cast<std::size_t>(c)];
    if (!image.empty())
      glTextureSubImage3D(photos_.get(), 0, 0, 0, c, image.width_px, image.height_px, 1, GL_RGB,
                          GL_UNSIGNED_BYTE, image.pixels.data());
  }
}

void GlPhotos::send_from_device(const DeviceSurface& surface) {
  unpack_.upload_from(*surface.ctx, surface.photos);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, unpack_.get());
  std::size_t at = 0;
  for (Index c = 0; c < layers_; ++c) {
    const DeviceCamera& camera = cameras_[static_cast<std::size_t>(c)];
    const auto width = static_cast<Index>(camera.photo_width),
               height = static_cast<Index>(camera.photo_height);
    // NOLINTNEXTLINE(performance-no-int-to-ptr): OpenGL's way to say where in the buffer
    const auto* offset = reinterpret_cast<const void*>(at);
    glTextureSubImage3D(photos_.get(), 0, 0, 0, c, width, height, 1, GL_RGB, GL_UNSIGNED_BYTE, offset);
    at += sizeof(Rgb8) * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
}

void GlPhotos::upload(const ViewMesh& view) {
  const ViewPhotos& photos = *view.photos;
  const bool from_device = view.device && !view.device->photos.empty();
  CameraBits live = 0;
  for (std::size_t c = 0; c < photos.cameras.size(); ++c)
    live |= from_device || !photos.images[c].empty() ? camera_bit(static_cast<int>(c)) : 0;
  resize(photos);
  set_cameras(photos, view.R_world_mesh, from_device ? live & view.device->live_photos : live);
  // Sent with every picture: a surface that moves wears new photos in every frame, often in the same object.
  if (from_device)
    send_from_device(*view.device);
  else
    send_from_host(photos);
  k_ = photos.k;
  bias_m_ = PhotoChoice::kBiasVoxels * photos.voxel_size_m;
}

/// Filters every layer into the same layer of another array.
void GlPhotos::filter(const GlProgram& program, const GlTexture& from, const GlTexture& to) const {
  glUseProgram(program.get());
  glBindTextureUnit(3, from.get());
  for (Index c = 0; c < layers_; ++c) {
    const DeviceCamera& camera = cameras_[static_cast<std::size_t>(c)];
    const auto width = static_cast<GLint>(camera.map_width), height = static_cast<GLint>(camera.map_height);
    glNamedFramebufferTextureLayer(framebuffer_.get(), GL_COLOR_ATTACHMENT0, to.get(), 0, c);
    glViewport(0, 0, width, height);
    glProgramUniform2i(program.get(), program["last_texel"], width - 1, height - 1);
    glProgramUniform1i(program.get(), program["layer"], c);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
}

void GlPhotos::draw_maps(const GlPhotoPrograms& programs, const GlMesh& mesh,
                         const GlVertexArray& no_attributes) {
  const GlProgram& map = programs.map;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.get());
  glDisable(GL_DEPTH_TEST);
  // Far sides alone: a point is hidden where something has its far side before it; its own body's far side is
  // behind it, so the map never shades the surface it was made of. Rows go down here: far sides turn to
  // front.
  glEnable(GL_CULL_FACE);
  glCullFace(GL_BACK);
  glEnable(GL_BLEND);
  glBlendEquation(GL_MAX);
  glUseProgram(map.get());
  for (Index c = 0; c < layers_; ++c) {
    const DeviceCamera& camera = cameras_[static_cast<std::size_t>(c)];
    glNamedFramebufferTextureLayer(framebuffer_.get(), GL_COLOR_ATTACHMENT0, drawn_.get(), 0, c);
    glViewport(0, 0, static_cast<GLsizei>(camera.map_width), static_cast<GLsizei>(camera.map_height));
    const GLfloat nothing[] = {0, 0, 0, 0};
    glClearNamedFramebufferfv(framebuffer_.get(), GL_COLOR, 0, nothing);
    glProgramUniform4fv(map.get(), map["row_u"], 1, camera.row_u);
    glProgramUniform4fv(map.get(), map["row_v"], 1, camera.row_v);
    glProgramUniform4fv(map.get(), map["row_z"], 1, camera.row_z);
    glProgramUniform1f(map.get(), map["texels_per_px"], camera.axis[3]);
    glProgramUniform2f(map.get(), map["map_size"], camera.map_width, camera.map_height);
    mesh.draw(map);
  }
  glBlendEquation(GL_FUNC_ADD);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glBindVertexArray(no_attributes.get());
  filter(programs.widen, drawn_, widened_);
  filter(programs.outline, widened_, maps_);
  glEnable(GL_DEPTH_TEST);
}

void GlPhotos::bind(const GlPhotoPrograms& programs) const {
  const GlProgram& surface = programs.surface;
  glBindTextureUnit(2, photos_.get());
  glBindTextureUnit(3, maps_.get());
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, camera_block_.get());
  glProgramUniform1i(surface.get(), surface["camera_count"], layers_);
  glProgramUniform1i(surface.get(), surface["best_k"], k_);
  glProgramUniform1f(surface.get(), surface["bias_m"], bias_m_);
}

}  // namespace tactus
