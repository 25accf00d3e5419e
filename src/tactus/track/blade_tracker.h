#pragma once
/// A known blade, followed from frame to frame by silhouettes. It says where the edge is only when it knows.
#include <array>
#include <string>

#include "tactus/track/blade_model.h"
#include "tactus/track/pose_filter.h"
#include "tactus/track/pose_search.h"

namespace tactus {

struct BladeTrackerSettings {
  double two_sigma_m = 0.005;  ///< of any point of the edge: above, it is refused
  double most_m_s = 5;         ///< of the edge: faster is a mistake, not a motion
  /// ShapeEvidence::misfit_px: above, another shape is seen. The second is of the residuals' root mean
  /// square.
  double most_misfit_px = 0.2, most_misfit_of_noise = 0.16;
  int equal_tools = 1;  ///< of this shape in the scene; when more are seen, which is which isn't known
  PoseFitSettings fit;
  PoseFilterSettings motion;
};

enum class BladeState : std::uint8_t {
  absent,     ///< not found
  ambiguous,  ///< found, but two poses explain the masks about as well so far
  misfit,     ///< found, but masks show another shape there
  twins,      ///< found, and more tools of its shape than there are
  unsure,     ///< followed, but the edge is not known well enough
  jumped,     ///< the edge moved faster than it can
  known,
};

/// "absent", "ambiguous", ...
const char* blade_state_name(BladeState state);

struct TrackedBlade {
  BladeState state = BladeState::absent;
  Rigidd T_world_model;
  double two_sigma_m = 0;  ///< of the edge's least known point, in its least known direction
  double missing = 1;      ///< share of the model's picture where masks are clear
  double misfit_px = 0;    ///< as ShapeEvidence's, and the next
  double edge_covered = 0;
  double residual_px = 0;     ///< root mean square along outlines in the last frame
  Matrix6 covariance;         ///< of a turn about the model's centre [rad] and a shift [m], world axes
  std::vector<Vec3f> edge_m;  ///< world
  bool is_seen() const { return state >= BladeState::unsure; }
};

class BladeTracker {
 public:
  /// @param middle_m about where tools are: their size in pictures follows from it
  /// @throws Error as check_blade_model.
  BladeTracker(const BladeModel& model, std::span<const Camera> cameras, Vec3d middle_m,
               const BladeTrackerSettings& settings = {});
  BladeTracker(const BladeTracker&) = delete;
  BladeTracker& operator=(const BladeTracker&) = delete;
  /// The next frame. @param dt_s since the last one; 0: the first, or a break
  /// @param taken of each camera, or none: pixels of other tools, which this one isn't
  /// @param more markers' corners, if two cameras see them, tell the first pose, too
  const TrackedBlade& update(std::span<const BitMask> masks, double dt_s, std::span<const BitMask> taken = {},
                             const PoseEvidence& more = {});
  const TrackedBlade& now() const { return now_; }
  const BladeModel& model() const { return model_; }
  /// From end to end of its longest axis, in the model's frame.
  std::array<Vec3d, 2> axis_m() const;
  /// In how many frames something thin was there that it doesn't fit, since it was known.
  int unexplained_frames() const { return unexplained_frames_; }
  /// Sets the pixels that show it, and those beside them.
  void add_to(std::span<BitMask> masks) const;
  /// Clears them where no hand is: in parts of the masks that are as thin as it. Not where another shape is.
  void take_from(std::span<BitMask> masks) const;

 private:
  /// A pose that explains the masks so far.
  struct Hypothesis {
    PoseFitter fitter;
    PoseFilter filter;
    PoseFit fit;
    ShapeEvidence shape;
    std::vector<double> surprises;  ///< of each frame since it was found, while there are others
    int lost_frames = 0;
  };
  /// @returns whether they are those of the last frame
  bool remember(std::span<const BitMask> masks);
  void follow(Hypothesis& hypothesis, std::span<const BitMask> masks, double dt_s, const PoseEvidence& more);
  /// @returns whether there was anything to try
  bool seek(std::span<const BitMask> masks, std::span<const BitMask> taken, const PoseEvidence& more);
  void drop_worse();
  /// Whether a tool of this shape is elsewhere, too.
  bool has_twin(std::span<const BitMask> masks, std::span<const BitMask> taken);
  void judge();
  /// Whether the masks show another shape there. @param times of the most that a right one is off by
  bool shows_another(const Hypothesis& h, double times) const;
  /// The state of a hypothesis that shows the tool.
  BladeState state_of(const Hypothesis& h, double displacement_m) const;
  double two_sigma_m(const Hypothesis& of) const;
  /// The part of a picture that shows it, with so many pixels around.
  struct Part {
    Index first_word = 0, first_row = 0;
    BitMask own;  ///< pixels that it covers, grown by a few
  };
  Part part(const TriangleMesh& posed, std::size_t camera, int around_px) const;
  TriangleMesh posed() const;
  TriangleMesh facing(const TriangleMesh& posed, const Camera& camera) const;

  BladeModel model_;
  OutlineMesh mesh_;
  BladeTrackerSettings settings_;
  std::vector<Camera> cameras_;
  std::vector<int> radius_px_;  ///< of the tool, per camera
  PoseSearch search_;
  TrackedBlade now_;
  std::vector<Hypothesis> hypotheses_;  ///< the best first
  std::vector<BitMask> last_masks_;
  int frames_ = 0;  ///< since one was left
  int pause_frames_ = 0;
  bool is_twin_ = false;
  int twin_frames_ = 0;  ///< until it is looked for again
  int unexplained_frames_ = 0;
  double since_known_s_ = 0;
  std::vector<Vec3f> last_edge_m_;  ///< when it was known or jumped
};

}  // namespace tactus
