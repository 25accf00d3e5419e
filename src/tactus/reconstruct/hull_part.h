#pragma once
/// The memory of one device of a VisualHull, and the launches on it: carve -> count -> emit. What a part
/// needs of the others is where its mesh begins in that of all.
#include <cstdint>
#include <vector>

#include "tactus/multi_device/device_set.h"
#include "tactus/reconstruct/hull_plan.h"

namespace tactus {

struct HullPart {
  Index number = 0, parts = 1;
  SilhouettePart masks;
  Buffer<CellCase> cases;
  Buffer<std::uint32_t> tiles, block_cameras;
  Buffer<Index> tile_first, bricks;
  Buffer<PartRange> range;
  Buffer<std::uint8_t> rows;
  Buffer<std::uint32_t> sub_cameras, crossings, row_start;
  Buffer<std::uint64_t> mesh_start;
  Buffer<Vec3f> positions_m;
  Buffer<Vec3i> triangles;
  Buffer<PartCounts> counts;
  Buffer<PartPlace> place;  ///< of several parts only, like the next two
  Buffer<PartCounts> total;
  Buffer<PartCounts> others;  ///< copies of all parts' counts, where kernels can't read them in place
  DepthPart depth;
  Event counted, done;
  Replay carving, counting, emitting;

  /// visit(buffer, its number of elements), for all that grow with images, grid or surface.
  template <class F>
  void each_buffer(const HullPlan& plan, F&& visit);
  /// Bytes that `allocate` asks for.
  static double needed_bytes(const HullPlan& plan);
  std::int64_t bytes(const HullPlan& plan);
  void allocate(ExecContext& ctx, const HullPlan& plan, Index part, Index part_count);

  /// Which nodes are inside, for all that this part holds.
  void carve(ExecContext& ctx, const HullPlan& plan);
  /// Numbers its vertices and triangles.
  void count(ExecContext& ctx, const HullPlan& plan);
  /// Finds its place among all parts, from their counts: read where they are, or copied first.
  void find_place(ExecContext& ctx, const Parts<HullPart>& all, bool reads_peers);
  /// Makes its vertices and triangles.
  void emit(ExecContext& ctx, const HullPlan& plan);

 private:
  BrickTable table(const HullPlan& plan) const;
  Count held(const HullPlan& plan) const;
  Count own(const HullPlan& plan) const;
};

/// Copies the vertices and triangles of a part into the mesh of all; `place` is the part's own.
void push_mesh(ExecContext& ctx, View<const Vec3f> positions_m, View<const Vec3i> triangles,
               View<const PartPlace> place, View<Vec3f> all_positions_m, View<Vec3i> all_triangles);

template <class F>
void HullPart::each_buffer(const HullPlan& plan, F&& visit) {
  const HullCapacity& room = plan.capacity;
  const std::int64_t slots = room.bricks;
  masks.each_buffer(plan.silhouettes, visit);
  visit(tiles, plan.tiles);
  visit(tile_first, plan.tiles + 1);
  visit(block_cameras, plan.blocks);
  visit(bricks, slots);
  visit(rows, slots * kBrickRows);
  visit(sub_cameras, slots * 8);
  visit(crossings, slots * kBrickRows);
  visit(row_start, slots * kBrickRows);
  visit(mesh_start, slots + 1);
  visit(positions_m, std::int64_t{room.vertices});
  visit(triangles, std::int64_t{room.triangles});
  if (!plan.depth.empty()) depth.each_buffer(plan.depth, plan.blocks, room.bricks, visit);
}

}  // namespace tactus
