#include "tactus/contact/walls/active_walls.h"

#include <algorithm>
#include <numeric>

namespace tactus {

ActiveWalls::ActiveWalls(ExecContext& ctx, const WallGrid& grid, const WallMesh::Capacity& capacity,
                         Index nodes)
    : grid_(grid),
      counts_(ctx.device(), 2),
      triangle_list_(ctx.device(), capacity.surface),
      vertex_list_(ctx.device(), capacity.vertices),
      is_active_(ctx.device(), capacity.vertices),
      wide_(ctx.device(), grid.words()),
      taken_(ctx.device(), grid.words()),
      guarded_(ctx.device(), grid.words()),
      chosen_m_(ctx.device(), nodes),
      most_m_(ctx.device(), 1) {}

void ActiveWalls::take_all(ExecContext& ctx, Index vertices, Index triangles) {
  std::vector<Index> all(static_cast<std::size_t>(std::max(vertices, triangles)));
  std::iota(all.begin(), all.end(), 0);
  const std::span<const Index> numbers(all);
  const std::vector<std::uint32_t> counts{static_cast<std::uint32_t>(triangles),
                                          static_cast<std::uint32_t>(vertices)};
  ctx.upload(numbers.first(static_cast<std::size_t>(vertices)), vertex_list_.view().part(0, vertices));
  ctx.upload(numbers.first(static_cast<std::size_t>(triangles)), triangle_list_.view().part(0, triangles));
  ctx.upload(counts, counts_.view());
  ctx.synchronize();
}

void ActiveWalls::follow(ExecContext& ctx, const std::vector<EmbeddedPoint>& points) {
  // A vertex outside of its cube of nodes moves more than these.
  float most_weight = 1;
  for (const EmbeddedPoint& p : points) {
    float sum = 0;
    for (const float w : p.weight) sum += abs(w);
    most_weight = std::max(most_weight, sum);
  }
  const std::vector<float> most_m{0.99F / (grid_.inverse_cell_1_m * most_weight)};  // rounding
  ctx.upload(most_m, most_m_.view());
  ctx.fill_bytes(counts_.view(), 0);
  ctx.fill_bytes(guarded_.view(), 0xff);
  ctx.fill_bytes(chosen_m_.view(), 0xff);  // not a number: no node has moved far from there
  ctx.synchronize();
}

void ActiveWalls::watch(ExecContext& ctx, const ContactNodes& nodes, const WallRefresh& refresh) {
  ctx.parallel_for("body walls/watch", chosen_m_.size(),
                   WatchNodes{nodes, chosen_m_.const_view(), most_m_.const_view(), refresh});
}

void ActiveWalls::choose(ExecContext& ctx, const PoseWallVertices& pose, View<const Vec3i> triangles,
                         View<const std::uint32_t> near, const WallRefresh& refresh) {
  const auto asked = [&](WallRefresh::Of what, Index most) {
    const auto* counts = reinterpret_cast<const Index*>(refresh.counts.data());
    return Count(View<const Index>(counts + what, 1), most);
  };
  const Count rows = asked(WallRefresh::kRows, grid_.rows * grid_.layers);
  ctx.parallel_for("body walls/start", rows,
                   StartActive{grid_, kMargin, near, wide_.view(), taken_.view(), counts_.view()});
  ctx.parallel_for("body walls/pose all", asked(WallRefresh::kVertices, vertex_list_.size()),
                   PoseInactiveVertices{pose, is_active_.view()});
  ctx.parallel_for(
      "body walls/choose", asked(WallRefresh::kTriangles, triangle_list_.size()),
      ChooseActive{grid_, wide_.const_view(), triangles, pose.posed, taken_.view(), is_active_.view(),
                   counts_.view(), triangle_list_.view(), vertex_list_.view()});
  ctx.parallel_for("body walls/guard", rows, GuardCells{grid_, taken_.const_view(), guarded_.view()});
  ctx.parallel_for("body walls/note", asked(WallRefresh::kNodes, chosen_m_.size()),
                   NoteNodes{pose.nodes, chosen_m_.view()});
}

}  // namespace tactus
