/// The one declaration of the scene file: parsing, checking and docs/scene.md all come from here.
#include <algorithm>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/io/region_schema.h"
#include "tactus/sim/blade.h"

namespace tactus {
namespace {

/// The built-in figures.
const std::vector<std::string> kFigures = {"hand", "rabbit", "scalpel", "sphere", "bowl", "liver"};

void describe_source(FieldVisitor& v, SourceDescription& s) {
  v.choice<SourceKind>(
      {"kind", "where frames come from; `none`: nobody films, and nothing is reconstructed", kRequired},
      s.kind, kSourceKinds);
  v.word({"figure", "what the synthetic rig films"}, s.figure, kFigures);
  v.path({"path",
          "rig YAML (videos, masks, live), folder with `*_par.txt` (middlebury) or `calibration.json` "
          "(kinect), or "
          "recording"},
         s.path);
  static const std::string frames =
      "`A-B`, both included; `A-` to the end, which for `synthetic` and `none` is after " +
      std::to_string(kSyntheticFrames) + " frames; `A` alone";
  v.frames({"frames", frames.c_str()}, s.frames);
  v.real_or_auto({"fps", "frames per second"}, s.fps, positive("1/s", 1000),
                 "the recording's own; 30 for `synthetic` and `none`");
  v.boolean({"moving", "whether the synthetic figure moves"}, s.moving);
  v.real({"scale", "size of the synthetic figure over its natural size"}, s.scale,
         positive("", static_cast<double>(kMostFigureScale)));
  v.vector({"offset_m", "shift of the synthetic figure"}, s.offset_m, kPosition);
  v.integer({"depth_cameras", "time-of-flight cameras around the synthetic figure"}, s.depth_cameras,
            {"", 0, 32});
  const bool synthetic = s.kind == SourceKind::synthetic, none = s.kind == SourceKind::none;
  v.check(synthetic || none || !s.path.empty(), "path",
          "'source' lacks the key 'path': the rig YAML (videos, masks, live), the folder (middlebury, "
          "kinect) or the "
          "recording");
  v.only_when(!synthetic && !none, "path", "'kind' is videos, masks, middlebury, kinect, recording or live");
  for (const char* key : {"figure", "moving", "scale", "offset_m", "depth_cameras"})
    v.only_when(synthetic, key, "'kind' is synthetic");
}

void describe_reconstruction(FieldVisitor& v, ReconstructionDescription& r) {
  v.integer({"resolution", "voxels along the longest side of the workspace"}, r.resolution, {"", 4, 4096});
  v.section({"workspace_m", "box to reconstruct (default: the rig's)"},
            [&](FieldVisitor& in) { describe_box(in, given(r.workspace_m)); });
  v.boolean({"depth", "correct the hull with the depth camera when the source has one"}, r.depth);
  v.boolean({"repair_masks", "fill holes in the mask of a view that alone carves what all others keep"},
            r.repair_masks);
  v.integer({"tolerated_views", "keep what up to so many views carve (k-of-n hull)"}, r.tolerated_views,
            {"", 0, 7});
  v.integer({"min_views", "space that fewer cameras look at is outside"}, r.min_views, {"", 0, 64});
  v.integer({"smooth", "steps of smoothing that keep edges and volume; each looks one triangle farther"},
            r.smooth, {"", 0, 100});
  v.real({"depth_jump_m", "neighbouring depth pixels that differ by more mix two surfaces and are not used"},
         r.depth_jump_m, positive("m", 100));
  const Range capacity{"", 0, 1 << 30};
  v.integer(
      {"max_active_bricks", "capacity for bricks of 8^3 voxels that hold surface (0: from the resolution)"},
      r.max_active_bricks, capacity);
  v.integer({"max_vertices", "capacity for vertices of the surface (0: from the resolution)"}, r.max_vertices,
            capacity);
  v.integer({"max_triangles", "capacity for triangles of the surface (0: twice max_vertices)"},
            r.max_triangles, capacity);
}

void describe_shape(FieldVisitor& v, ShapeDescription& s) {
  v.choice({"kind", "what the body's outline comes from", kRequired}, s.kind,
           {{"box", ShapeKind::box},
            {"sphere", ShapeKind::sphere},
            {"figure", ShapeKind::figure},
            {"mesh", ShapeKind::mesh},
            {"labels", ShapeKind::labels}});
  v.vector({"size_m", "edges of the box, centred on the body's origin"}, s.size_m, positive("m", 100));
  v.real({"radius_m", "radius of the sphere, centred on the body's origin"}, s.radius_m, positive("m", 100));
  v.word({"figure", "name of a built-in figure"}, s.figure, kFigures);
  v.path({"path",
          "closed mesh (.ply .obj .stl .off .gltf .glb) or label volume (.nii .nii.gz .nrrd .nhdr .mha .mhd "
          ".inr .inr.gz; "
          "its coordinates are the scanner's: x right, y front, z head)"},
         s.path);
  v.real({"unit_m", "metres per unit of length in the mesh file (0.001: millimetres)"}, s.unit_m,
         positive("m", 1000));
  v.choice(
      {"fill",
       "mesh: what is inside. `closed`: what the surface goes round; open, inverted and unpaired edges are "
       "refused. `winding`: generalized winding number of at least 1/2, so that holes are spanned; "
       "a mesh that bounds a solid is that solid with both"},
      s.fill, {{"closed", MeshFill::closed}, {"winding", MeshFill::winding}});
  v.integers({"labels", "which labels are the body (default: all but 0)"}, s.labels, {"", 1, 65535});
  const bool file = s.kind == ShapeKind::mesh || s.kind == ShapeKind::labels;
  v.check(!file || !s.path.empty(), "path", "'shape' lacks the key 'path': the file of the mesh or labels");
  v.check(s.kind != ShapeKind::figure || !s.figure.empty(), "figure",
          "'shape' lacks the key 'figure': the name of a built-in figure");
  v.only_when(s.kind == ShapeKind::box, "size_m", "'kind' is box");
  v.only_when(s.kind == ShapeKind::sphere, "radius_m", "'kind' is sphere");
  v.only_when(s.kind == ShapeKind::figure, "figure", "'kind' is figure");
  v.only_when(file, "path", "'kind' is mesh or labels");
  for (const char* key : {"unit_m", "fill"}) v.only_when(s.kind == ShapeKind::mesh, key, "'kind' is mesh");
  v.only_when(s.kind == ShapeKind::labels, "labels", "'kind' is labels");
}

void describe_blade_key(FieldVisitor& v, MotionKeyDescription& k) {
  v.real({"time_s", "since the first frame", kRequired}, k.time_s, {"s", 0, 1e6});
  v.vector({"displacement_m", "from `from_m` and `to_m`, world axes"}, k.displacement_m, kPosition);
  v.real({"angle_deg", "about `axis` through `pivot_m`"}, k.angle_deg, {"deg", -360000, 360000});
}

void describe_relaxation(FieldVisitor& v, RelaxationDescription& r) {
  v.real({"share", "part of the shear modulus that fades", kRequired}, r.share, {"", 0, 0.99, true});
  v.real({"time_s", "after which 1/e of it is left", kRequired}, r.time_s, {"s", 0.001, 10});
}

void describe_material(FieldVisitor& v, MaterialDescription& m) {
  v.choice({"model",
            "how it deforms: `flsm` shape matching, `tled` finite elements, `hybrid` both: `ratio` or "
            "`regions` of "
            "the body say where. Which to take: below"},
           m.model,
           {{"flsm", TissueModel::flsm}, {"tled", TissueModel::tled}, {"hybrid", TissueModel::hybrid}});
  v.integer({"half_width",
             "half width of the shape matching regions in cubes: larger is smoother, takes fewer substeps, "
             "and gives way more under its own weight"},
            m.half_width, {"", 1, 4});
  v.real({"young_modulus_pa", "stiffness E; liver 3e3 to 1e4, rubber 1e6"}, m.young_modulus_pa,
         positive("Pa", 1e9));
  v.real({"poisson_ratio",
          "nu of the elements: 0.5 keeps its volume, and costs ever smaller steps on the way there"},
         m.poisson_ratio, kPoisson);
  v.real({"density_kg_m3", "mass per volume; tissue and water 1000"}, m.density_kg_m3,
         positive("kg/m^3", 30000));
  v.real_or_auto(
      {"damping", "part of critical damping of the fastest vibration; rigid motion is not damped"}, m.damping,
      {"", 0, 0.7},
      "0.15 at the slowest sway, so that what stands comes to rest; 0.1 with `relaxation` or `kappa: paper`");
  v.real(
      {"drag_per_s",
       "damping proportional to mass: slows all motion, falling too; whatever swings fades as "
       "exp(-drag_per_s t / 2). For slow swings, which `damping`, proportional to stiffness, leaves alone"},
      m.drag_per_s, {"1/s", 0, 1000});
  v.choice(
      {"kappa", "`material`: stiffness from E, whatever the step; `paper`: as printed, it follows the step"},
      m.kappa, {{"material", Stiffness::material}, {"paper", Stiffness::paper}});
  v.boolean(
      {"deflection_test",
       "scale shape matching, before the run, so that the held body sags as one of elements alone; takes "
       "seconds"},
      m.deflection_test);
  v.choice({"law", "of the elements"}, m.law,
           {
#define TACTUS_ROW(word, Law) {#word, MaterialLaw::word},
               TACTUS_MATERIAL_LAWS(TACTUS_ROW)
#undef TACTUS_ROW
           });
  v.vector({"fibre", "direction of the fibres at rest, world axes"}, m.fibre, {"", -1000, 1000});
  v.real({"fibre_ratio", "stiffness of the fibres over the shear modulus"}, m.fibre_ratio, {"", 0, 1000});
  v.list({"relaxation",
          "viscoelastic elements (Prony series): terms that fade after a step of strain, at most 2; "
          "`young_modulus_pa` "
          "and `poisson_ratio` are those at once"},
         items_of(m.relaxation, describe_relaxation));
  double faded = 0;
  for (const RelaxationDescription& r : m.relaxation) faded += r.share;
  v.check(m.relaxation.size() <= 2, "relaxation",
          "'relaxation' has " + std::to_string(m.relaxation.size()) + " terms, expected at most 2");
  v.check(faded < 0.995, "relaxation",
          "the shares of 'relaxation' add up to 1 or more: nothing would be left");
  const bool elements = m.model != TissueModel::flsm, matched = m.model != TissueModel::tled;
  for (const char* key : {"poisson_ratio", "law", "relaxation"})
    v.only_when(elements, key, "'model' is tled or hybrid");
  for (const char* key : {"half_width", "kappa", "deflection_test"})
    v.only_when(matched, key, "'model' is flsm or hybrid");
  const bool fibres = elements && m.law == MaterialLaw::transversely_isotropic;
  for (const char* key : {"fibre", "fibre_ratio"})
    v.only_when(fibres, key, "'law' is transversely_isotropic");
  v.check(dot(m.fibre, m.fibre) > 0, "fibre", "'fibre' is zero, expected a direction");
}

void describe_ratio(FieldVisitor& v, RatioDescription& r) {
  v.real({"tled", "share of nodes that are elements', at the low end of the axis", kRequired}, r.tled,
         {"", 0, 1000});
  v.real({"flsm", "share of nodes that are shape matching's", kRequired}, r.flsm, {"", 0, 1000});
  v.choice({"axis", "of the world"}, r.axis, {{"x", Axis::x}, {"y", Axis::y}, {"z", Axis::z}});
  v.check(r.tled + r.flsm > 0, "tled", "'tled' and 'flsm' are both 0, expected shares such as 6 and 4");
}

void describe_bleeding(FieldVisitor& v, BleedingDescription& b) {
  v.real({"rate_m_s", "volume per time and area of a fresh wound: 1 ml / (s cm^2) is 0.01 m/s", kRequired},
         b.rate_m_s, positive("m/s", 1));
  v.real_or_auto({"fading_s", "the rate falls as exp(-t / fading_s) from when the wound was cut"}, b.fading_s,
                 positive("s", 1e6), "never");
  v.real_or_auto(
      {"pulse_per_min", "beats of the heart, as from an artery: 72. The first wave rises as the run begins"},
      b.pulse_per_min, positive("1/min", 600), "it flows evenly");
  v.real({"pulse_share", "the rate swings by so much of itself, up and down; its mean stays"}, b.pulse_share,
         {"", 0, 1});
  v.only_when(b.pulse_per_min.has_value(), "pulse_share", "'pulse_per_min' is given");
}

void describe_body(FieldVisitor& v, BodyDescription& b) {
  describe_name(v, {"name", "unique name, used in results and probes", kRequired}, b.name);
  v.section({"shape", "outline of the body", kRequired},
            [&](FieldVisitor& in) { describe_shape(in, b.shape); });
  v.section({"placement", "from the shape's coordinates to the world: scale, rotate, move"},
            [&](FieldVisitor& in) { describe_placement(in, b.placement); });
  v.real({"spacing_m", "edge of the lattice cubes in the world: smaller is finer and slower"}, b.spacing_m,
         {"m", 0.0001, 1});
  v.section({"material", "how it answers to forces"},
            [&](FieldVisitor& in) { describe_material(in, b.material); });
  v.section({"ratio", "hybrid: how much of it is elements"},
            [&](FieldVisitor& in) { describe_ratio(in, given(b.ratio)); });
  v.boolean(
      {"contact",
       "whether the real surface, obstacles and other bodies push it; one that nothing pushes is stepped "
       "by as many devices as pay"},
      b.contact);
  v.integer({"matching_every",
             "hybrid: so many substeps of the elements are one of shape matching, which costs most; refused "
             "where that would make it softer"},
            b.matching_every, {"", 1, 64});
  v.boolean({"cuttable",
             "whether `blades` cut its elements; it needs memory for copies of cubes. Cubes with nodes that "
             "are moved, loaded or of shape matching are never cut"},
            b.cuttable);
  v.integer_or_auto(
      {"cut_capacity", "most copies of cubes that cuts may make, two or more per cube that is cut"},
      b.cut_capacity, {"", 8, 10000000},
      "no limit: the body begins with a quarter of its cubes, at least 2000, and grows");
  v.real_or_auto(
      {"cut_energy_j_m2",
       "work that a new wall takes, per area: liver 164 (Gokgol et al. 2012). The score reports the "
       "force on the blade from it; nothing moves by that"},
      b.cut_energy_j_m2, positive("J/m^2", 1e6), "unknown: no force is reported");
  v.section({"bleeding", "the walls of cuts give off `fluid`, where a particle of it fits"},
            [&](FieldVisitor& in) { describe_bleeding(in, given(b.bleeding)); });
  for (const char* key : {"cut_capacity", "cut_energy_j_m2", "bleeding"})
    v.only_when(b.cuttable, key, "'cuttable' is true");
  v.check(
      !b.bleeding || b.contact, "bleeding",
      "the body bleeds, but has 'contact: false': the liquid would run through it; expected 'contact: true'");
  v.check(
      !b.cuttable || b.material.model != TissueModel::flsm, "cuttable",
      "'cuttable' is true, but the body has no elements: only those are cut; set 'material.model' to tled or "
      "hybrid");
  v.check(!b.cuttable || b.shape.fill == MeshFill::closed, "cuttable",
          "'cuttable' is true, but a shape with 'fill: winding' bounds no solid that could be closed again");
  v.list({"regions", "parts of another model or material; later ones paint over earlier ones"},
         items_of(b.regions, describe_painted));
  v.check(b.bleeding || std::none_of(b.regions.begin(), b.regions.end(),
                                     [](const PaintedRegion& r) { return r.bleeding.has_value(); }),
          "regions", "a region has a factor 'bleeding', but the body has no 'bleeding' with a rate");
  v.list({"fixed", "regions whose lattice nodes never move"}, items_of(b.fixed, describe_fixed));
  v.list({"moved", "regions whose lattice nodes follow a given motion; contact doesn't move them"},
         items_of(b.moved, describe_moved));
  v.list({"loads", "regions of the surface that forces or pressures act on"},
         items_of(b.loads, describe_load));
  const bool hybrid = b.material.model == TissueModel::hybrid;
  for (const char* key : {"ratio", "matching_every"}) v.only_when(hybrid, key, "'material.model' is hybrid");
  v.check(
      b.matching_every == 1 || b.material.kappa == Stiffness::material, "matching_every",
      "'matching_every' is for when 'material.kappa' is material: as printed, stiffness follows the step");
  const bool painted = std::any_of(b.regions.begin(), b.regions.end(),
                                   [](const PaintedRegion& r) { return r.model != RegionModel::unchanged; });
  v.check(!hybrid || b.ratio || painted, "material",
          "'material.model' is hybrid, but neither 'ratio' nor a region with a 'model' says what is tled");
  v.check(hybrid || !painted, "regions",
          "a region has a 'model', which is for when 'material.model' is hybrid");
  const auto labelled = [](const SpaceRegion& r) { return r.kind == RegionKind::label; };
  const bool by_label =
      std::any_of(b.fixed.begin(), b.fixed.end(), [&](const FixedRegion& r) { return labelled(r.where); }) ||
      std::any_of(b.moved.begin(), b.moved.end(), [&](const MovedRegion& r) { return labelled(r.where); }) ||
      std::any_of(b.regions.begin(), b.regions.end(),
                  [&](const PaintedRegion& r) { return labelled(r.where); });
  v.check(!by_label || b.shape.kind == ShapeKind::labels, "regions",
          "a region is of kind label, which is for when 'shape.kind' is labels");
  v.vector({"colour", "red, green, blue (sRGB)"}, b.colour, {"", 0, 1});
}

void describe_blade(FieldVisitor& v, BladeDescription& b) {
  describe_name(v, {"name", "unique name, used in results", kRequired}, b.name);
  v.section({"tracked",
             "a real tool of known shape that the cameras see, instead of keyframes. It cuts nothing in a "
             "frame in which its edge goes farther than 0.2 m"},
            [&](FieldVisitor& in) { describe_tracked(in, given(b.tracked)); });
  v.boolean(
      {"held",
       "a program says where it is (`World::set_pose`), instead of keyframes; until then its own "
       "coordinates are the world's. It cuts nothing in a frame in which its edge goes farther than 0.2 m"},
      b.held);
  v.vector({"from_m", "one end of its straight edge, where nothing moves it"}, b.from_m, kPosition);
  v.vector({"to_m", "the other end"}, b.to_m, kPosition);
  v.list({"path",
          "where it goes: keyframes, linear in between; it cuts from the first to the last, but in no frame "
          "in which its edge goes farther than 0.2 m: a notice says so"},
         items_of(b.path, describe_blade_key));
  v.vector({"axis", "of the angles, world axes"}, b.axis, {"", -1000, 1000});
  v.vector_or_auto({"pivot_m", "a point on that axis, which moves along"}, b.pivot_m, kPosition, "`from_m`");
  for (const char* key : {"held", "from_m", "to_m", "path", "axis", "pivot_m"})
    v.only_when(!b.tracked, key, "the blade is not 'tracked'");
  if (b.tracked) return;
  for (const char* key : {"path", "axis", "pivot_m"}) v.only_when(!b.held, key, "the blade is not 'held'");
  v.check(length(b.to_m - b.from_m) > 0, "to_m", "'to_m' is 'from_m': the edge has no length");
  if (b.held) return;
  v.check(b.path.size() >= 2, "path",
          "'path' has " + std::to_string(b.path.size()) +
              " keyframes, expected two or more: it cuts between them");
  v.check(length(b.axis) > 0, "axis", "'axis' is zero, expected a direction");
  for (std::size_t k = 1; k < b.path.size(); ++k)
    v.check(b.path[k].time_s > b.path[k - 1].time_s, "path",
            "'path[" + std::to_string(k) + "]' has a 'time_s' of " +
                number_text(b.path[k].time_s, b.path[k - 1].time_s) +
                ", expected more than the one before it, " + number_text(b.path[k - 1].time_s));
  double area_m2 = 0;
  for (std::size_t k = 1; k < b.path.size(); ++k)
    area_m2 += swept(b, b.path[k - 1].time_s, b.path[k].time_s, 0).area_m2();
  v.check(area_m2 > 1e-9, "path",
          "'path' sweeps an area of " + number_text(area_m2, 1e-9) +
              " m^2, expected more than 1e-09: the edge from 'from_m' to 'to_m' stands still or moves along "
              "itself");
}

void describe_contact(FieldVisitor& v, ContactDescription& c) {
  v.real_or_auto({"sample_spacing_m", "distance of the samples on the real surface"}, c.sample_spacing_m,
                 {"m", 0.0001, 1}, "the smallest `spacing_m` of the bodies");
  v.real({"friction", "Coulomb's coefficient: 0 slides freely"}, c.friction, {"", 0, 10});
  v.choice({"response",
            "how the real surface acts on bodies: by exact distances, or by forces between particles as in "
            "Shao et al. 2019, which chatters (docs/concepts/contact.md)"},
           c.response, {{"exact", ContactResponse::exact}, {"paper", ContactResponse::paper}});
  v.real({"restitution",
          "of each point of a surface: the share of its approach velocity with which it leaves what it hits. "
          "A soft body rebounds by what it stored, whatever this is; its `damping` makes it bounce less"},
         c.restitution, {"", 0, 1});
  v.boolean({"bodies", "whether bodies touch one another, those with `contact` among them"}, c.bodies);
  v.boolean({"self",
             "whether each body touches itself, where its parts are 3 spacings apart at rest; it costs "
             "time, so say it for bodies that fold"},
            c.self);
  v.boolean({"cut_walls",
             "whether the walls of an incision touch each other, and the parts of a body that was cut; such "
             "bodies are on one device"},
            c.cut_walls);
  v.integer({"every",
             "substeps from one correction of bodies that touch one another, or themselves, to the next. "
             "Fewer cost less, and what is pressed together goes in by about `every`^2 times as much: from 3 "
             "on, bodies that stand on one another may sink into one another; what is thrown may go "
             "through"},
            c.every, {"", 1, 16});
}

void describe_frame(FieldVisitor& v, FrameDescription& f) {
  v.choice(
      {"start",
       "`settled`: bodies begin at rest under gravity and loads as they are at 0 s, found by dynamic "
       "relaxation until a thousandth of their force is left; time doesn't pass, and stresses that relax "
       "have"},
      f.start, {{"undeformed", FrameStart::undeformed}, {"settled", FrameStart::settled}});
  v.real({"max_dt_s", "no frame simulates more time, however late its images come"}, f.max_dt_s,
         positive("s", 1));
  v.real_or_auto({"dt_s", "simulated time per frame"}, f.dt_s, positive("s", 1),
                 "the time between frames of the source");
  v.integer_or_auto({"substeps", "steps of the bodies per frame"}, f.substeps, {"", 1, 10000},
                    "what the stable step of the stiffest body asks for");
  v.integer({"max_substeps", "no frame has more, unless bodies need more at rest"}, f.max_substeps,
            {"", 1, 10000});
}

void describe_view_camera(FieldVisitor& v, ViewCameraDescription& c) {
  v.vector_or_auto({"target_m", "what the viewer looks at"}, c.target_m, kPosition,
                   "the middle of workspace and bodies");
  v.vector_or_auto({"eye_m", "where the viewer stands"}, c.eye_m, kPosition,
                   "on the orbit of the next three keys");
  v.real_or_auto({"distance_m", "from target to eye"}, c.distance_m, positive("m", 1000),
                 "so that workspace and bodies fill the picture");
  v.real({"azimuth_deg", "0: seen from +Z, 90: from +X"}, c.azimuth_deg, {"deg", -360, 360});
  v.real({"elevation_deg", "height of the eye above the horizon"}, c.elevation_deg, {"deg", -89, 89});
  v.real({"field_of_view_deg", "vertical opening of the picture"}, c.field_of_view_deg, {"deg", 5, 120});
  for (const char* key : {"distance_m", "azimuth_deg", "elevation_deg"})
    v.only_when(!c.eye_m, key, "'eye_m' is auto");
}

void describe_view(FieldVisitor& v, ViewDescription& view) {
  v.pixel_size({"size_px", "width and height of the picture, both even"}, view.size_px, {"px", 16, 8192});
  v.check(view.size_px.x % 2 == 0 && view.size_px.y % 2 == 0, "size_px",
          "'size_px' is " + std::to_string(view.size_px.x) + " x " + std::to_string(view.size_px.y) +
              ", expected even numbers (video codecs need them)");
  v.section({"camera", "from where the picture is taken"},
            [&](FieldVisitor& in) { describe_view_camera(in, view.camera); });
  v.boolean({"show_frusta", "draw the real cameras"}, view.show_frusta);
  v.boolean({"show_models", "colour hybrid bodies by what deforms them: elements red, shape matching blue"},
            view.show_models);
  v.integer(
      {"photographs", "dress the real surface in the cameras' pictures, each point in its best so many"},
      view.photographs, {"", 0, 8});
  v.boolean({"overlay", "print frame number and times into the picture"}, view.overlay);
}

void describe_probe(FieldVisitor& v, ProbeDescription& p) {
  describe_name(v, {"name", "unique name in the results", kRequired}, p.name);
  v.text({"body", "name of the body it sticks to", kRequired}, p.body);
  describe_frame_of(v, p.frame);
  v.vector({"position_m", "its place at rest, in the body or on its surface", kRequired}, p.position_m,
           kPosition);
}

void describe_output(FieldVisitor& v, OutputDescription& o) {
  v.boolean({"video", "write an MP4"}, o.video);
  v.boolean({"contact_sheet", "write one PNG with twelve moments"}, o.contact_sheet);
  v.boolean(
      {"score", "write one PNG of each body that was cut: the planned line, the cut and how far it is off"},
      o.score);
  v.boolean({"trace", "write the stages' times as a Chrome trace"}, o.trace);
  v.integer({"mesh_every", "write PLY files of surface, bodies and liquid every n-th frame; 0: never"},
            o.mesh_every, {"", 0, 1000000});
  v.integer(
      {"vtk_every",
       "every n-th frame, write VTK files of cubes with strain and stress (.vtu), of the real surface and "
       "of particles (.vtp), and one that ParaView plays (.pvd); 0: never"},
      o.vtk_every, {"", 0, 1000000});
  v.integer({"usd_every", "put every n-th frame into a USD file (.usda) of all that is seen; 0: none"},
            o.usd_every, {"", 0, 1000000});
}

}  // namespace

void describe_scene(FieldVisitor& v, Scene& scene) {
  v.text({"name", "title in results and pictures (default: the file's name)"}, scene.name);
  v.section({"source", "what the cameras see", kRequired},
            [&](FieldVisitor& in) { describe_source(in, scene.source); });
  v.section({"reconstruction", "how the real object is rebuilt"},
            [&](FieldVisitor& in) { describe_reconstruction(in, scene.reconstruction); });
  v.list({"bodies", "the soft bodies"}, items_of(scene.bodies, describe_body));
  v.list({"obstacles", "what stands still and is touched: a table, a tray"},
         items_of(scene.obstacles, describe_obstacle));
  v.list({"blades", "edges that follow keyframes, or real tools, and cut bodies that are `cuttable`"},
         items_of(scene.blades, describe_blade));
  v.list({"plans", "lines that blades are to follow; the score reports how far cuts are from them"},
         items_of(scene.plans, describe_plan));
  v.section({"fluid", "a liquid, such as blood, that obstacles, bodies and what is real push"},
            [&](FieldVisitor& in) { describe_fluid(in, given(scene.fluid)); });
  v.vector({"gravity_m_s2", "acceleration of free fall"}, scene.gravity_m_s2, {"m/s^2", -1000, 1000});
  v.section({"contact", "how bodies meet the real surface, obstacles and one another"},
            [&](FieldVisitor& in) { describe_contact(in, scene.contact); });
  v.section({"frame", "simulated time"}, [&](FieldVisitor& in) { describe_frame(in, scene.frame); });
  v.section({"view", "the picture"}, [&](FieldVisitor& in) { describe_view(in, scene.view); });
  v.list({"probes", "points whose positions over time go into the JSON result"},
         items_of(scene.probes, describe_probe));
  v.section({"output", "what is written into the output folder"},
            [&](FieldVisitor& in) { describe_output(in, scene.output); });
  check_names(v, scene);
  check_plans(v, scene);
  check_blades(v, scene);
  v.check(scene.contact.response == ContactResponse::exact || scene.obstacles.empty(), "contact",
          "'response: paper' knows only the real surface, and the scene has 'obstacles'");
}

}  // namespace tactus
