#pragma once
/// A film of liquid on a surface that may move and be cut.
#include <span>
#include <vector>

#include "tactus/fluid/film/film_kernels.h"
#include "tactus/fluid/film/film_region_kernels.h"
#include "tactus/frame/state_archive.h"

namespace tactus {

struct FilmSettings {
  float density_kg_m3 = 1060;
  float viscosity_Pa_s = 0.0035F;
  float surface_tension_N_m = 0.058F;
  /// At which an edge advances. It never recedes: liquid that runs off leaves a film behind.
  float contact_angle_deg = 40;
  /// Triangles lower than this make the film's surface no stiffer than those of this height do.
  float resolved_m = 0.001F;
  float drying_m_s = 0;    ///< by which a film gets thinner: that much of it stays as a stain
  Index most_passes = 16;  ///< in a frame
  Index rings = 3;         ///< of vertices, by which a film's edge advances in a frame at most
};

/// Owns the volume at each vertex. Steps are asynchronous and may be recorded: nothing is allocated or read
/// back.
class Film {
 public:
  /// All dry. @throws Error naming the setting that is out of range.
  /// @param max_incident entries of the surface's lists of triangles
  Film(ExecContext& ctx, const FilmSettings& settings, Index max_vertices, Index max_triangles,
       Index max_incident);

  /// One frame of dt_s times substeps, with the surface where it is.
  void step(ExecContext& ctx, const FilmSurface& surface, View<const FrameParams> frame);

  /// Sums over all that is wet and stained, into sums().
  void sum(ExecContext& ctx);
  /// Between frames, when a surface was cut. A vertex that keeps triangles keeps its volume, on whichever
  /// side of the cut it is, and new vertices begin dry. What lies on one that has none left goes to another.
  struct Move {
    Index from = 0, to = 0;
  };
  /// Synchronizes.
  void move(ExecContext& ctx, std::span<const Move> moves);
  /// Vertices that hold something, volume or stain. Synchronizes.
  std::vector<std::uint8_t> held(ExecContext& ctx, Index vertices) const;
  /// Between frames. Synchronizes. @param volumes in units of kFilmUnit_m3, one per vertex
  void set_volumes(ExecContext& ctx, std::span<const std::int64_t> volumes);
  /// All that later frames depend on. Synchronizes. @param stain_elsewhere units that dried here, and are on
  /// no vertex now @throws Error.
  void archive(ExecContext& ctx, StateArchive& a, std::int64_t stain_elsewhere = 0);

  Index max_vertices() const { return volume_.size(); }
  const FilmLaw& law() const { return law_; }
  /// For those that give the film liquid, after a step. They may take some, too, from vertices of region().
  FilmGains gains() { return {volume_.view(), mark_.view(), near_.view(), {counts_.view()}}; }
  /// For those that move all of it to other vertices, before a step.
  FilmStore store() { return {gains(), stain_.view(), change_.view(), height_.view()}; }
  /// In units of kFilmUnit_m3, one per vertex.
  View<const std::int64_t> volumes() const { return volume_.const_view(); }
  /// Volume that dried there.
  View<const std::int64_t> stains() const { return stain_.const_view(); }
  /// After the last step; 0 where it is dry.
  View<const float> heights_m() const { return height_.const_view(); }
  /// That the last step looked at: all that was wet, and some rings more. The views last as long as the film.
  FilmRegion region() const {
    return {{counted(FilmCounts::kVertices), region_vertex_.size()},
            {counted(FilmCounts::kTriangles), region_triangle_.size()},
            region_vertex_.const_view(),
            region_triangle_.const_view()};
  }
  /// (1) of the last sum()
  View<const FilmSums> sums() const { return sums_.const_view(); }
  /// (1) of the last step
  View<const FilmPasses> passes() const { return passes_.const_view(); }

 private:
  View<const Index> counted(Index which) const { return counts_.const_view().part(which, 1); }
  void find_region(ExecContext& ctx, const FilmSurface& surface);
  void note_wet(ExecContext& ctx);

  FilmLaw law_;
  Index rings_;
  float drying_m_s_;
  Buffer<std::int64_t> volume_, stain_;
  Buffer<float> area_, gravity_, eigen_, height_, pressure_;
  Buffer<FilmTriangle> triangles_;
  Buffer<Index> place_;
  Buffer<float> fields_;
  Buffer<Index> corners_;
  Buffer<FilmSpoke> spokes_;
  Buffer<Index> flow_, change_;
  Buffer<Index> mark_, near_, region_vertex_, region_triangle_, counts_;
  Buffer<float> rate_;
  Buffer<FilmPasses> passes_;
  Buffer<FilmSums> sums_;
  Buffer<std::uint64_t> dried_;
  Buffer<Index> vertex_count_, triangle_count_;
};

}  // namespace tactus
