#include "tactus/view/gl_mesh.h"

#include <algorithm>
#include <cstring>

#include "tactus/base/error.h"
#include "tactus/geom/camera/photo_choice.h"

namespace tactus {
namespace {

constexpr float kFarInside_m = 1;  // of a film's edge

void check_photos(const ViewMesh& view) {
  const ViewPhotos& photos = *view.photos;
  const std::string who = "mesh '" + view.name + "': ";
  const auto cameras = static_cast<Index>(photos.cameras.size());
  if (cameras < 1 || cameras > kMaxCameras)
    throw Error(who + "photos of " + std::to_string(cameras) + " cameras, expected 1 to " +
                std::to_string(kMaxCameras));
  const Index most_blended = std::min(cameras, Index{PhotoChoice::kMostBlended});
  if (photos.k < 1 || photos.k > most_blended)
    throw Error(who + "k is " + std::to_string(photos.k) + ", expected 1 to " + std::to_string(most_blended) +
                " (of " + std::to_string(cameras) + " cameras)");
  if (!(photos.voxel_size_m > 0))
    throw Error(who + "voxel_size_m of the photos is " + std::to_string(photos.voxel_size_m) +
                ", must be > 0");
  if (!view.device && view.mesh.normals.empty()) throw Error(who + "photos need a mesh with normals");
  std::int64_t pixels = 0;
  for (const Camera& c : photos.cameras) pixels += std::int64_t{c.width_px} * c.height_px;
  if (view.device && !view.device->photos.empty()) {
    if (view.device->photos.size() != pixels)
      throw Error(who + "photos of " + std::to_string(view.device->photos.size()) +
                  " pixels on the device, its cameras have " + std::to_string(pixels));
    return;
  }
  if (photos.images.size() != photos.cameras.size())
    throw Error(who + std::to_string(photos.images.size()) + " photos of " + std::to_string(cameras) +
                " cameras");
  for (std::size_t c = 0; c < photos.images.size(); ++c) {
    const ColorImage& image = photos.images[c];
    const Camera& camera = photos.cameras[c];
    if (!image.empty() && (image.width_px != camera.width_px || image.height_px != camera.height_px))
      throw Error(who + "the photo of camera '" + camera.name + "' has " + std::to_string(image.width_px) +
                  "x" + std::to_string(image.height_px) + " pixels, its calibration says " +
                  std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px));
  }
}

}  // namespace

GlSharing gl_sharing(const Device& device) {
  if (!device.is_cuda()) return {false, "read where it lies, in the host's memory"};
  const auto* vendor = reinterpret_cast<const char*>(glGetString(GL_VENDOR));
  std::string why;
  if (vendor == nullptr || std::strstr(vendor, "NVIDIA") == nullptr)
    why = "OpenGL is " + std::string(vendor == nullptr ? "unknown" : vendor) + "'s";
  else
    why = why_not_shared_with_gl(device);
  if (why.empty()) return {true, "stays on " + device.name() + " (shared with OpenGL)"};
  return {false, "copied through the host: " + why};
}

GlStreamBuffer::GlStreamBuffer() {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  name_ = GlName<delete_buffer>(name);
}

bool GlStreamBuffer::grow(std::size_t bytes) {
  if (bytes <= capacity_) return false;
  if (capacity_ == 0) capacity_ = 4096;
  while (capacity_ < bytes) capacity_ *= 2;
  shared_ = GlSharedBuffer();  // before the buffer it belongs to
  GLuint name = 0;
  glCreateBuffers(1, &name);
  name_ = GlName<delete_buffer>(name);
  glNamedBufferStorage(name, static_cast<GLsizeiptr>(capacity_), nullptr, GL_DYNAMIC_STORAGE_BIT);
  return true;
}

bool GlStreamBuffer::upload(const void* data, std::size_t bytes) {
  const bool grows = grow(bytes);
  if (bytes > 0) glNamedBufferSubData(name_.get(), 0, static_cast<GLsizeiptr>(bytes), data);
  return grows;
}

bool GlStreamBuffer::upload_from(ExecContext& ctx, const void* device_memory, std::size_t bytes) {
  if (!ctx.device().is_cuda()) {
    ctx.synchronize();
    return upload(device_memory, bytes);
  }
  const bool grows = grow(bytes);
  if (bytes == 0) return grows;
  if (shared_ || gl_sharing(ctx.device()).direct) {
    if (!shared_) shared_ = GlSharedBuffer(ctx.device(), name_.get());
    shared_.copy_from(ctx, device_memory, bytes);
    return grows;
  }
  staging_.resize(bytes);
  ctx.download(
      View<const std::uint8_t>(static_cast<const std::uint8_t*>(device_memory), static_cast<Index>(bytes)),
      staging_);
  ctx.synchronize();
  return upload(staging_.data(), bytes) || grows;
}

void check_mesh(const ViewMesh& view) {
  const std::string who = "mesh '" + view.name + "': ";
  if (view.photos) check_photos(view);
  if (view.device) {
    const DeviceSurface& d = *view.device;
    if (d.ctx == nullptr) throw Error(who + "a surface on a device without its context");
    if (!d.normals.empty() && d.normals.size() != d.positions_m.size())
      throw Error(who + std::to_string(d.normals.size()) + " normals for " +
                  std::to_string(d.positions_m.size()) + " vertices");
    if (view.photos && d.normals.empty()) throw Error(who + "photos need a mesh with normals");
  }
  const std::size_t vertices =
      view.device ? static_cast<std::size_t>(view.device->positions_m.size()) : view.mesh.positions_m.size();
  if (!view.mesh.normals.empty() && view.mesh.normals.size() != vertices)
    throw Error(who + std::to_string(view.mesh.normals.size()) + " normals for " + std::to_string(vertices) +
                " vertices");
  if (!view.colors.empty() && view.colors.size() != vertices)
    throw Error(who + std::to_string(view.colors.size()) + " colours for " + std::to_string(vertices) +
                " vertices");
  if (view.film && (view.film->film_m.size() != vertices || view.film->stain_m.size() != vertices))
    throw Error(who + std::to_string(view.film->film_m.size()) + " and " +
                std::to_string(view.film->stain_m.size()) + " thicknesses of film and stain for " +
                std::to_string(vertices) + " vertices");
  if (view.film && !view.film->edge_m.empty() && view.film->edge_m.size() != vertices)
    throw Error(who + std::to_string(view.film->edge_m.size()) + " distances to the film's edge for " +
                std::to_string(vertices) + " vertices");
  if (view.flesh && (view.flesh->rest_m.size() != vertices || view.flesh->depth_m.size() != vertices ||
                     view.flesh->lip.size() != vertices))
    throw Error(who + "flesh of " + std::to_string(view.flesh->rest_m.size()) + " vertices, expected " +
                std::to_string(vertices));
  std::uint32_t largest = 0;  // a negative index is huge as unsigned
  for (const auto& t : view.mesh.triangles) {
    for (const Index v : t) largest = std::max(largest, static_cast<std::uint32_t>(v));
  }
  if (!view.mesh.triangles.empty() && largest >= vertices)
    throw Error(who + "a triangle has vertex " + std::to_string(static_cast<Index>(largest)) +
                ", expected 0 to " + std::to_string(static_cast<std::int64_t>(vertices) - 1));
}

GlMesh::GlMesh() {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  array = GlVertexArray(name);
  for (const GLuint i : {0U, 1U}) {
    glVertexArrayAttribFormat(name, i, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(name, i, i);
  }
  glVertexArrayAttribFormat(name, 2, 3, GL_UNSIGNED_BYTE, GL_TRUE, 0);
  glVertexArrayAttribBinding(name, 2, 2);
  glVertexArrayAttribFormat(name, 3, 3, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribBinding(name, 3, 3);
  glVertexArrayAttribFormat(name, 4, 4, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribBinding(name, 4, 4);
  glVertexArrayAttribFormat(name, 5, 3, GL_FLOAT, GL_FALSE, 4 * sizeof(float));
  glVertexArrayAttribBinding(name, 5, 4);
  glEnableVertexArrayAttrib(name, 0);
}

void GlMesh::upload(const ViewMesh& view) {
  const TriangleMesh& mesh = view.mesh;
  const std::optional<DeviceSurface>& device = view.device;
  turn = view.R_world_mesh;
  if (colors.upload(view.colors.data(), view.colors.size() * sizeof(Rgb8)))
    glVertexArrayVertexBuffer(array.get(), 2, colors.get(), 0, sizeof(Rgb8));
  if (view.colors.empty()) {
    glDisableVertexArrayAttrib(array.get(), 2);
    glVertexAttrib3f(2, -1, -1, -1);  // a fragment that no photo shows is shaded (kPhotoFragment)
  } else {
    glEnableVertexArrayAttrib(array.get(), 2);
  }
  upload_tissue(view);
  const bool new_positions =
      device ? positions.upload_from(*device->ctx, device->positions_m)
             : positions.upload(mesh.positions_m.data(), mesh.positions_m.size() * sizeof(Vec3f));
  if (new_positions) glVertexArrayVertexBuffer(array.get(), 0, positions.get(), 0, sizeof(Vec3f));
  const bool new_normals = device ? normals.upload_from(*device->ctx, device->normals)
                                  : normals.upload(mesh.normals.data(), mesh.normals.size() * sizeof(Vec3f));
  if (new_normals) glVertexArrayVertexBuffer(array.get(), 1, normals.get(), 0, sizeof(Vec3f));
  const bool new_indices =
      device ? indices.upload_from(*device->ctx, device->triangles)
             : indices.upload(mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
  if (new_indices) glVertexArrayElementBuffer(array.get(), indices.get());
  const bool smooth = device ? !device->normals.empty() : !mesh.normals.empty();
  (smooth ? glEnableVertexArrayAttrib : glDisableVertexArrayAttrib)(array.get(), 1);
  index_count = device ? 3 * device->triangles.size() : static_cast<GLsizei>(3 * mesh.triangles.size());
}

/// The film on it, and the flesh below.
void GlMesh::upload_tissue(const ViewMesh& view) {
  film_m.clear();
  if (view.film)
    for (std::size_t v = 0; v < view.film->film_m.size(); ++v)
      film_m.push_back({view.film->film_m[v], view.film->stain_m[v],
                        view.film->edge_m.empty() ? kFarInside_m : view.film->edge_m[v]});
  if (films.upload(film_m.data(), film_m.size() * sizeof film_m[0]))
    glVertexArrayVertexBuffer(array.get(), 3, films.get(), 0, sizeof film_m[0]);
  (film_m.empty() ? glDisableVertexArrayAttrib : glEnableVertexArrayAttrib)(array.get(), 3);
  if (film_m.empty()) glVertexAttrib3f(3, 0, 0, 0);
  flesh_of_vertex.clear();
  if (view.flesh)
    for (std::size_t v = 0; v < view.flesh->rest_m.size(); ++v)
      flesh_of_vertex.push_back({view.flesh->rest_m[v], view.flesh->depth_m[v], view.flesh->lip[v]});
  if (flesh.upload(flesh_of_vertex.data(), flesh_of_vertex.size() * sizeof(FleshVertex)))
    glVertexArrayVertexBuffer(array.get(), 4, flesh.get(), 0, sizeof(FleshVertex));
  for (const GLuint i : {4U, 5U})
    (flesh_of_vertex.empty() ? glDisableVertexArrayAttrib : glEnableVertexArrayAttrib)(array.get(), i);
  if (flesh_of_vertex.empty()) glVertexAttrib4f(4, 0, 0, 0, -1);
}

void GlMesh::draw(const GlProgram& program) const {
  static_assert(sizeof(Mat3f) == 9 * sizeof(GLfloat));
  glProgramUniformMatrix3fv(program.get(), program["turn"], 1, GL_TRUE, &turn.row[0].x);
  glBindVertexArray(array.get());
  glDrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_INT, nullptr);
}

}  // namespace tactus
