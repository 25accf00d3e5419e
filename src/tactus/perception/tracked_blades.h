#pragma once
/// Blades of a scene that are real tools: their poses, and the strips that their edges swept. They are taken
/// out of the silhouettes, so the hull of a tool, which is fatter than it, pushes nothing; its model does
/// instead.
#include <array>
#include <map>
#include <memory>
#include <optional>

#include "tactus/contact/obstacles.h"
#include "tactus/perception/perception.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/notice.h"
#include "tactus/sim/reach.h"
#include "tactus/tissue/cut/lattice_cutter.h"
#include "tactus/track/blade_tracker.h"

namespace tactus {

class TrackedBlades {
 public:
  /// @throws Error naming the blade and the fault of its model.
  TrackedBlades(const Scene& scene, const BodyAssets& assets, const Rig& rig);
  bool empty() const { return blades_.empty(); }
  /// Observations of tools beside silhouettes.
  struct Seen {
    std::span<const SeenMarker> markers;
    std::span<const DepthImage> depths_m;  ///< one per depth camera of the rig; or none
  };
  /// Takes in new images. @param dt_s since the last ones; 0: the first, or a break
  /// @returns the masks without the tools; valid until the next call
  std::span<const BitMask> follow(std::span<const BitMask> masks, double dt_s, const Seen& seen,
                                  std::vector<Notice>& notices);
  /// Strip that the edge of the scene's blade of this number swept with the last images. Nothing where the
  /// edge is not known well enough, and where it moved less than its uncertainty: noise is no motion.
  cut::BladeStrip strip(std::size_t number) const;
  /// After the last frame: for each blade that was never known, a notice of the things seen instead.
  std::vector<Notice> last_notices() const;
  const TrackedBlade& now(std::size_t number) const;
  /// State of each tracked blade, in the scene's order.
  std::vector<TrackedBlade> now() const;
  /// Obstacles for contact: the given ones, and after them, in place of the tools' hulls, their models.
  std::vector<ObstacleDescription> after(std::vector<ObstacleDescription> obstacles) const;
  /// Motions of the tools that are known and touch, as of the last images. A tool moves from where the last
  /// images had it to where these have it, as the real surface does.
  std::vector<ToolMotion> motions() const;
  /// The reach of each tool that is there and touches.
  std::vector<Reach> reaches() const;
  /// Meshes of the tools that are seen, world.
  std::vector<TriangleMesh> meshes() const;
  /// Axes of the tools whose pose is known in any way.
  std::vector<ToolAxis> axes() const;

 private:
  struct Blade {
    std::size_t number;  ///< among the scene's
    std::string name;
    double two_sigma_m;
    bool touches;
    std::unique_ptr<BladeTracker> tracker;
    std::map<int, std::array<Vec3d, 4>> corners_m;  ///< of its markers, by id, in the model's frame
    BladeState reported = BladeState::absent;
    std::vector<BladeState> warned;  ///< since it was known
    bool was_known = false;
    Vec3d center_m;  ///< of the model's box, in its frame
    ToolMotion motion;
    std::vector<Vec3f> from_m;  ///< where its edge cut last; empty: no stroke
    cut::BladeStrip strip;
    int strips = 0;
  };
  static void follow(Blade& blade, const std::optional<Rigidd>& before, double dt_s);
  void sweep(Blade& blade);
  void report(Blade& blade, std::vector<Notice>& notices) const;

  std::vector<Camera> depth_cameras_;
  std::vector<Blade> blades_;
  std::vector<BitMask> masks_;
};

}  // namespace tactus
