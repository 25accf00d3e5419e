// Regions of bodies: those that are held, painted, moved and loaded.
#include "tactus/io/region_schema.h"
#include "tactus/geom/maths/held_axes.h"

#include <algorithm>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"

namespace tactus {

void describe_name(FieldVisitor& v, const Field& field, std::string& name) {
  v.text(field, name);
  constexpr std::size_t kMaxBytes = 100;  // file systems allow 255, and frame numbers follow
  const bool dots = name == "." || name == "..", slash = name.find('/') != std::string::npos;
  v.check(!dots && !slash && name.size() <= kMaxBytes, field.name,
          "'" + std::string(field.name) + "' is '" + name.substr(0, kMaxBytes) +
              "', expected a name of at most 100 bytes that a file can have: not . or .., and without '/'");
}

void describe_box(FieldVisitor& v, BoxRegion& box) {
  v.vector({"min_m", "corner with the smallest coordinates", kRequired}, box.min_m, kPosition);
  v.vector({"max_m", "corner with the largest coordinates", kRequired}, box.max_m, kPosition);
  const bool ok = box.min_m.x < box.max_m.x && box.min_m.y < box.max_m.y && box.min_m.z < box.max_m.z;
  v.check(ok, "max_m", "'max_m' must be larger than 'min_m' along x, y and z");
}

void describe_frame_of(FieldVisitor& v, CoordinateFrame& frame) {
  v.choice({"frame", "`body`: the shape's own coordinates, before placement; `world`: after"}, frame,
           {{"body", CoordinateFrame::body}, {"world", CoordinateFrame::world}});
}

namespace {

void describe_region(FieldVisitor& v, SpaceRegion& r) {
  v.choice({"kind",
            "`box`, `sphere`, `half_space`: everything behind a plane; `label`: cubes mostly of these labels "
            "(bodies of "
            "a label volume)",
            kRequired},
           r.kind,
           {{"box", RegionKind::box},
            {"sphere", RegionKind::sphere},
            {"half_space", RegionKind::half_space},
            {"label", RegionKind::label}});
  describe_frame_of(v, r.frame);
  v.vector({"min_m", "box: corner with the smallest coordinates"}, r.box.min_m, kPosition);
  v.vector({"max_m", "box: corner with the largest coordinates"}, r.box.max_m, kPosition);
  v.vector({"center_m", "sphere: its centre"}, r.center_m, kPosition);
  v.real({"radius_m", "sphere: its radius"}, r.radius_m, positive("m", 1000));
  v.vector({"point_m", "half_space: a point on the plane"}, r.point_m, kPosition);
  v.vector({"normal", "half_space: points out of the region"}, r.normal, {"", -1000, 1000});
  v.integers({"labels", "label: which"}, r.labels, {"", 1, 65535});
  const bool box = r.kind == RegionKind::box, half_space = r.kind == RegionKind::half_space;
  for (const char* key : {"min_m", "max_m"}) v.only_when(box, key, "'kind' is box");
  for (const char* key : {"center_m", "radius_m"})
    v.only_when(r.kind == RegionKind::sphere, key, "'kind' is sphere");
  for (const char* key : {"point_m", "normal"}) v.only_when(half_space, key, "'kind' is half_space");
  v.only_when(r.kind == RegionKind::label, "labels", "'kind' is label");
  v.only_when(r.kind != RegionKind::label, "frame", "'kind' is box, sphere or half_space");
  v.check(r.kind != RegionKind::label || !r.labels.empty(), "labels",
          "a region of kind label lacks the key 'labels', such as [1, 2]");
  const Vec3d extent = r.box.max_m - r.box.min_m;
  v.check(!box || (extent.x > 0 && extent.y > 0 && extent.z > 0), "max_m",
          "a box needs 'min_m' and 'max_m' with 'max_m' larger along x, y and z");
  v.check(!half_space || dot(r.normal, r.normal) > 0, "normal", "'normal' is zero, expected a direction");
}

/// Times must increase: which keyframe of a list doesn't.
template <class Key>
void check_times(FieldVisitor& v, const char* key, const std::vector<Key>& keys) {
  for (std::size_t k = 1; k < keys.size(); ++k)
    v.check(keys[k].time_s > keys[k - 1].time_s, key,
            "'" + std::string(key) + "[" + std::to_string(k) + "].time_s' is " +
                number_text(keys[k].time_s, keys[k - 1].time_s) + ", expected more than the " +
                number_text(keys[k - 1].time_s) + " before it");
}

void describe_motion_key(FieldVisitor& v, MotionKeyDescription& k) {
  v.real({"time_s", "since the first frame", kRequired}, k.time_s, {"s", 0, 1e6});
  v.vector({"displacement_m", "from rest, world axes"}, k.displacement_m, kPosition);
  v.real({"angle_deg", "from rest, about `axis` through `pivot_m`; more than a turn is fine"}, k.angle_deg,
         {"deg", -360000, 360000});
}

void describe_load_key(FieldVisitor& v, LoadKeyDescription& k) {
  v.real({"time_s", "since the first frame", kRequired}, k.time_s, {"s", 0, 1e6});
  v.real({"factor", "times the load", kRequired}, k.factor, {"", -1e6, 1e6});
}

}  // namespace

void describe_fixed(FieldVisitor& v, FixedRegion& f) {
  describe_region(v, f.where);
  v.choice<HeldAxes>({"axes",
                      "axes of the world along which nodes are held. `y`: a roller on a floor, or a plane of "
                      "symmetry across "
                      "y. What several regions hold adds up"},
                     f.axes,
                     {{"xyz", kAllAxes}, {"x", 1}, {"y", 2}, {"z", 4}, {"xy", 3}, {"xz", 5}, {"yz", 6}});
}

void describe_painted(FieldVisitor& v, PaintedRegion& r) {
  describe_name(v, {"name", "for messages and pictures"}, r.name);
  describe_region(v, r.where);
  v.choice({"model", "hybrid bodies: what deforms these cubes"}, r.model,
           {{"unchanged", RegionModel::unchanged}, {"flsm", RegionModel::flsm}, {"tled", RegionModel::tled}});
  v.real_or_auto({"young_modulus_pa", "stiffness E of the elements here"}, r.young_modulus_pa,
                 positive("Pa", 1e9), "the body's");
  v.real_or_auto({"poisson_ratio", "nu of the elements here"}, r.poisson_ratio, kPoisson, "the body's");
  v.real_or_auto({"density_kg_m3", "mass per volume here"}, r.density_kg_m3, positive("kg/m^3", 30000),
                 "the body's");
  v.real_or_auto({"bleeding", "factor of the body's `bleeding` where this is cut; a vessel more, fat less"},
                 r.bleeding, {"", 0, 1000}, "1");
}

void describe_moved(FieldVisitor& v, MovedRegion& m) {
  describe_name(v, {"name", "for messages and results"}, m.name);
  describe_region(v, m.where);
  v.list({"path", "where it goes: keyframes, linear in between; from rest at 0 s; the last one holds",
          kRequired},
         items_of(m.path, describe_motion_key));
  v.vector({"axis", "of the angles, world axes"}, m.axis, {"", -1000, 1000});
  v.vector_or_auto({"pivot_m", "a point on that axis, in `frame`"}, m.pivot_m, kPosition,
                   "the middle of the nodes");
  v.real_or_auto({"release_s", "its nodes are free from then on"}, m.release_s, positive("s", 1e6), "never");
  v.check(!m.path.empty(), "path", "'path' has no keyframe, expected at least one");
  check_times(v, "path", m.path);
  const bool at_once = !m.path.empty() && m.path.front().time_s == 0 &&
                       (length(m.path.front().displacement_m) > 0 || m.path.front().angle_deg != 0);
  v.check(!at_once, "path",
          "'path[0]' moves its nodes at 0 s, all at once; expected a later 'time_s', or no displacement");
  v.check(length(m.axis) > 0, "axis", "'axis' is zero, expected a direction");
}

void describe_load(FieldVisitor& v, LoadedRegion& l) {
  constexpr Range kForce{"N", -1e9, 1e9}, kStress{"Pa", -1e9, 1e9};
  describe_name(v, {"name", "for messages"}, l.name);
  describe_region(v, l.where);
  v.vector_or_auto({"force_n", "in all, shared by area; its direction stays"}, l.force_n, kForce, "none");
  v.vector_or_auto({"traction_pa", "force per area at rest; its direction stays"}, l.traction_pa, kStress,
                   "none");
  v.real_or_auto({"pressure_pa", "into the body, wherever its surface faces; negative pulls"}, l.pressure_pa,
                 kStress, "none");
  v.list(
      {"over_time", "keyframes of a factor, linear in between, the first and last hold (default: always 1)"},
      items_of(l.over_time, describe_load_key));
  const int given = (l.force_n ? 1 : 0) + (l.traction_pa ? 1 : 0) + (l.pressure_pa ? 1 : 0);
  v.check(given == 1, "kind",
          "a load has " + std::to_string(given) +
              " of the keys 'force_n', 'traction_pa' and 'pressure_pa', expected one of them");
  v.check(l.where.kind != RegionKind::label, "kind",
          "'kind' is label, but loads lie on the surface; expected box, sphere or half_space");
  check_times(v, "over_time", l.over_time);
}

}  // namespace tactus
