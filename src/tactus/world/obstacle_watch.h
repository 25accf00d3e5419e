#pragma once
/// Reports that contact failed: the centre of mass of a body went into or through something.
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tactus/contact/obstacles.h"

namespace tactus {

/// Follows centres of mass from frame to frame. The first time, it only notes where they are. The centre of a
/// ring may be in a thing that the ring lies round: a centre counts where it is in its own body, too.
class ObstacleWatch {
 public:
  static constexpr const char* kRemedy =
      "let it fall or be pressed more slowly, take a larger young_modulus_pa, a smaller spacing_m or 'model: "
      "tled'";
  ObstacleWatch() = default;
  explicit ObstacleWatch(std::vector<ObstacleDescription> obstacles);

  /// Makes the surface that something has now.
  using Surface = std::function<TriangleMesh()>;
  /// Once a frame and body. @returns "" or, the first time for each obstacle, that the body went into it
  std::string follow(const std::string& body, Vec3d center_m, const Surface& own);
  /// Likewise, whether it is inside of something that moves, whose surface is `there`.
  std::string find_in(const std::string& body, Vec3d center_m, const Surface& own, const std::string& what,
                      const Surface& there);
  /// Once a frame, where all were followed: whether it went through another body since the frame before.
  /// Corners of that body's box don't count, nor ways that begin or end in it.
  std::string find_through(const std::string& body, const std::string& other, const Box3f& bounds,
                           const Surface& there);

 private:
  struct Way {
    Vec3d before_m, now_m;  ///< in the last two frames
  };
  struct Watched {
    ObstacleDescription obstacle;
    Box3f bounds;  ///< of a mesh, in its own coordinates
  };
  static bool meets(const Watched& watched, Vec3d from_m, Vec3d to_m);

  std::vector<Watched> watched_;
  std::map<std::string, Way> way_;  ///< of centres, by body
  std::map<std::pair<std::string, std::string>, bool> reported_;
};

}  // namespace tactus
