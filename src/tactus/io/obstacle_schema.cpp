/// Fields of a scene's obstacles.
#include "tactus/io/region_schema.h"

namespace tactus {
namespace {

void describe_obstacle_key(FieldVisitor& v, MotionKeyDescription& k) {
  v.real({"time_s", "since the first frame", kRequired}, k.time_s, {"s", 0, 1e6});
  v.vector({"displacement_m", "from its placement, world axes"}, k.displacement_m, kPosition);
  v.real({"angle_deg", "about `axis` through `pivot_m`"}, k.angle_deg, {"deg", -360000, 360000});
}

void check_obstacle_motion(FieldVisitor& v, const ObstacleSetting& o) {
  for (const char* key : {"axis", "pivot_m"}) v.only_when(!o.motion.empty(), key, "there is 'motion'");
  v.check(!o.held || o.motion.empty(), "held",
          "'held' and 'motion' exclude one another: a program moves it, or keyframes");
  v.check(!o.moves() || o.kind != ObstacleShape::plane, o.held ? "held" : "motion",
          "a plane can't move; expected kind box, sphere or mesh");
  if (o.motion.empty()) return;
  v.check(o.motion.size() >= 2, "motion",
          "'motion' has " + std::to_string(o.motion.size()) +
              " keyframe, expected two or more: it moves between them");
  for (std::size_t k = 1; k < o.motion.size(); ++k)
    v.check(o.motion[k].time_s > o.motion[k - 1].time_s, "motion",
            "'time_s' of keyframe " + std::to_string(k + 1) + " of 'motion' is not after the one before");
  v.check(length(o.axis) > 0, "axis", "'axis' is 0, expected a direction");
}

}  // namespace

void describe_placement(FieldVisitor& v, PlacementDescription& p) {
  v.vector({"position_m", "where the body's origin lies in the world (+Y is up)"}, p.position_m, kPosition);
  v.vector({"rotation_deg", "turns about the world's x, then y, then z axis"}, p.rotation_deg,
           {"deg", -360, 360});
  v.real({"scale", "size in the world over size in the shape's coordinates"}, p.scale, positive("", 1000));
}

void describe_obstacle(FieldVisitor& v, ObstacleSetting& o) {
  v.text({"name", "unique name, used in results", kRequired}, o.name);
  v.choice({"kind", "`plane`: solid below its y = 0; `box`; `sphere`; `mesh`: closed", kRequired}, o.kind,
           {{"plane", ObstacleShape::plane},
            {"box", ObstacleShape::box},
            {"sphere", ObstacleShape::sphere},
            {"mesh", ObstacleShape::mesh}});
  v.section({"placement", "from the obstacle's coordinates to the world: scale, rotate, move"},
            [&](FieldVisitor& in) { describe_placement(in, o.placement); });
  v.vector({"size_m", "edges of the box, centred on the obstacle's origin"}, o.size_m, positive("m", 1000));
  v.real({"radius_m", "of the sphere, centred on the obstacle's origin"}, o.radius_m, positive("m", 1000));
  v.path({"path", "closed mesh (.ply .obj .stl .off .gltf .glb)"}, o.path);
  v.real({"unit_m", "metres per unit of length in the mesh file (0.001: millimetres)"}, o.unit_m,
         positive("m", 1000));
  v.list({"motion", "keyframes that it follows, linear in between; without them it stands still"},
         items_of(o.motion, describe_obstacle_key));
  v.vector({"axis", "of the angles, world axes"}, o.axis, {"", -1000, 1000});
  v.vector_or_auto({"pivot_m", "a point on that axis, which moves along"}, o.pivot_m, kPosition,
                   "the obstacle's origin");
  v.boolean({"held", "a program says where it is (`World::set_pose`); until then it is at its placement"},
            o.held);
  check_obstacle_motion(v, o);
  const bool mesh = o.kind == ObstacleShape::mesh;
  v.check(!mesh || !o.path.empty(), "path", "the obstacle lacks the key 'path': the file of its mesh");
  v.only_when(o.kind == ObstacleShape::box, "size_m", "'kind' is box");
  v.only_when(o.kind == ObstacleShape::sphere, "radius_m", "'kind' is sphere");
  for (const char* key : {"path", "unit_m"}) v.only_when(mesh, key, "'kind' is mesh");
}

}  // namespace tactus
