#pragma once
/// Energies, volumes, strains and stresses of a body, worked out on the host.
#include <span>
#include <vector>

#include "tactus/tissue/body_monitors.h"

namespace tactus {

class BodySolver;
class ExecContext;
struct BodyShape;

/// The body must outlive it.
class BodyMeasures {
 public:
  BodyMeasures(const BodyShape& shape, const TledOptions& elements, const BodySolver& tissue)
      : shape_(shape), elements_(elements), tissue_(tissue) {}
  /// Energies, momentum, volume. Synchronizes.
  /// @param step_s the last substep
  BodyMonitors monitors(ExecContext& ctx, double step_s = 0) const;
  /// Strain and stress of its cubes. Synchronizes.
  std::vector<CubeStrain> strains(ExecContext& ctx) const;
  /// Strain and stress of some of its cubes, whose nodes are at x_m.
  std::vector<CubeStrain> strains(std::span<const Vec3f> x_m, std::span<const Index> cubes) const;

 private:
  const BodyShape& shape_;
  TledOptions elements_;
  const BodySolver& tissue_;
};

}  // namespace tactus
