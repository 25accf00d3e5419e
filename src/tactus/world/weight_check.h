#pragma once
/// Looks before the first frame for bodies that are too soft to bear their own weight and that of the bodies
/// on them: soft matter of that size is squashed, and stacks of it fall over, in reality, too.
#include <memory>
#include <span>
#include <vector>

#include "tactus/sim/body/soft_body.h"
#include "tactus/sim/notice.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// A warning for each body that nothing holds and whose foot bears more than its modulus can: more pressure
/// than a share of it, or a column that buckles. It names the modulus that would do. Bodies on one that is
/// told of aren't told of. None in a scene with a liquid, which may bear them, or where nothing does.
std::vector<Notice> heavy_bodies(const Scene& scene, std::span<const std::unique_ptr<SoftBody>> bodies);

}  // namespace tactus
