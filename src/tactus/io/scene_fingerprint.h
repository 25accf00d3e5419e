#pragma once
/// Whether two scenes are the same, as far as physics knows.
#include <cstdint>
#include <string>
#include <vector>

namespace tactus {

struct Scene;

/// Hash of all that a scene says below one key.
struct KeyFingerprint {
  std::string key;  ///< "bodies"
  std::uint64_t hash = 0;
};

/// Per key of a scene, but for those of pictures, files that are written, and the cameras' source. Files that
/// a scene names are the same wherever they lie. As many for every scene.
std::vector<KeyFingerprint> scene_fingerprint(const Scene& scene);

}  // namespace tactus
