#include "tactus/run/sinks/mesh_sink.h"

#include <cstdio>
#include <filesystem>

#include "tactus/fluid/liquid_mesh.h"
#include "tactus/io/mesh/mesh_file.h"
#include "tactus/sim/body/body_measures.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

std::string numbered(std::int64_t tick, const char* extension) {
  char number[24];
  std::snprintf(number, sizeof number, "-%05lld%s", static_cast<long long>(tick), extension);
  return number;
}

bool is_due(const RunFrame& frame, int every) { return every > 0 && (frame.number - 1) % every == 0; }

}  // namespace

void MeshSink::frame(RunFrame& frame) {
  if (!is_due(frame, scene_.output.mesh_every) || frame.report.hull.overflow) return;
  const std::shared_ptr<const FrameSnapshot> snapshot = frame.snapshot();
  const std::string ply = numbered(frame.images.tick, ".ply");
  if (scene_.source.kind != SourceKind::none) write_ply(stem_ + "-real" + ply, snapshot->real);
  for (std::size_t b = 0; b < snapshot->bodies.size(); ++b)
    write_ply(stem_ + "-" + scene_.bodies[b].name + ply, snapshot->bodies[b]);
  if (scene_.fluid)
    write_ply(stem_ + "-liquid" + ply,
              liquid_mesh(snapshot->liquid_m, static_cast<float>(scene_.fluid->spacing_m)));
}

/// @returns the path of its file.
std::string VtkSink::add(const RunFrame& frame, const std::string& part, const char* extension) {
  std::string path = stem_ + "-" + part + numbered(frame.images.tick, extension);
  files_.push_back({frame.images.time_s, part, std::filesystem::path(path).filename().string()});
  return path;
}

void VtkSink::frame(RunFrame& frame) {
  if (!is_due(frame, every_)) return;
  ExecContext& ctx = frame.world.impl().context();
  for (const auto& body : frame.world.impl().bodies())
    write_vtu(add(frame, body->name(), ".vtu"), body->shape().lattice, body->shape().elements,
              body->positions_m(ctx), body->velocities_m_s(ctx), body->measures().strains(ctx));
  const std::shared_ptr<const FrameSnapshot> seen = frame.snapshot();
  if (!seen->real.triangles.empty()) write_vtp(add(frame, "real", ".vtp"), seen->real);
  if (frame.world.impl().liquid() != nullptr)
    write_vtp(add(frame, "liquid", ".vtp"), {.positions_m = seen->liquid_m, .normals = {}, .triangles = {}});
  write_pvd(stem_ + ".pvd", files_);
}

}  // namespace tactus
