#pragma once
/// Names of a body's nodes and cubes for messages, and the causes that act near them.
#include <string>

#include "tactus/base/vec.h"

namespace tactus {

class BodySolver;
class SlabPoints;
struct BodyDescription;
struct BodyShape;

/// The body must outlive it.
class BodyPlaces {
 public:
  BodyPlaces(const BodyDescription& description, const BodyShape& shape, const BodySolver& tissue,
             const SlabPoints& points)
      : description_(description), shape_(shape), tissue_(tissue), points_(points) {}
  /// "node 17, at rest at (0.1, 0.2, 0.3) m".
  std::string node_text(Index node) const;
  /// "cube 17, at rest round (0.1, 0.2, 0.3) m in region 'tumour'".
  std::string cube_text(Index cube) const;
  /// Centre of a cube at rest [m].
  Vec3f cube_center_m(Index cube) const;
  /// The causes that act on the body next to its point p_m at rest: "'moved[0]' (grip) moves it, at up to 0.3
  /// m/s", "'fixed' holds it, 0.02 m from there"; "" for nothing. Synchronizes.
  std::string acting_near(Vec3f p_m) const;

 private:
  const BodyDescription& description_;
  const BodyShape& shape_;
  const BodySolver& tissue_;
  const SlabPoints& points_;
};

}  // namespace tactus
