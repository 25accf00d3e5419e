#pragma once
/// Blades of a scene that are real tools: where they are, and what their edges swept. They are taken out of
/// the silhouettes, so the hull of a tool, which is fatter than it, pushes nothing.
#include <memory>

#include "tactus/rig/frame_source.h"
#include "tactus/sim/body_shape.h"
#include "tactus/sim/notice.h"
#include "tactus/tissue/cut/lattice_cutter.h"
#include "tactus/track/blade_tracker.h"

namespace tactus {

class TrackedBlades {
 public:
  /// @throws Error naming the blade and what is wrong with its model.
  TrackedBlades(const Scene& scene, const BodyAssets& assets, const Rig& rig);
  bool empty() const { return blades_.empty(); }
  /// Takes in new images. @param dt_s since the last ones; 0: the first, or a break
  /// @returns the masks without the tools; valid until the next call
  std::span<const BitMask> follow(std::span<const BitMask> masks, double dt_s, std::vector<Notice>& notices);
  /// What the edge of the scene's blade of this number swept with the last images. Nothing where it is not
  /// known well enough, and where it moved less than it is known: noise is no motion.
  cut::BladeStrip strip(std::size_t number) const;
  /// Nothing follows those.
  void forget_strips();
  const TrackedBlade& now(std::size_t number) const;
  /// Of those that are seen, world.
  std::vector<TriangleMesh> meshes() const;

 private:
  struct Blade {
    std::size_t number;  ///< among the scene's
    std::string name;
    double two_sigma_m;
    std::unique_ptr<BladeTracker> tracker;
    BladeState told = BladeState::absent;
    std::vector<Vec3f> from_m;  ///< where its edge cut last; empty: no stroke
    cut::BladeStrip strip;
    int strips = 0;
  };
  void sweep(Blade& blade);
  void tell(Blade& blade, std::vector<Notice>& notices) const;

  std::vector<Blade> blades_;
  std::vector<BitMask> masks_;
};

}  // namespace tactus
