#pragma once
/// The contents of a picture: a snapshot that owns its data, so that the simulation never waits for the
/// picture.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tactus/compute/exec_context.h"
#include "tactus/geom/camera/camera.h"
#include "tactus/geom/camera/camera_bits.h"
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// How a surface looks. Colours are sRGB, 0 to 1 (as in a colour picker).
struct Material {
  Vec3f color{0.8F, 0.8F, 0.8F};
  float roughness = 0.5F;  ///< width of the highlight, 0.05 (wet) to 1 (matt)
  float specular = 0.04F;  ///< reflectance at normal incidence, 0 to 1
  float softness = 0;      ///< light that leaks around the terminator, as through skin or jelly, 0 to 1
  float opacity = 1;       ///< 0 to 1; below 1 the nearest layer is blended over the picture behind it
  bool two_sided = true;   ///< also draw triangles seen from behind
  float wireframe = 0;     ///< strength of the triangles' edges drawn on top, 0 to 1
};

/// Warm clay: real surfaces.
inline Material clay_material() {
  return {.color = {0.83F, 0.57F, 0.43F}, .roughness = 0.55F, .softness = 0.3F};
}
/// Wine red, moist and translucent: virtual soft bodies.
inline Material soft_material() {
  return {.color = {0.66F, 0.10F, 0.17F}, .roughness = 0.32F, .specular = 0.05F, .softness = 0.7F};
}
/// Steel: blades.
inline Material steel_material() {
  return {.color = {0.36F, 0.37F, 0.39F}, .roughness = 0.22F, .specular = 0.7F};
}

/// Photographs that colour a surface fragment by fragment, for the viewer (Shao et al. 2019, "Texture
/// mapping"; PhotoChoice has the formula). Surfaces that wear them have normals.
struct ViewPhotos {
  std::vector<Camera> cameras;     ///< 1 to 64, in the frame of the mesh
  std::vector<ColorImage> images;  ///< one a camera, of its size; an empty one: the camera missed the tick
  Index k = 1;                     ///< cameras that a fragment is coloured from, 1 as in the paper
  float voxel_size_m = 0;          ///< grain of the visibility test, > 0: the voxel of the hull
  Vec3f center_m{};                ///< (mesh frame) middle of the workspace, where that grain is meant
};

/// A surface in the memory of a device. On a GPU that draws, too, it stays there; else it is copied.
struct DeviceSurface {
  ExecContext* ctx = nullptr;  ///< all that made it was submitted here
  View<const Vec3f> positions_m, normals;
  View<const Vec3i> triangles;
  Box3f box_m;              ///< holds it
  View<const Rgb8> photos;  ///< those of ViewPhotos, one after another, instead of `images`; or none
  CameraBits live_photos = ~CameraBits{0};  ///< cameras that have a photo of this tick
};

/// Liquid that lies on a surface, and what dried of it there. Light goes through it to the surface and back.
struct ViewFilm {
  std::vector<float> film_m{}, stain_m{};       ///< at each vertex; film < 0: past its edge
  std::vector<float> edge_m{};                  ///< how far its edge is, < 0 past it; none: nowhere near
  Vec3f scattered{0.15F, 0.004F, 0.006F};       ///< as ViewLiquid's
  Vec3f absorption_1_m{160.F, 1500.F, 1400.F};  ///< likewise
};

/// The flesh of a body that was cut, seen on walls of cuts.
struct ViewFlesh {
  std::vector<Vec3f> rest_m{};   ///< where each vertex is at rest: fibres lie still in the flesh
  std::vector<float> depth_m{};  ///< distance of each of a wall's to the cut's rim; < 0 on skin
  std::vector<Vec3f> lip{};      ///< normal of the skin at the rim, where it is nearest
  float grain_m = 0.001F;        ///< width of a fibre, > 0
  float lip_m = 0.001F;          ///< so wide a wall is round at its rim, > 0
};

struct ViewMesh {
  std::string name;
  TriangleMesh mesh{};  ///< [m]; drawn flat-shaded when it has no normals
  Material material{};
  /// One a vertex, or none: photographed colours, which hold their light already and are shown as they are.
  /// With `photos`, they colour the fragments that no photo shows.
  std::vector<Rgb8> colors{};
  std::shared_ptr<const ViewPhotos> photos{};
  std::optional<DeviceSurface> device{};  ///< instead of `mesh`; stays valid until the picture is drawn
  /// Turns the mesh, and the cameras of its photos with it: data sets have their own idea of up.
  Mat3f R_world_mesh = Mat3f::identity();
  std::optional<ViewFilm> film{};
  std::optional<ViewFlesh> flesh{};
  bool casts_shadow = true;  ///< false: for meshes that only explain the picture, as drawn cameras
};

/// A liquid, drawn from its particles as one smooth surface that light goes through.
struct ViewLiquid {
  std::vector<Vec3f> positions_m{};             ///< of particles; one that isn't finite is nowhere
  float spacing_m = 0.004F;                     ///< of particles at rest, > 0
  Vec3f scattered{0.15F, 0.004F, 0.006F};       ///< linear colour of deep liquid in white light: blood
  Vec3f absorption_1_m{160.F, 1500.F, 1400.F};  ///< of red, green and blue light [1/m], >= 0
};
/// Hardly any colour.
inline ViewLiquid water() { return {.scattered = {0.02F, 0.05F, 0.06F}, .absorption_1_m = {12.F, 4.F, 3.F}}; }

/// A straight line, as wide on the picture wherever it is.
struct ViewLine {
  Vec3f from_m, to_m;
  Vec3f color{0.35F, 0.38F, 0.42F};  ///< sRGB
  float width_px = 1.5F;
};

/// A box of which the edges are drawn, but not those that are nearer than all that is in it.
struct ViewBox {
  Box3f box_m;
  Vec3f color{0.55F, 0.58F, 0.62F};  ///< sRGB
  float width_px = 1.2F;
};

/// A few words beside a place; not where something hides that.
struct ViewLabel {
  Vec3f at_m;
  std::string text;
  Vec3f color{0.16F, 0.17F, 0.20F};  ///< sRGB
  float height_px = 13;
};

struct ViewScene {
  std::vector<ViewMesh> meshes{};
  std::vector<ViewLine> lines{};
  std::vector<ViewBox> boxes{};
  std::vector<ViewLabel> labels{};
  std::vector<ViewLiquid> liquids{};
  bool ground = true;
  std::optional<Vec3f> background{};  ///< sRGB, plain; without: light grey that darkens towards the corners
  float ground_height_m = 0;          ///< y of the ground
  float ground_tile_m = 0.1F;         ///< side of a tile of its pattern
  Vec3f sun{-0.5F, 0.9F, 0.55F};      ///< direction towards the key light, world, any length
};

/// Adds a camera of the rig: its housing and lens, the pyramid of its image's corners up to `depth_m` with
/// its rim, and its name.
void add_camera(ViewScene& scene, const Camera& camera, float depth_m, Vec3f color = {0.20F, 0.42F, 0.60F});
/// Adds those edges of a box that the eye sees behind its contents: the ones of a side whose inside faces the
/// eye. An edge between two sides that face the eye would cross the contents.
void add_far_edges(std::vector<ViewLine>& lines, const ViewBox& box, Vec3f eye_m);

}  // namespace tactus
