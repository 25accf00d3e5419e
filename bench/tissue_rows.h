#pragma once
/// Bodies of the tissue benchmarks.
#include "bench.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus::bench {

struct TissueCase {
  std::string name, form;
  CubeLattice lattice;
  ElementMask elements{};  ///< empty: all
  FlsmMaterial matched{};
  TledOptions options{};
  bool per_cube = false;  ///< the row's size counts cubes, not nodes
  float step_s = 0;       ///< 0: the longest that is stable
  float frame_s = 0;      ///< not 0: times are of a whole frame with all its substeps
  int matching_every = 1;
  std::vector<NodeMotion> motions{};
};

/// What a substep has to read and write of a node.
double bytes_per_node(const TissueCase& body);
/// Its substeps while two balls pinch it; on all devices, also where fewer would be faster.
nlohmann::json touched_row(DeviceSet& devices, const TissueCase& body, double bandwidth_B_s);

}  // namespace tactus::bench
