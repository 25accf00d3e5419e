#pragma once
/// Whether two scenes are the same, as far as physics knows.
#include <cstdint>

namespace tactus {

struct Scene;

/// Of all values of the schema but those of pictures, files that are written, and cameras' source. Files that
/// a scene names are the same wherever they lie.
std::uint64_t scene_fingerprint(const Scene& scene);

}  // namespace tactus
