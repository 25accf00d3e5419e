/// Tracked blades of a scene, and the conditions that blades put on the scene.
#include <algorithm>
#include <cmath>
#include <map>

#include "tactus/io/region_schema.h"
#include "tactus/rig/marker_dictionaries.h"
#include "tactus/sim/held_blades.h"

namespace tactus {

namespace {

void describe_marker(FieldVisitor& v, BladeMarkerDescription& m) {
  v.integer({"id", "its number in the dictionary", kRequired}, m.id, {"", 0, 1023});
  v.vector({"at", "its middle, in the file's coordinates", kRequired}, m.at, {"", -1e6, 1e6});
  v.vector({"right", "where its pattern's right is, in the file's coordinates", kRequired}, m.right,
           {"", -1e6, 1e6});
  v.vector({"down", "likewise, where its lower side is", kRequired}, m.down, {"", -1e6, 1e6});
  v.real({"size", "edge of its black square, in the file's units", kRequired}, m.size, {"", 1e-6, 1e6});
  const double lengths = length(m.right) * length(m.down);
  v.check(lengths > 0 && std::abs(dot(m.right, m.down)) < 0.01 * lengths, "down",
          "'right' and 'down' of marker " + std::to_string(m.id) +
              " are not at right angles, expected two directions along the sides of its square");
}

}  // namespace

void describe_tracked(FieldVisitor& v, TrackedBladeDescription& t) {
  v.choice({"model", "`scalpel`: 16 cm, as the figure `scalpel` with a `scale` of 0.29; `mesh`: a file"},
           t.model, {{"scalpel", BladeShape::scalpel}, {"mesh", BladeShape::mesh}});
  v.path({"path", "closed mesh of the whole tool (.ply .obj .stl .off .gltf .glb)"}, t.path);
  v.real({"unit_m", "metres per unit of length in the mesh file and of `edge` (0.001: millimetres)"},
         t.unit_m, positive("m", 1000));
  v.list({"edge", "its cutting edge as a polyline, from the tip, in the file's coordinates"},
         items_of(
             t.edge, +[](FieldVisitor& in, Vec3d& at) {
               in.vector({"at", "a point of the edge", kRequired}, at, {"", -1e6, 1e6});
             }));
  v.real_or_auto(
      {"two_sigma_m",
       "it cuts only while every point of its edge is known so well (95 %); else a notice says so"},
      t.two_sigma_m, positive("m", 0.1), "a quarter of the finest `spacing_m` of what it may cut");
  v.boolean(
      {"touches",
       "whether its handle, back and flanks push and rub, beside the cut that its edge makes; a blade that "
       "is thinner than a few cubes and dragged through tissue tears it"},
      t.touches);
  v.list({"markers", "square ArUco markers on it; its source must have photographs"},
         items_of(t.markers, describe_marker));
  v.word({"dictionary", "of the markers, the same for all blades"}, t.dictionary, marker_dictionaries());
  for (const BladeMarkerDescription& m : t.markers)
    v.check(m.id < marker_count(t.dictionary), "markers",
            "marker " + std::to_string(m.id) + " is not in dictionary '" + t.dictionary +
                "', which has 0 to " + std::to_string(marker_count(t.dictionary) - 1));
  const bool mesh = t.model == BladeShape::mesh;
  v.check(!mesh || !t.path.empty(), "path", "the blade lacks the key 'path': the file of its mesh");
  v.check(!mesh || t.edge.size() >= 2, "edge",
          "'edge' has " + std::to_string(t.edge.size()) + " points, expected two or more, from the tip");
  for (const char* key : {"path", "unit_m", "edge"}) v.only_when(mesh, key, "'model' is mesh");
}

void check_blades(FieldVisitor& v, const Scene& scene) {
  const auto cuttable = std::count_if(scene.bodies.begin(), scene.bodies.end(),
                                      [](const BodyDescription& b) { return b.cuttable; });
  v.check(scene.blades.empty() || cuttable > 0, "blades",
          "there are 'blades', but no body has 'cuttable: true'");
  std::map<int, std::string> blade_of;
  const BladeDescription* first = nullptr;
  for (const BladeDescription& blade : scene.blades) {
    if (!blade.tracked || blade.tracked->markers.empty()) continue;
    if (first == nullptr) first = &blade;
    v.check(blade.tracked->dictionary == first->tracked->dictionary, "blades",
            "blade '" + blade.name + "' has markers of '" + blade.tracked->dictionary + "', blade '" +
                first->name + "' of '" + first->tracked->dictionary + "', expected one dictionary");
    for (const BladeMarkerDescription& m : blade.tracked->markers) {
      const auto [known, is_new] = blade_of.try_emplace(m.id, blade.name);
      v.check(is_new, "blades",
              "marker " + std::to_string(m.id) + " is on blade '" + known->second + "' and on blade '" +
                  blade.name + "', expected it once");
    }
  }
  const std::vector<std::string> held = held_names(scene);
  for (std::size_t k = 1; k < held.size(); ++k)
    v.check(std::find(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(k), held[k]) ==
                held.begin() + static_cast<std::ptrdiff_t>(k),
            "blades",
            "an obstacle and a blade with 'held: true' have the name '" + held[k] + "', names must differ");
  for (const BodyDescription& body : scene.bodies)
    v.check(!body.bleeding || scene.fluid, "bodies",
            "body '" + body.name + "' has 'bleeding', but the scene has no 'fluid' that says what flows");
}

}  // namespace tactus
