#pragma once
/// A scene to cut.

namespace tactus {

/// A block of 8 x 8 x 4 cubes hangs from its top; until 0.5 s, a blade goes through the layer of cubes
/// between heights of 0.55 and 0.575 m.
inline constexpr const char* kSlicedBlock = R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
bodies:
  - name: block
    contact: false
    cuttable: true
    cut_capacity: 400
    shape: {kind: box, size_m: [0.2, 0.2, 0.1]}
    placement: {position_m: [0, 0.6, 0.6]}
    spacing_m: 0.025
    material: {model: tled, young_modulus_pa: 30000, poisson_ratio: 0.4}
    fixed: [{kind: half_space, point_m: [0, 0.09, 0], normal: [0, -1, 0]}]
blades:
  - name: slicer
    from_m: [-0.15, 0.56, 0.5]
    to_m: [-0.15, 0.56, 0.7]
    path: [{time_s: 0.1}, {time_s: 0.5, displacement_m: [0.3, 0, 0]}]
)";

}  // namespace tactus
