#pragma once
/// Surfaces on the GPU. Internal to view/; a context is current wherever these are used.
#include <vector>

#include "tactus/compute/gl_sharing.h"
#include "tactus/view/gl_objects.h"
#include "tactus/view/scene.h"

namespace tactus {

/// A buffer that is filled anew each frame; its room grows by doubling and never shrinks.
class GlStreamBuffer {
 public:
  GlStreamBuffer();
  /// Returns whether the buffer's name has changed, so that vertex arrays must be told.
  bool upload(const void* data, std::size_t bytes);
  /// The same from the memory of a device: directly where it is shared with OpenGL, else through the host.
  bool upload_from(ExecContext& ctx, const void* device_memory, std::size_t bytes);
  template <class T>
  bool upload_from(ExecContext& ctx, View<const T> view) {
    return upload_from(ctx, view.data(), sizeof(T) * static_cast<std::size_t>(view.size()));
  }
  GLuint get() const { return name_.get(); }

 private:
  bool grow(std::size_t bytes);

  GlName<delete_buffer> name_;
  GlSharedBuffer shared_;  ///< of that name
  std::size_t capacity_ = 0;
  std::vector<std::uint8_t> staging_;
};

/// How the memory of `device` reaches the current context, for people; `direct`: without the host.
struct GlSharing {
  bool direct = false;
  std::string text;
};
GlSharing gl_sharing(const Device& device);

/// @throws Error for an index out of its range, or when normals, colours or photos don't fit.
void check_mesh(const ViewMesh& view);

/// A mesh on the GPU. Slots are reused from frame to frame.
struct GlMesh {
  GlStreamBuffer positions, normals, colors, films, flesh, indices;
  GlVertexArray array;
  GLsizei index_count = 0;
  Mat3f turn = Mat3f::identity();
  std::vector<Vec3f> film_m;  ///< film, stain, distance to the edge; kept for its capacity
  struct FleshVertex {
    Vec3f rest_m;
    float depth_m;
    Vec3f lip;
  };
  std::vector<FleshVertex> flesh_of_vertex;  ///< likewise

  GlMesh();
  void upload(const ViewMesh& view);
  void upload_tissue(const ViewMesh& view);
  /// With a program that is in use and whose vertex shader knows `turn`.
  void draw(const GlProgram& program) const;
};

}  // namespace tactus
