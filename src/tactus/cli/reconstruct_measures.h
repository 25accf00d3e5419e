#pragma once
/// Measurements of a mesh, for the table and the JSON of `tactus reconstruct`.
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "tactus/geom/figures/figures.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

/// Root mean square distance of the vertices from the figure's true surface [m].
double surface_rms_m(const TriangleMesh& mesh, const FigureShape& truth);

/// Counts, topology and volume [m^3] of the mesh, and per camera how its silhouette agrees with the masks
/// (IoU and recall, 0 to 1). @param given (cameras) the masks as they came, empty where a camera missed the
/// tick; where the frame's were repaired, the mesh is compared with both
nlohmann::json measure(const TriangleMesh& mesh, const Rig& rig, const FrameSet& frame,
                       std::span<const BitMask> given);

/// The agreement with the repaired masks, beside that with the masks as they came; "" without repairs.
/// @param row of `measure`
std::string repaired_text(const nlohmann::json& row);

/// Memory and time of a frame, where they are large; else "". Those of the hand in a cube on one core, at
/// resolutions of 256 to 2048: they follow the surface, 4.8 GB and 34 s at 2048, most of it to measure.
std::string cost_text(int resolution, const Box3f& workspace_m);

}  // namespace tactus
