#pragma once
/// The films of a scene's liquid on its bodies and obstacles, in the frame.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tactus/compute/side_stream.h"
#include "tactus/fluid/film/film_exchange.h"
#include "tactus/fluid/liquid.h"
#include "tactus/fluid/liquid_report.h"
#include "tactus/frame/readback.h"
#include "tactus/frame/schedule.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/sim/film_obstacles.h"
#include "tactus/sim/real_film.h"

namespace tactus {

/// Whether the scene's liquid makes a film on bodies and obstacles: where the scene says so, or leaves it
/// open and a body bleeds, with DFSPH and surface tension that holds the film's edge.
bool has_film(const Scene& scene);

/// Owns a film on each body that it is given, one on obstacles and one on the real surface, on the first
/// device. Once a frame, before its substeps, a film flows on the body's surface as the last frame left it;
/// then particles and film exchange. Cuts come between frames, new meshes of the real surface with images.
class SceneFilm {
 public:
  SceneFilm(ExecContext& ctx, const Scene& scene, Liquid& liquid);
  /// Its walls stop the liquid, too. Both must outlive the schedule's runs.
  void add_body(SoftBody& body);
  /// Once the body was rebuilt: its film is dry, and as it was added. Stages are added anew.
  void renew(SoftBody& body);
  /// And on the floor of the liquid's box. @param notices for those that are too large
  void add_obstacles(std::span<const ObstacleDescription> obstacles, std::vector<Notice>& notices);
  /// Both must outlive this. @param mesh of the real surface: views that stay @param cell_m its voxels
  void add_real(const RealSurface& real, std::function<MeshView()> mesh, float cell_m);
  /// Before a frame. @param T_world of the obstacles that move, at the end of the last frame
  void place_obstacles(std::span<const Rigidd> T_world);
  /// Between frames. A recorded frame must be recorded anew.
  void set_gravity(Vec3d gravity_m_s2);
  /// Before those of wounds and of the liquid.
  void add_stages(Schedule& schedule, Readback& readback);
  SceneFilmReport report(const Readback& readback) const;
  /// When a body was cut, between frames. Synchronizes.
  void follow_cut(const SoftBody& body);
  /// Once bodies have their cuts. Synchronizes.
  void archive(StateArchive& a);

  /// The film and stain on a body. Synchronizes. @param surface of the body now
  FilmThickness thickness(const SoftBody& body, const TriangleMesh& surface) const;
  /// Obstacles on which something lies, and the real surface if it does there. Synchronizes. @param T_world
  /// of those that move, now
  std::vector<WetObstacle> wet_obstacles(std::span<const Rigidd> T_world) const;

 private:
  struct Coat {
    SoftBody* body = nullptr;  ///< nullptr: obstacles
    std::unique_ptr<Film> film;
    std::unique_ptr<FilmExchange> exchange;
    std::unique_ptr<SideStream> touching, flowing;  ///< where it looks for particles, and flows
    Readback::Place sums, ledger;
    Index vertices = 0;  ///< of the surface, at the last cut
  };
  /// On a body, or on the obstacles.
  FilmSurface surface_of(const SoftBody* body) const;
  Coat& add_coat(const FilmSurface& surface, Index most_incident, float reach_m, Index vertices,
                 bool is_still);
  FilmSettings film_settings() const;
  FilmExchangeSettings exchange_settings() const;
  void run(View<const FrameParams> frame);
  FilmSkin skin(const Coat& coat, View<const FrameParams> frame) const;
  void add_wet_obstacles(std::span<const Rigidd> T_world, std::vector<WetObstacle>& all) const;

  ExecContext& ctx_;
  Liquid& liquid_;
  float gravity_m_s2_, drying_m_s_;
  std::vector<Coat> coats_;
  std::unique_ptr<FilmObstacles> obstacles_;  ///< those of the coat without a body
  std::unique_ptr<RealFilm> real_;
};

}  // namespace tactus
