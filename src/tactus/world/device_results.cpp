#include "tactus/world/device_results.h"

#include "tactus/base/error.h"
#include "tactus/compute/cuda/cuda_backend.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/world/world_impl.h"

namespace tactus {

DeviceNodes device_nodes(World& world, const std::string& body) {
  const SoftBody& of = world.impl().body(body);
  const BodyState& state = of.tissue().body();
  const Index count = nodes_in_use(of.shape().lattice);
  world.impl().devices().synchronize();
  return {state.x_m.const_view().part(0, count), state.v_m_s.const_view().part(0, count)};
}

DeviceMesh device_surface(World& world, const std::string& body) {
  const EmbeddedSurface& surface = world.impl().body(body).surface();
  world.impl().devices().synchronize();
  return {surface.positions_m(), surface.normals(), surface.triangles()};
}

DeviceMesh device_surface(Perception& perception) { return device_mesh(perception.impl().finished()); }

DeviceMesh device_mesh(const MeshView& mesh) {
  const Index* const corners = mesh.triangles.empty() ? nullptr : &mesh.triangles.data()->x;
  return {mesh.positions_m, mesh.normals, {corners, 3 * mesh.triangles.size()}};
}

void wait_for_stream(DeviceSet& devices, std::uintptr_t cuda_stream) {
  if (!devices.is_cuda())
    throw usage_error("stream is " + std::to_string(cuda_stream) + ", but '" + devices.name() +
                      "' has no CUDA streams: expected none");
  const int ordinal = devices.device(0).ordinal();
  // In the runtime, 0, 1 and 2 are streams, too: the default one, by two names, and the thread's.
  auto* const stream = reinterpret_cast<void*>(cuda_stream);  // NOLINT(performance-no-int-to-ptr)
  const std::unique_ptr<void, void (*)(void*)> event(cuda::create_event(ordinal),
                                                     [](void* e) { cuda::destroy_event(e); });
  cuda::record_event(ordinal, event.get(), stream);
  devices.for_each_part([&](ExecContext& ctx, int) {
    cuda::wait_event(ctx.device().ordinal(), ctx.cuda_stream(), event.get());
  });
}

}  // namespace tactus
