#include "tactus/web/stream_message.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/byte_io.h"

namespace tactus {
namespace {

constexpr float kSteps = 65535;

bool is_finite(Vec3f p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

std::uint8_t byte_of(float share) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.F, 1.F)));
}

}  // namespace

std::array<std::int8_t, 2> octahedral(Vec3f unit) {
  const float sum = std::abs(unit.x) + std::abs(unit.y) + std::abs(unit.z);
  if (!(sum > 0)) return {0, 0};
  float u = unit.x / sum, v = unit.y / sum;
  if (unit.z < 0) {
    const float folded_u = (1 - std::abs(v)) * (u < 0 ? -1.F : 1.F);
    v = (1 - std::abs(u)) * (v < 0 ? -1.F : 1.F);
    u = folded_u;
  }
  const auto byte = [](float x) {
    return static_cast<std::int8_t>(std::lround(127 * std::clamp(x, -1.F, 1.F)));
  };
  return {byte(u), byte(v)};
}

StreamMessage::StreamMessage(StreamKind kind, std::uint32_t frame, double time_s, double captured_unix_s) {
  bytes_.append(kStreamMagic);
  put_bytes(bytes_, kStreamVersion);
  put_bytes(bytes_, kind);
  put_bytes(bytes_, std::uint32_t{0});  // blocks
  put_bytes(bytes_, frame);
  put_bytes(bytes_, std::uint32_t{0});
  put_bytes(bytes_, time_s);
  put_bytes(bytes_, captured_unix_s);
}

StreamGrid StreamGrid::around(std::span<const Vec3f> positions_m) {
  constexpr float kFar = 1e30F;
  Box3f box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const Vec3f p : positions_m)
    if (is_finite(p)) box = {min(box.min, p), max(box.max, p)};
  if (box.min.x > box.max.x) return {};
  const Vec3f extent = box.extent();
  return {box.min, std::max({extent.x, extent.y, extent.z, 1e-6F}) / kSteps};
}

std::size_t StreamMessage::begin_block(BlockKind kind, const BlockStyle& style, std::size_t count,
                                       std::size_t triangles, std::uint32_t flags, const StreamGrid& grid) {
  set_bytes(bytes_, 12, ++blocks_);
  put_bytes(bytes_, kind);
  put_bytes(bytes_, style.role);
  const std::size_t size_at = bytes_.size();
  put_bytes(bytes_, std::uint32_t{0});
  put_bytes(bytes_, static_cast<std::uint32_t>(style.name.size()));
  put_bytes(bytes_, static_cast<std::uint32_t>(count));
  put_bytes(bytes_, static_cast<std::uint32_t>(triangles));
  for (const float share : {style.color.x, style.color.y, style.color.z, style.opacity})
    put_bytes(bytes_, byte_of(share));
  put_bytes(bytes_, flags);
  for (const float x : {grid.origin_m.x, grid.origin_m.y, grid.origin_m.z, grid.step_m}) put_bytes(bytes_, x);
  bytes_.append(style.name);
  pad();
  return size_at;
}

/// The size counts from the block's head, so that readers can pass over blocks that they don't know.
void StreamMessage::end_block(std::size_t size_at) {
  pad();
  set_bytes(bytes_, size_at, static_cast<std::uint32_t>(bytes_.size() - (size_at - 8)));
}

void StreamMessage::pad() { bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0'); }

void put_vertices(std::string& to, std::span<const Vec3f> positions_m, std::span<const Vec3f> normals,
                  const StreamGrid& grid) {
  const std::size_t begin = to.size();
  to.resize(begin + 8 * positions_m.size());
  char* at = to.data() + begin;
  const float steps_per_m = 1 / grid.step_m;
  for (std::size_t i = 0; i < positions_m.size(); ++i, at += 8) {
    std::uint16_t q[3] = {0, 0, 0};
    if (is_finite(positions_m[i])) {
      const Vec3f s = steps_per_m * (positions_m[i] - grid.origin_m);
      for (int a = 0; a < 3; ++a) q[a] = static_cast<std::uint16_t>(std::clamp(s[a] + 0.5F, 0.F, kSteps));
    }
    std::memcpy(at, q, sizeof q);
    if (normals.empty()) continue;
    const std::array<std::int8_t, 2> n = octahedral(normals[i]);
    std::memcpy(at + 6, n.data(), 2);
  }
}

void StreamMessage::put_triangles(std::span<const std::array<Index, 3>> triangles, bool wide) {
  const std::size_t bytes = wide ? 4 : 2;
  std::size_t at = bytes_.size();
  bytes_.resize(at + 3 * bytes * triangles.size());
  for (const std::array<Index, 3>& triangle : triangles)
    for (const Index corner : triangle) {
      if (wide)
        set_bytes(bytes_, at, static_cast<std::uint32_t>(corner));
      else
        set_bytes(bytes_, at, static_cast<std::uint16_t>(corner));
      at += bytes;
    }
}

void StreamMessage::add_packed(BlockKind kind, const BlockStyle& style, std::size_t count,
                               std::size_t triangles, std::string_view packed, const StreamGrid& grid,
                               std::uint32_t flags) {
  const std::size_t block = begin_block(kind, style, count, triangles, flags, grid);
  bytes_.append(packed);
  end_block(block);
}

void StreamMessage::add_surface(const BlockStyle& style, const TriangleMesh& mesh, std::string_view film) {
  const bool wide = mesh.positions_m.size() > 65536,
             has_normals = mesh.normals.size() == mesh.positions_m.size();
  const StreamGrid grid = StreamGrid::around(mesh.positions_m);
  const std::size_t block = begin_block(
      BlockKind::surface, style, mesh.positions_m.size(), mesh.triangles.size(),
      (wide ? kWideIndices : 0U) | (has_normals ? kHasNormals : 0U) | (film.empty() ? 0U : kHasFilm), grid);
  put_vertices(bytes_, mesh.positions_m,
               has_normals ? std::span<const Vec3f>(mesh.normals) : std::span<const Vec3f>(), grid);
  put_triangles(mesh.triangles, wide);
  bytes_.append(film);
  end_block(block);
}

void StreamMessage::add_particles(const BlockStyle& style, std::span<const Vec3f> positions_m) {
  const StreamGrid grid = StreamGrid::around(positions_m);
  const auto finite = std::count_if(positions_m.begin(), positions_m.end(), is_finite);
  const std::size_t block =
      begin_block(BlockKind::particles, style, static_cast<std::size_t>(finite), 0, 0, grid);
  for (std::size_t i = 0; i < positions_m.size(); ++i)
    if (is_finite(positions_m[i])) put_vertices(bytes_, positions_m.subspan(i, 1), {}, grid);
  end_block(block);
}

void StreamMessage::add_lines(const BlockStyle& style, std::span<const Vec3f> points_m) {
  const StreamGrid grid = StreamGrid::around(points_m);
  const std::size_t block = begin_block(BlockKind::lines, style, points_m.size(), 0, 0, grid);
  put_vertices(bytes_, points_m, {}, grid);
  end_block(block);
}

void StreamMessage::add_json(const BlockStyle& style, std::string_view text) {
  const std::size_t block = begin_block(BlockKind::json, style, text.size(), 0, 0, {});
  bytes_.append(text);
  end_block(block);
}

}  // namespace tactus
