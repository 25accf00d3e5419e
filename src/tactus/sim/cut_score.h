#pragma once
/// A blade's stroke, compared with the line that was planned for it.
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/sim/blade.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/stroke_result.h"

namespace tactus {

/// Where triangles of walls meet the surface that the body had before any cut: edges of one triangle alone
/// whose ends and middle are within 1e-3 spacings of it. That is above the rounding of floats and the 2e-6
/// spacings by which cuts take the surface further in.
/// @param walls in lattice coordinates
std::vector<SkinSegment> skin_line(std::span<const std::array<Vec3d, 3>> walls, const CubeLattice& lattice,
                                   const PointInMesh& skin);

/// A line that a blade is to follow on the skin of a body at rest.
class PlannedLine {
 public:
  /// Lays the polyline onto the surface, in steps of at most a quarter of a spacing.
  /// @throws usage Error naming the point, or the piece between two, that is farther from the surface than a
  /// spacing, and the nearest point that is on it.
  PlannedLine(const PlanDescription& plan, const BodyDescription& body, const BodyShape& shape);

  const std::string& name() const { return name_; }
  const std::string& body() const { return body_; }
  /// On the skin, world.
  const std::vector<Vec3d>& points_m() const { return points_m_; }
  double length_m() const;
  double tolerance_m() const { return tolerance_m_; }

  /// Notes in `cut` where each piece is, and how far off. A piece is on the line's side of the body if its
  /// way into the body is within 60 degrees of that at the nearest point of the line: where a blade leaves a
  /// body again, it follows no line. It is beyond the line if that nearest point is an end.
  /// @returns nothing where no piece is beside the line
  std::optional<LineDeviation> measure(std::vector<SkinSegment>& cut) const;

 private:
  struct Nearest {
    double off_m = 1e30;
    std::size_t piece = 1;   ///< ends at this point
    bool is_beyond = false;  ///< it is an end of the line
  };
  Nearest nearest(Vec3d p_m) const;

  std::string name_, body_;
  std::vector<Vec3d> points_m_, inward_;  ///< of the skin, per point
  double tolerance_m_ = 0;
};

/// Mean force along the blade's way that the energy of new walls asks for, its largest over any way of four
/// spacings: F = G dA / ds. Cubes fall apart whole, so an area is known to one row of them: that mean to a
/// quarter. Ways begin when cubes fell apart.
double peak_cut_force_N(std::span<const CutStep> steps, double energy_J_m2, double spacing_m);

}  // namespace tactus
