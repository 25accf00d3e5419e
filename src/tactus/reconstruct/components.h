#pragma once
/// The separate pieces of a reconstructed surface: how large, where, how they lie, and which is which from
/// frame to frame. On the host.
#include <vector>

#include "tactus/geom/mesh.h"

namespace tactus {

/// One connected piece of a mesh. Moments are those of the enclosed volume (divergence theorem).
struct MeshComponent {
  int label = -1;  ///< given by ComponentTracker; -1: none yet
  Index vertices = 0, triangles = 0;
  double volume_m3 = 0;  ///< negative: the wall of a cavity
  double area_m2 = 0;
  Vec3d centroid_m;  ///< centre of the volume; of the area where there is none
  Mat3d axes;      ///< rows: unit principal axes, the longest first, right-handed; signs see ComponentTracker
  Vec3d extent_m;  ///< standard deviation of the volume along each axis
};

struct MeshComponents {
  std::vector<MeshComponent> pieces;  ///< largest volume first
  std::vector<Index> of_vertex;       ///< index into pieces; -1: the vertex is in no triangle
};

/// Pieces that share no vertex. @throws Error when a triangle has a vertex that is not there.
MeshComponents find_components(const TriangleMesh& mesh);

/// Keeps labels over time: a piece gets the label of the one that was (or moved on steadily) nearest to it,
/// one each, nearest pairs first; what was never seen gets the next number. Labels that vanish are remembered
/// for a while, so that a hand may leave the view for a moment, or touch another and let go. The axes of a
/// labelled piece point where they pointed before: of their two signs, the nearer.
class ComponentTracker {
 public:
  /// @param reach how far a piece may move between two frames, in multiples of its own size (the longest
  /// standard deviation). @param memory_frames frames for which a vanished label is kept
  explicit ComponentTracker(double reach = 3, int memory_frames = 15)
      : reach_(reach), memory_frames_(memory_frames) {}
  /// Labels the pieces of the next frame.
  void update(MeshComponents& components);

 private:
  struct Known {
    int label = 0;
    Vec3d centroid_m, step_m;
    Mat3d axes;
    double volume_m3 = 0, size_m = 0;
    int unseen = 0;
  };
  double reach_;
  int memory_frames_, next_label_ = 0;
  std::vector<Known> known_;
};

}  // namespace tactus
