#pragma once
/// The files that the bodies of a scene are made of.
#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// Reads the meshes [m] and label volumes that the scene's bodies name.
/// @throws Error naming the file that can't be read.
BodyAssets load_body_assets(const Scene& scene);

}  // namespace tactus
