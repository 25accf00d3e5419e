#pragma once
/// Which parts of a body the regions of a scene mean.
#include <set>

#include "tactus/sim/body/body_shape.h"

namespace tactus {

/// "1, 2, 5".
std::string label_list(const std::set<VoxelLabel>& labels);

class RegionFinder {
 public:
  /// @param solid which labels of a volume are the body
  RegionFinder(const BodyDescription& body, const BodyAssets& assets, const CubeLattice& lattice,
               const std::function<std::set<VoxelLabel>(const LabelVolume&)>& solid);

  bool holds_cube(const SpaceRegion& region, std::size_t cube) const;
  /// By where they rest; with labels, the corners of cubes. Ascending.
  std::vector<Index> nodes_in(const SpaceRegion& region) const;
  /// "" or the labels that there are, for messages.
  std::string hint(const SpaceRegion& region) const;

 private:
  const BodyDescription& body_;
  const CubeLattice& lattice_;
  std::vector<VoxelLabel> labels_;  ///< per cube; empty where no region asks for it
};

/// Enter the description's fixed, moved and loaded regions into the shape. @throws Error naming a moved
/// region without nodes or a loaded one without triangles. Fixed regions without nodes are a warning.
void fix_nodes(const BodyDescription& body, const RegionFinder& finder, BodyShape& shape);
void move_nodes(const BodyDescription& body, const RegionFinder& finder, BodyShape& shape);
void load_surface(const BodyDescription& body, BodyShape& shape);

}  // namespace tactus
