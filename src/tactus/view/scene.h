#pragma once
/// What a picture shows: a snapshot that owns its data, so that the simulation never waits for the picture.
#include <string>
#include <vector>

#include "tactus/geom/camera.h"
#include "tactus/geom/image.h"
#include "tactus/geom/mesh.h"

namespace tactus {

/// How a surface looks. Colours are sRGB, 0 to 1 (what a colour picker shows).
struct Material {
  Vec3f color{0.8F, 0.8F, 0.8F};
  float roughness = 0.5F;  ///< width of the highlight, 0.05 (wet) to 1 (matt)
  float specular = 0.04F;  ///< reflectance at normal incidence, 0 to 1
  float softness = 0;      ///< light that leaks around the terminator, as through skin or jelly, 0 to 1
  float opacity = 1;       ///< 0 to 1; below 1 the nearest layer is blended over what is behind it
  bool two_sided = true;   ///< also draw triangles seen from behind
  float wireframe = 0;     ///< strength of the triangles' edges drawn on top, 0 to 1
};

/// Warm clay: what is real.
inline Material clay_material() {
  return {.color = {0.83F, 0.57F, 0.43F}, .roughness = 0.55F, .softness = 0.3F};
}
/// Wine red, moist and translucent: what is soft and virtual.
inline Material soft_material() {
  return {.color = {0.66F, 0.10F, 0.17F}, .roughness = 0.24F, .specular = 0.05F, .softness = 0.7F};
}

struct ViewMesh {
  std::string name;
  TriangleMesh mesh;  ///< [m], world; drawn flat-shaded when it has no normals
  Material material{};
  /// One a vertex, or none: photographed colours, which hold their light already and are shown as they are.
  std::vector<Rgb8> colors{};
};

/// A straight line, as wide on the picture wherever it is.
struct ViewLine {
  Vec3f from_m, to_m;
  Vec3f color{0.35F, 0.38F, 0.42F};  ///< sRGB
  float width_px = 1.5F;
};

struct ViewScene {
  std::vector<ViewMesh> meshes;
  std::vector<ViewLine> lines;
  bool ground = true;
  float ground_height_m = 0;      ///< y of the ground
  float ground_tile_m = 0.1F;     ///< side of a tile of its pattern
  Vec3f sun{-0.5F, 0.9F, 0.55F};  ///< direction towards the key light, world, any length
};

/// Adds the pyramid of a camera of the rig: the rays of the image's corners up to `depth_m`, and its rim.
void add_frustum(ViewScene& scene, const Camera& camera, float depth_m, Vec3f color = {0.20F, 0.42F, 0.60F});
/// Adds the twelve edges of a box (the workspace).
void add_box(ViewScene& scene, const Box3f& box_m, Vec3f color = {0.55F, 0.58F, 0.62F});

}  // namespace tactus
