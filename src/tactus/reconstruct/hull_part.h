#pragma once
/// The memory of one device of a VisualHull, and the launches on it: carve -> count -> emit. A part needs the
/// others' signs of bricks behind its own, and where its mesh begins in that of all.
#include <cstdint>
#include <memory>
#include <vector>

#include "tactus/compute/side_stream.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/reconstruct/hull_plan.h"

namespace tactus {

/// Which part of how many, and how they get at each other's memory.
struct HullRole {
  Index number = 0, parts = 1;
  /// Kernels read and write the other parts' memory: signs of ghosts are fetched, and vertices and triangles
  /// go right into the mesh of the first part. Otherwise every part carves its ghosts itself, and its mesh is
  /// copied.
  bool reaches_peers = true;
  bool is_apart() const { return number > 0 && !reaches_peers; }
};

struct HullPart {
  HullRole role;
  SilhouettePart masks;
  Buffer<CellCase> cases;
  Buffer<std::uint32_t> tiles;
  Buffer<CameraBits> block_cameras, sub_cameras;
  Buffer<Index> tile_first, bricks;
  Buffer<HullCamera> views;  ///< as the plan's, and so the next two
  Buffer<Index> unseen_blocks;
  Buffer<std::uint32_t> unseen_block_bits;
  Buffer<Index> open_regions, open_blocks;  ///< regions that are not outside, and how many blocks they have
  Buffer<PartRange> range;
  Buffer<std::uint8_t> rows;
  Buffer<std::uint32_t> crossings, row_start;
  Buffer<std::uint64_t> mesh_start;
  Buffer<Vec3f> positions_m;
  Buffer<Vec3i> triangles;
  Buffer<PartCounts> counts;
  Buffer<PartPlace> place;  ///< of several parts only, like the next two
  Buffer<PartCounts> total;
  Buffer<PartCounts> others;  ///< copies of all parts' counts, where kernels can't read them in place
  DepthPart depth;
  std::unique_ptr<SideStream> side_stream;
  Event carved, counted, done;

  /// visit(buffer, its number of elements), for all that grow with images, grid or surface.
  template <class F>
  void each_buffer(const HullPlan& plan, F&& visit);
  /// Bytes that `allocate` asks for.
  static double needed_bytes(const HullPlan& plan, HullRole role);
  std::int64_t bytes(const HullPlan& plan);
  void allocate(ExecContext& ctx, const HullPlan& plan, HullRole its_role);

  /// Which nodes are inside: of its own bricks, and of ghosts that it can't fetch.
  void carve(ExecContext& ctx, const HullPlan& plan);
  /// Numbers its vertices and triangles. All parts have carved.
  void count(ExecContext& ctx, const HullPlan& plan, const Parts<HullPart>& all);
  /// Finds its place among all parts, from their counts: read where they are, or copied first.
  void find_place(ExecContext& ctx, const Parts<HullPart>& all);
  /// Makes its vertices and triangles; `first` has the mesh of all.
  void emit(ExecContext& ctx, const HullPlan& plan, HullPart& first);

 private:
  BrickTable table(const HullPlan& plan) const;
  Count bricks_of(const HullPlan& plan, const Index PartRange::*which) const;
  bool keeps_vertices(const HullPlan& plan) const;
  bool keeps_triangles() const { return role.number == 0 || role.is_apart(); }
  void prepare(ExecContext& ctx, const HullPlan& plan);
  void classify(ExecContext& ctx, const HullPlan& plan);
  /// Nothing where enough cameras see all.
  void vote_views(ExecContext& ctx, const HullPlan& plan);
  void clear_unseen(ExecContext& ctx, const HullPlan& plan, Count carved_bricks);
  void fetch_ghosts(ExecContext& ctx, const Parts<HullPart>& all);
  void emit_vertices(ExecContext& ctx, const HullPlan& plan, HullPart& first);
  void emit_triangles(ExecContext& ctx, const HullPlan& plan, HullPart& first);
};

/// Copies vertices of a part into those of all; `place` is the part's own.
void push_vertices(ExecContext& ctx, View<const Vec3f> positions_m, View<const PartPlace> place,
                   View<Vec3f> all_positions_m);
/// Likewise its triangles.
void push_triangles(ExecContext& ctx, View<const Vec3i> triangles, View<const PartPlace> place,
                    View<Vec3i> all_triangles);

template <class F>
void HullPart::each_buffer(const HullPlan& plan, F&& visit) {
  const HullCapacity& capacity = plan.capacity;
  const std::int64_t slots = capacity.bricks;
  masks.each_buffer(plan.silhouettes, visit);
  visit(tiles, plan.tiles);
  visit(tile_first, plan.tiles + 1);
  visit(block_cameras, plan.blocks);
  visit(open_regions, std::int64_t{plan.regions});
  visit(bricks, slots);
  visit(rows, slots * kBrickRows);
  visit(sub_cameras, slots * 8);
  visit(crossings, slots * kBrickRows);
  visit(row_start, slots * kBrickRows);
  visit(mesh_start, slots + 1);
  visit(positions_m, std::int64_t{keeps_vertices(plan) ? capacity.vertices : 0});
  visit(triangles, std::int64_t{keeps_triangles() ? capacity.triangles : 0});
  if (!plan.depth.empty()) depth.each_buffer(plan.depth, plan.blocks, capacity.bricks, visit);
}

}  // namespace tactus
