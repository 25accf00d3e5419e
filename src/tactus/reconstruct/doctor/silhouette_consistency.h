#pragma once
/// How well silhouettes and cameras agree, on a lattice of samples: cheap enough to try a thousand rigs.
#include <span>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// A camera and its silhouette. The mask stays where it is; null or 0x0: it missed the tick.
struct SeenView {
  Camera camera;
  const BitMask* mask = nullptr;
  bool has_mask() const { return mask != nullptr && !mask->words.empty(); }
};

/// The hull of some views as samples, and the recall of views when further ones carve it.
///
/// A sample is kept when every view that sees it has a set pixel within 0.6 of the spacing's image. Recall of
/// a view is the share of its mask that the kept samples cover, each a square of the spacing's image. So both
/// forgive about one and a half spacings, and a right rig has a recall near 1, thin parts included.
class SilhouetteConsistency {
 public:
  /// @param trusted carve; @param samples along the longest side of the box, 8 to 256
  SilhouetteConsistency(const Box3f& box_m, std::span<const SeenView> trusted, int samples = 96);

  /// Recall of each of `trusted`, then of each of `further`, when those carve, too; 1 for a view without
  /// mask. A further view also carves samples outside of its image where its mask ends within, and has a
  /// recall of 0 when it sees less than half of the trusted hull: one that looks elsewhere explains nothing.
  std::vector<double> recalls(std::span<const SeenView> further = {}) const;
  /// The mask of a view, and how much the trusted hull alone covers of it.
  double covered(const SeenView& view) const;
  /// Those pixels of the view's image that the trusted hull may cover (grown by a spacing).
  BitMask silhouette(const Camera& camera) const;

  std::size_t sample_count() const { return points_m_.size(); }
  const std::vector<Vec3f>& points_m() const { return points_m_; }
  double spacing_m() const { return spacing_m_; }
  const Box3f& box_m() const { return box_m_; }
  std::span<const SeenView> trusted() const { return trusted_; }

 private:
  /// Squares of a view's image, and which of them the mask sets.
  struct Cells {
    Index step_px = 1, columns = 0, rows = 0;
    std::vector<std::uint8_t> set;
    std::int64_t set_count = 0;
  };
  Cells cells_of(const SeenView& view) const;
  double image_of_spacing_px(const Camera& camera) const;
  /// False when the view sees less than half of the samples.
  bool carve(const SeenView& view, std::vector<std::uint8_t>& kept) const;
  double recall(const SeenView& view, const Cells& cells, std::span<const std::uint8_t> kept) const;

  Box3f box_m_;
  double spacing_m_ = 0;
  std::vector<SeenView> trusted_;
  std::vector<Cells> trusted_cells_;
  std::vector<Vec3f> points_m_;
};

}  // namespace tactus
