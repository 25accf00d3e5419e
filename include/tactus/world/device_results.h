#pragma once
/// Results where they lie, in the memory of the first device, for programs that go on with them there.
///
/// A view shows the frame that was stepped last, and the next frame comes to the same place. A cut adds
/// vertices, new images make another mesh: take the view again then. It ends with its World or
/// Perception.
#include <cstdint>
#include <string>

#include "tactus/base/vec.h"
#include "tactus/compute/view.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {

class Perception;
class World;
struct MeshView;

/// Nodes of a body, in the order of BodyNodes.
struct DeviceNodes {
  View<const Vec3f> positions_m, velocities_m_s;
};
/// As a TriangleMesh.
struct DeviceMesh {
  View<const Vec3f> positions_m, normals;
  View<const Index> corners;  ///< three a triangle
};

// These synchronize.

/// @throws usage Error for a body that isn't in the scene.
DeviceNodes device_nodes(World& world, const std::string& body);
/// The surface that is seen; likewise.
DeviceMesh device_surface(World& world, const std::string& body);
/// The real surface of the last images; empty before the first. @throws Error when it is incomplete, naming
/// the option to raise.
DeviceMesh device_surface(Perception& perception);
/// A mesh whose counts the host knows.
DeviceMesh device_mesh(const MeshView& mesh);

/// From now on, work of these devices comes after all that a CUDA stream of another library has to do now, as
/// reading such a view. 0 and 1: the default stream; 2: that of the thread.
/// @throws usage Error for devices that aren't GPUs.
void wait_for_stream(DeviceSet& devices, std::uintptr_t cuda_stream);

}  // namespace tactus
