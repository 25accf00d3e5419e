#pragma once
#include "tactus/base/vec.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// Paper and text of score sheets, texture sheets and charts.
inline constexpr Vec3f kPaper{0.98F, 0.98F, 0.973F};
inline constexpr Rgb8 kInk{40, 44, 52}, kFaint{96, 102, 112};

}  // namespace tactus
