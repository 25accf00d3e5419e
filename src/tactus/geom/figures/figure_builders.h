#pragma once
/// The parts of each built-in figure; used by figures.cpp only.
#include "tactus/geom/figures/figures.h"

namespace tactus {
FigureParts build_hand(const FigureOptions& options);
FigureParts build_rabbit(const FigureOptions& options);
FigureParts build_scalpel(const FigureOptions& options);
FigureParts build_sphere(const FigureOptions& options);
FigureParts build_bowl(const FigureOptions& options);
FigureParts build_liver(const FigureOptions& options);
}  // namespace tactus
