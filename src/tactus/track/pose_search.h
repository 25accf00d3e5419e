#pragma once
/// Where a tool may be in masks that nothing was found in before.
#include <span>
#include <vector>

#include "tactus/track/pose_fit.h"
#include "tactus/track/pose_seeds.h"

namespace tactus {

/// Poses along the thin parts of masks are scored, and the best fitted coarsely: by points of outlines that
/// are two pixels apart. Tries run side by side on the processor's cores; none depends on another. It owns
/// the memory of those fits.
class PoseSearch {
 public:
  /// @param radius_px of the tool, per camera: thicker parts are something else
  PoseSearch(const OutlineMesh& mesh, std::span<const Camera> cameras, std::span<const int> radius_px,
             PoseFitSettings settings);

  /// @param taken of each camera, or none: pixels of other tools
  /// @param points markers' corners
  /// @returns poses that differ from each other, the best first, to be fitted finely; none where nothing is
  /// thin
  std::vector<Rigidd> find(std::span<const BitMask> masks, std::span<const BitMask> taken,
                           std::span<const SeenPoint> points);

 private:
  struct Try {
    Rigidd T_world_model;
    double wrong = 2;  ///< as PoseFit::wrong
  };
  std::vector<Try> seeds(std::span<const BitMask> masks, std::span<const BitMask> taken) const;
  /// Fits tries from `first` on.
  void fit(std::span<const BitMask> masks, std::span<const SeenPoint> points, std::vector<Try>& tries,
           std::size_t first);
  static void sort(std::vector<Try>& tries);

  const OutlineMesh* mesh_;
  std::vector<int> radius_px_;
  std::vector<PoseFitter> fitters_;  ///< one per coarse fit
};

/// Whether a pose is so far from another that fits of both may end in different ones.
bool is_other_pose(const Rigidd& a, const Rigidd& b, Vec3d center_m);

}  // namespace tactus
