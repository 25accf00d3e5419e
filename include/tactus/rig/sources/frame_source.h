#pragma once
/// Sets of images from cameras, and the one interface behind which data sets, videos and synthetic rigs
/// stand.
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

class Figure;

/// The fixed part of a recording: cameras (undistorted) and the space they watch.
struct Rig {
  std::vector<Camera> cameras;        ///< of the silhouettes
  std::vector<Camera> depth_cameras;  ///< time-of-flight
  Box3f workspace_m;                  ///< the space that is reconstructed
  int slack_px = 0;                   ///< by how much silhouettes of different cameras are known to disagree
};

/// A square marker that a camera sees. Its corners are clockwise from the top left of its pattern.
struct SeenMarker {
  int camera = 0, id = 0;
  std::array<Vec2d, 4> corners_px{};
};

/// The images of the rig at one trigger tick.
struct FrameSet {
  std::int64_t tick = 0;
  double time_s = 0;      ///< of the capture, on the source's clock
  double captured_s = 0;  ///< the same on the clock of now_s(); 0: not known, then as it comes
  double released_s = 0;  ///< where that is known: when the set was put together, on the clock of now_s()
  std::vector<BitMask>
      silhouettes;  ///< one per camera, undistorted; an empty mask (0x0): this camera missed the tick
  std::vector<AlphaImage> alphas;         ///< where asked for, of silhouettes before a room: one per camera
  std::vector<ColorImage> colors;         ///< one per camera (empty: it missed the tick), or none
  std::vector<DepthImage> depths_m;       ///< radial [m], one per depth camera (empty: it missed the tick)
  std::vector<SeenMarker> markers;        ///< where asked for (markers.h), of all cameras
  std::optional<double> truth_volume_m3;  ///< synthetic sources only
};

enum class NextFrame : std::uint8_t {
  success,
  nothing_new,  ///< no images by now: only `time_s` of the set means something, and it goes on from there
  bad_frame,    ///< no camera delivered this tick (reasons in `status`); the next may be fine
  no_more_data,
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  virtual const Rig& rig() const = 0;
  /// Number of frames when it is known beforehand.
  virtual std::optional<int> frame_count() const = 0;
  /// Frames per second; none where frames have no times (a single capture).
  virtual std::optional<double> fps() const { return {}; }
  /// Fills `frame` (its memory is reused) with the next set.
  virtual NextFrame next(FrameSet& frame) = 0;
  /// Why the last frame was bad, which of its cameras missed the tick and why, or its oddities ("camera
  /// 'cam2': the mask is all white"); empty when all is well.
  virtual std::string status() const = 0;
  /// Damage of the whole source that was found when it was opened ("it was cut off after 299 frames, at byte
  /// 1234"); empty where it is whole. Frames may be missing, so a program that shows them says so, also where
  /// the source ends well.
  virtual std::string damage() const { return ""; }
  /// The figure that a synthetic source films, for comparisons with the truth; nullptr elsewhere.
  virtual const Figure* truth() const { return nullptr; }
  /// How the links to live cameras are, as JSON (docs/live.md); empty where there are none.
  virtual std::string links_json() const { return ""; }
};

/// Passes everything on; derived filters override the calls that they change.
class SourceFilter : public FrameSource {
 public:
  explicit SourceFilter(std::unique_ptr<FrameSource> source) : source_(std::move(source)) {}
  const Rig& rig() const override { return source_->rig(); }
  std::optional<int> frame_count() const override { return source_->frame_count(); }
  std::optional<double> fps() const override { return source_->fps(); }
  NextFrame next(FrameSet& frame) override { return source_->next(frame); }
  std::string status() const override { return source_->status(); }
  std::string damage() const override { return source_->damage(); }
  const Figure* truth() const override { return source_->truth(); }
  std::string links_json() const override { return source_->links_json(); }

 private:
  std::unique_ptr<FrameSource> source_;
};

}  // namespace tactus
