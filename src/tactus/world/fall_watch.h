#pragma once
/// Reports bodies that fall for ever: they missed all that was to catch them.
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/contact/obstacles.h"

namespace tactus {

/// Knows how low anything of a scene lies at its start: bodies, obstacles, the workspace. A body whose centre
/// is far below all of that meets nothing any more. Above a plane nothing is known.
class FallWatch {
 public:
  static constexpr const char* kRemedy =
      "place an obstacle under it, check 'placement' and its unit, or hold it with 'fixed'";
  /// Watches nothing.
  FallWatch() = default;
  /// @param boxes_m of bodies, and of the workspace and the liquid where there are any
  FallWatch(std::span<const ObstacleDescription> obstacles, std::span<const Box3f> boxes_m,
            Vec3d gravity_m_s2);

  /// This body is known to fall.
  void leave_out(const std::string& body) { reported_.insert(body); }
  /// Once a frame and body that nothing holds or touches. @param size_m its longest side
  /// @returns "" or, once a body, where it is and how far below everything
  std::string follow(const std::string& body, Vec3d center_m, double size_m);

 private:
  /// So far below everything: of the body's sizes, and at most.
  static constexpr double kSizes = 20, kMost_m = 10;

  std::optional<Vec3d> down_;   ///< none: watches nothing
  double lowest_m_ = -1e300;    ///< of all there is, along down_
  std::vector<Rigidf> planes_;  ///< T_plane_world
  std::set<std::string> reported_;
};

}  // namespace tactus
