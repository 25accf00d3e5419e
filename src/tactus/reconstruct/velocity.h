#pragma once
/// Velocity of every point of a reconstructed surface: one rigid motion per connected piece, registered
/// between consecutive surfaces. On the host.
#include <map>
#include <span>
#include <vector>

#include "tactus/reconstruct/components.h"

namespace tactus {

/// The simplest motion that explains what is seen; noise must not become a velocity.
enum class VelocitySource : std::uint8_t {
  still,     ///< also: the first frame of a piece
  centroid,  ///< difference of the centres of gravity [P 19]: the rigid fit was poor
  rigid,     ///< registered translation and rotation
  borrowed,  ///< of the largest piece: too small and too new (or too changed) to have a motion of its own
};
const char* to_string(VelocitySource source);

/// Constant twist: a point at p moves with v + w x p (world).
struct PieceMotion {
  int label = -1;
  VelocitySource source = VelocitySource::still;
  Vec3d velocity_m_s{};  ///< v: of the world's origin, if it moved along
  Vec3d spin_rad_s{};    ///< w
  double rms_m = 0;      ///< distance left between the surfaces along their normals
  double matched = 0;    ///< share of the points that found a partner
  Vec3d at(Vec3d p_m) const { return velocity_m_s + cross(spin_rad_s, p_m); }
};

struct VelocityOptions {
  double voxel_size_m = 0;  ///< grain of the surfaces, > 0
  int points = 1024;        ///< of each piece that are registered
  int targets = 16384;      ///< of each piece that are searched
  int iterations = 12;
  double max_turn_rad = 1;  ///< between frames; more is a poor fit
  /// Pieces below this share of the largest volume borrow its motion when they can't be registered: most are
  /// phantoms, which silhouettes leave between the parts of what moves.
  double phantom_share = 0.05;
  /// Mean over that many frames while they agree: what a hull adds to its object changes with the view, and
  /// those errors cancel between consecutive frames. Costs (n - 1)/2 frames of delay when motion changes.
  int smoothing_frames = 3;
};

/// Point-to-plane registration (Chen & Medioni 1992) of each labelled piece on the piece with the same label
/// in the frame before, from the motion it had then, and from its centroid's; the better one is kept.
class VelocityTracker {
 public:
  /// @throws Error naming the option out of range.
  explicit VelocityTracker(const VelocityOptions& options);
  ~VelocityTracker();
  VelocityTracker(VelocityTracker&&) noexcept;

  /// @param mesh with normals; its pieces labelled by ComponentTracker
  /// @param dt_s since the last frame; <= 0: a break, everything stands still
  /// @throws Error when the mesh has no normals or the pieces are not of this mesh.
  std::span<const PieceMotion> update(const TriangleMesh& mesh, const MeshComponents& components,
                                      double dt_s);
  /// One per piece of the last frame.
  std::span<const PieceMotion> motions() const { return motions_; }

 private:
  struct Surface;
  PieceMotion measure(const Surface& before, const Surface& now, const PieceMotion& last, double dt_s) const;
  void borrow(const MeshComponents& components);
  PieceMotion smooth(const PieceMotion& measured, const MeshComponent& piece, double dt_s);
  VelocityOptions options_;
  std::map<int, Surface> previous_;
  std::map<int, std::vector<PieceMotion>> known_;  ///< motions of the last frames, the newest last
  std::vector<PieceMotion> motions_;
};

/// Velocity of every vertex [m/s]; 0 for those of no piece.
std::vector<Vec3f> vertex_velocities(const TriangleMesh& mesh, const MeshComponents& components,
                                     std::span<const PieceMotion> motions);

}  // namespace tactus
