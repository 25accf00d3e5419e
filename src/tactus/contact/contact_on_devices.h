#pragma once
/// The boundaries that bodies touch, on every device that has a part of a body that may touch them.
#include "tactus/contact/contact.h"
#include "tactus/frame/frame_on_devices.h"
#include "tactus/multi_device/upload_ring.h"

namespace tactus {

/// The real surface, obstacles and contact on the first devices of a set. Each has all of them, with the same
/// bits.
class ContactOnDevices {
 public:
  struct Part {
    RealSurface surface;
    Obstacles obstacles;
    Contact contact;
    Buffer<ToolMotion> tools;
  };

  /// @param count of devices. Synchronizes. @throws Error as RealSurface, Obstacles and Contact.
  ContactOnDevices(DeviceSet& devices, int count, const RealSurfaceSettings& surface,
                   const ContactSettings& contact, std::span<const ObstacleDescription> obstacles);

  int count() const { return static_cast<int>(parts_.size()); }
  Part& part(int p) { return *parts_[static_cast<std::size_t>(p)]; }
  const Part& first() const { return *parts_.front(); }

  /// Takes over the mesh of a new frame, which the first device has, without normals. The others copy it, and
  /// each sorts it for itself: a triangle of a mesh has 18 bytes, its sorted form 56 and more, and no device
  /// waits for another's sorting. Asynchronous; after the first frame, it may be recorded.
  void update(const MeshView& mesh, const FrameOnDevices& frame);
  /// As RealSurface::set_coarseness, on every device.
  void set_coarseness(float spacings) {
    for (auto& part : parts_) part->surface.set_coarseness(spacings);
  }
  /// As Contact::set_response, on every device.
  void set_response(float friction, float restitution) {
    for (auto& part : parts_) part->contact.set_response(friction, restitution);
  }
  /// How tools move from now on; until then none is there. Asynchronous, between frames.
  /// @param tools as the obstacles count them
  void move_tools(std::span<const ToolMotion> tools);
  /// Finds where the surface and tools are after each substep. Asynchronous.
  void begin_frame(const FrameOnDevices& frame);

 private:
  /// The mesh in the memory of another device.
  struct MeshCopy {
    Buffer<Vec3f> vertices_m;
    Buffer<Vec3i> triangles;
    Buffer<Index> counts;  ///< (2) of vertices and triangles
  };
  MeshView copied(int p, const MeshView& mesh);

  DeviceSet& devices_;
  std::vector<std::unique_ptr<Part>> parts_;
  std::vector<MeshCopy> copies_;  ///< per device; of the first, empty
  Event ready_;
  UploadRing<ToolMotion> tool_ring_;  ///< empty where there are no tools
  std::vector<Index> tools_there_;    ///< ToolMotion::is_there
};

}  // namespace tactus
