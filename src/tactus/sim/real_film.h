#pragma once
/// The film of a scene's liquid on the real surface, whose mesh is a new one with each image.
#include <functional>

#include "tactus/compute/side_stream.h"
#include "tactus/contact/real/real_surface.h"
#include "tactus/fluid/film/film_carry.h"
#include "tactus/fluid/film/film_exchange.h"
#include "tactus/fluid/liquid.h"
#include "tactus/fluid/liquid_report.h"
#include "tactus/frame/readback.h"

namespace tactus {

/// A name that no obstacle has.
inline constexpr const char* kRealSurfaceName = "the real surface";

/// Reconstructs nothing: it is told of the mesh and its components' motions. While nothing lies there and no
/// particle is near, there is no surface to work on.
class RealFilm {
 public:
  /// Longest edge of a reconstructed surface's triangle, in cells; and so far, in cells, film looks for the
  /// new surface.
  static constexpr float kLongestEdge = 1.75F, kCarryReach = 2;
  static constexpr Index kMostVertices =
      1 << 17;  ///< of a mesh that may be wet; it has twice as many triangles

  /// @param exchange without `reach_m` and `is_new` @param mesh the views that it will always have
  /// @param real,mesh must outlive this
  RealFilm(ExecContext& ctx, const FilmSettings& film, FilmExchangeSettings exchange, float cell_m,
           const RealSurface& real, std::function<MeshView()> mesh);

  /// After the real surface has taken over a new mesh: the film goes there.
  void carry();
  /// Before a frame's substeps: the film flows, and finds what it exchanges. Beside other films.
  void flow(View<const FrameParams> frame, Liquid& liquid);
  /// After that, it exchanges with particles.
  void exchange(View<const FrameParams> frame, Liquid& liquid);
  void set_gravity_m_s2(float gravity_m_s2) { exchange_.set_gravity_m_s2(gravity_m_s2, film_); }
  void add_readback(Readback& readback);
  /// Adds the film that lies there, and that which waits for the surface.
  void add_report(const Readback& readback, SceneFilmReport& all) const;
  /// Once the real surface has the mesh of the last images. Synchronizes.
  void archive(StateArchive& a);
  /// The wet part of the surface, as it was captured last; no triangles where it is dry. Synchronizes.
  WetObstacle wet() const;

 private:
  void link();
  FilmSurface surface() const;

  ExecContext& ctx_;
  const RealSurface& real_;
  std::function<MeshView()> mesh_;
  float near_m_;
  Film film_;
  FilmExchange exchange_;
  FilmCarry carry_;
  SideStream touching_;
  Buffer<Index> wanted_, counts_;
  Buffer<Vec3f> x_m_, normal_;
  Readback::Place sums_, ledger_, waiting_;
};

}  // namespace tactus
