#include "tactus/io/scene_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "support/data_folder.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/base/safe_file.h"

namespace tactus {
namespace {

using test::message_of;

constexpr const char* kSource = "source: {kind: synthetic}\n";  // line 1 of most texts

/// The message of the error that a scene causes; "" when it is fine.
std::string error_of(const std::string& text) {
  return message_of([&] { parse_scene(text, "scenes/x.yaml"); }, ErrorKind::usage);
}

TEST(SceneFile, DefaultsAreComplete) {
  const Scene scene = parse_scene(kSource, "folder/quiet.yaml");
  EXPECT_EQ(scene.name, "quiet");
  EXPECT_EQ(scene.source.kind, SourceKind::synthetic);
  EXPECT_EQ(scene.source.figure, "hand");
  EXPECT_FALSE(scene.frame.substeps.has_value());
  EXPECT_TRUE(scene.bodies.empty());
  EXPECT_EQ(scene.gravity_m_s2, (Vec3d{0, -9.81, 0}));
}

TEST(SceneFile, ReadsEveryKindOfValue) {
  const Scene scene = parse_scene(R"(
name: all
source: {kind: masks, path: rigs/a.yaml, frames: 3-7, fps: 25}
reconstruction: {resolution: 64, workspace_m: {min_m: [-1, 0, -1], max_m: [1, 2, 1]}}
bodies:
  - name: organ
    shape: {kind: labels, path: /data/liver.inr.gz, labels: [1, 255]}
    placement: {position_m: [1, 2, 3], rotation_deg: [0, 90, 0], scale: 2}
    spacing_m: 5e-3
    material: {model: flsm, half_width: 3, young_modulus_pa: 3000, density_kg_m3: 1050, damping: 0, kappa: paper}
    fixed:
      - {kind: box, min_m: [0, 0, 0], max_m: [1, 1, 1]}
      - {kind: half_space, frame: world, point_m: [0, 2, 0], normal: [0, 2, 0]}
    moved:
      - name: grip
        kind: sphere
        center_m: [1, 1, 1]
        path: [{time_s: 0.5, displacement_m: [0, 0.1, 0]}, {time_s: 2, angle_deg: 720}]
        axis: [1, 0, 0]
        pivot_m: [0, 0, 1]
        release_s: 3
    loads:
      - {name: hand, kind: sphere, force_n: [0, -1, 0], over_time: [{time_s: 0, factor: 0}, {time_s: 1, factor: 2}]}
      - {kind: sphere, pressure_pa: 200}
    colour: [1, 0.5, 0]
gravity_m_s2: [0, -1.62, 0]
contact: {sample_spacing_m: auto, friction: 0.1, restitution: +0.2}
frame: {dt_s: 0.01, substeps: 4}
view: {size_px: [640, 480], camera: {target_m: [0, 0, 0], eye_m: [0, 0, 3]}, show_frusta: false, overlay: false}
probes: [{name: tip, body: organ, frame: world, position_m: [1, 2, 3]}]
output: {video: false, contact_sheet: false, trace: true, mesh_every: 10}
)",
                                  "scenes/x.yaml");
  EXPECT_EQ(scene.name, "all");
  EXPECT_EQ(scene.source.kind, SourceKind::masks);
  EXPECT_EQ(scene.source.path, "scenes/rigs/a.yaml");
  EXPECT_EQ(scene.source.frames.first, 3);
  EXPECT_EQ(scene.source.frames.last, 7);
  EXPECT_EQ(scene.source.fps, 25);
  ASSERT_TRUE(scene.reconstruction.workspace_m.has_value());
  EXPECT_EQ(scene.reconstruction.workspace_m->max_m, (Vec3d{1, 2, 1}));
  ASSERT_EQ(scene.bodies.size(), 1U);
  const BodyDescription& body = scene.bodies[0];
  EXPECT_EQ(body.shape.kind, ShapeKind::labels);
  EXPECT_EQ(body.shape.path, "/data/liver.inr.gz");
  EXPECT_EQ(body.shape.labels, (std::vector<int>{1, 255}));
  EXPECT_EQ(body.spacing_m, 0.005);
  EXPECT_EQ(body.material.half_width, 3);
  EXPECT_EQ(body.material.kappa, Stiffness::paper);
  ASSERT_EQ(body.fixed.size(), 2U);
  EXPECT_EQ(body.fixed[1].where.kind, RegionKind::half_space);
  EXPECT_EQ(body.fixed[1].where.frame, CoordinateFrame::world);
  ASSERT_EQ(body.moved.size(), 1U);
  const MovedRegion& grip = body.moved[0];
  EXPECT_EQ(grip.where.center_m, (Vec3d{1, 1, 1}));
  EXPECT_EQ(grip.path.at(0).displacement_m, (Vec3d{0, 0.1, 0}));
  EXPECT_EQ(grip.path.at(1).angle_deg, 720);
  EXPECT_EQ(grip.axis, (Vec3d{1, 0, 0}));
  EXPECT_EQ(grip.pivot_m, (Vec3d{0, 0, 1}));
  EXPECT_EQ(grip.release_s, 3);
  ASSERT_EQ(body.loads.size(), 2U);
  EXPECT_EQ(body.loads[0].force_n, (Vec3d{0, -1, 0}));
  EXPECT_EQ(body.loads[0].over_time.at(1).factor, 2);
  EXPECT_EQ(body.loads[1].pressure_pa, 200);
  EXPECT_EQ(body.colour, (Vec3d{1, 0.5, 0}));
  EXPECT_FALSE(scene.contact.sample_spacing_m.has_value());
  EXPECT_EQ(scene.contact.restitution, 0.2);
  EXPECT_EQ(scene.frame.substeps, 4);
  EXPECT_EQ(scene.view.size_px, (Vec2i{640, 480}));
  EXPECT_EQ(scene.view.camera.eye_m, (Vec3d{0, 0, 3}));
  EXPECT_EQ(scene.probes.at(0).name, "tip");
  EXPECT_TRUE(scene.output.trace);
  EXPECT_EQ(scene.output.mesh_every, 10);
}

TEST(SceneFile, PlacementAndFixedRegions) {
  BodyDescription body;
  body.placement = {{1, 2, 3}, {0, 90, 0}, 2};
  // A turn by 90 degrees about y takes x to -z. Two roundings of numbers near 5: 1e-15 each.
  const Vec3d p = body.placement.to_world({1, 0, 0});
  EXPECT_NEAR(p.x, 1, 1e-14);
  EXPECT_NEAR(p.y, 2, 1e-14);
  EXPECT_NEAR(p.z, 1, 1e-14);
  const Vec3d back = body.placement.to_body(p);
  EXPECT_NEAR(back.x, 1, 1e-14);
  EXPECT_NEAR(back.z, 0, 1e-14);

  SpaceRegion low;
  low.kind = RegionKind::half_space;
  low.frame = CoordinateFrame::world;
  low.point_m = {0, 2, 0};
  SpaceRegion box;
  box.box = {{-1, -1, -1}, {0, 5, 1}};
  EXPECT_TRUE(body.in(low, {9, 1.9, 9}));
  EXPECT_FALSE(body.in(low, {9, 2.1, 9}));
  // body coordinates: x < 0 of the body is z > 3 of the world
  EXPECT_TRUE(body.in(box, {1, 2, 3.5}));
  EXPECT_FALSE(body.in(box, {1, 2, 2.5}));
}

TEST(SceneFile, FrameRanges) {
  EXPECT_EQ(parse_frame_range("3-7")->last, 7);
  EXPECT_EQ(parse_frame_range("5")->first, 5);
  EXPECT_EQ(parse_frame_range("5")->last, 5);
  EXPECT_FALSE(parse_frame_range("5-")->last.has_value());
  for (const char* bad : {"", "-", "-3", "7-3", "a-b", "1-2-3", "1 - 2", "99999999999"})
    EXPECT_FALSE(parse_frame_range(bad).has_value()) << bad;
}

/// The words of TACTUS_MATERIAL_LAWS, whatever rows it has.
std::string every_law() {
  std::string words;
#define TACTUS_ROW(word, Law) words += (words.empty() ? "" : ", ") + std::string(#word);
  TACTUS_MATERIAL_LAWS(TACTUS_ROW)
#undef TACTUS_ROW
  return words;
}

struct Bad {
  const char* text;      ///< after the source's line
  std::string expected;  ///< message after "scenes/x.yaml:"
};

TEST(SceneFile, WrongTypesAndRanges) {
  const std::vector<Bad> all = {
      {"contact: {friction: lots}", "2: 'contact.friction' is 'lots', expected a number >= 0 and <= 10"},
      {"contact: {friction: '0.5'}", "2: 'contact.friction' is '0.5', expected a number >= 0 and <= 10"},
      {"contact: {friction: -1}", "2: 'contact.friction' is '-1', expected a number >= 0 and <= 10"},
      {"contact: {friction: nan}", "2: 'contact.friction' is 'nan', expected a number >= 0 and <= 10"},
      {"contact: {friction: .nan}", "2: 'contact.friction' is '.nan', expected a number >= 0 and <= 10"},
      {"contact:\n  friction:", "3: 'contact.friction' is empty, expected a number >= 0 and <= 10"},
      {"contact: {friction: [1]}", "2: 'contact.friction' is a list of 1, expected a number >= 0 and <= 10"},
      {"contact: {sample_spacing_m: 0}",
       "2: 'contact.sample_spacing_m' is '0', expected a number >= 0.0001 and <= 1 m or auto"},
      {"contact: 3", "2: 'contact' is '3', expected a mapping of keys"},
      {"reconstruction: {resolution: 0}",
       "2: 'reconstruction.resolution' is '0', expected a whole number >= 4 and <= 4096"},
      {"reconstruction: {resolution: 64.5}",
       "2: 'reconstruction.resolution' is '64.5', expected a whole number >= 4 and <= 4096"},
      {"reconstruction: {workspace_m: {min_m: [0,0,0], max_m: [1,0,1]}}",
       "2: in 'reconstruction.workspace_m': 'max_m' must be larger than 'min_m' along x, y and z"},
      {"gravity_m_s2: -9.81", "2: 'gravity_m_s2' is '-9.81', expected [x, y, z]"},
      {"gravity_m_s2: [0, 1]", "2: 'gravity_m_s2' is a list of 2, expected [x, y, z]"},
      {"gravity_m_s2: [0, inf, 0]",
       "2: 'gravity_m_s2' is 'inf', expected a number >= -1000 and <= 1000 m/s^2"},
      {"frame: {dt_s: -0.1}", "2: 'frame.dt_s' is '-0.1', expected a number > 0 and <= 1 s or auto"},
      {"frame: {substeps: many}",
       "2: 'frame.substeps' is 'many', expected a whole number >= 1 and <= 10000 or auto"},
      {"view: {size_px: 720}", "2: 'view.size_px' is '720', expected [width, height], whole numbers"},
      {"view: {size_px: [641, 480]}",
       "2: in 'view': 'size_px' is 641 x 480, expected even numbers (video codecs need them)"},
      {"view: {overlay: yes}", "2: 'view.overlay' is 'yes', expected true or false"},
      {"view: {camera: {eye_m: [0,0,1], azimuth_deg: 3}}",
       "2: 'azimuth_deg' in 'view.camera' has no effect, it is for when 'eye_m' is auto"},
      {"bodies: {name: a}", "2: 'bodies' is a mapping, expected a list (each element starts with '- ')"},
      {"bodies: [3]", "2: 'bodies[0]' is '3', expected a mapping of keys"},
      {"bodies:\n- name:\n  shape: {kind: box}", "3: 'bodies[0].name' is empty, expected a text"},
      {"bodies: [{name: a, shape: {kind: bxo}}]",
       "2: 'bodies[0].shape.kind' is 'bxo', expected one of: box, sphere, figure, mesh, labels; did you mean "
       "'box'?"},
      {"bodies: [{name: a, shape: {kind: figure, figure: rabit}}]",
       "2: 'bodies[0].shape.figure' is 'rabit', expected one of: hand, rabbit, scalpel, sphere, bowl, liver; "
       "did you "
       "mean 'rabbit'?"},
      {"bodies: [{name: a, shape: {kind: figure}}]",
       "2: in 'bodies[0].shape': 'shape' lacks the key 'figure': the name of a built-in figure"},
      {"bodies: [{name: a, shape: {kind: box, radius_m: 1}}]",
       "2: 'radius_m' in 'bodies[0].shape' has no effect, it is for when 'kind' is sphere"},
      {"bodies: [{name: a, shape: {kind: labels, path: x, labels: [65536]}}]",
       "2: 'bodies[0].shape.labels' is '65536', expected a whole number >= 1 and <= 65535"},
      {"bodies: [{name: a, shape: {kind: labels, path: x, labels: 1}}]",
       "2: 'bodies[0].shape.labels' is '1', expected a list of whole numbers"},
      {"bodies: [{name: a, shape: {kind: mesh, path: [x]}}]",
       "2: 'bodies[0].shape.path' is a list of 1, expected a path"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: flsm, half_width: 5}}]",
       "2: 'bodies[0].material.half_width' is '5', expected a whole number >= 1 and <= 4"},
      {"bodies: [{name: a, shape: {kind: box}, material: {young_modulus_pa: 0}}]",
       "2: 'bodies[0].material.young_modulus_pa' is '0', expected a number > 0 and <= 1e+09 Pa"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: tled, poisson_ratio: 0.5}}]",
       "2: 'bodies[0].material.poisson_ratio' is '0.5', expected a number >= -0.99 and <= 0.499"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: tled, poisson_ratio: -1}}]",
       "2: 'bodies[0].material.poisson_ratio' is '-1', expected a number >= -0.99 and <= 0.499"},
      {"bodies: [{name: a, shape: {kind: box}, material: {young_modulus_pa: .nan}}]",
       "2: 'bodies[0].material.young_modulus_pa' is '.nan', expected a number > 0 and <= 1e+09 Pa"},
      {"bodies: [{name: a, shape: {kind: box}, material: {density_kg_m3: -1}}]",
       "2: 'bodies[0].material.density_kg_m3' is '-1', expected a number > 0 and <= 30000 kg/m^3"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: tled, law: neo_hokean}}]",
       "2: 'bodies[0].material.law' is 'neo_hokean', expected one of: " + every_law() +
           "; did you mean 'neo_hookean'?"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: tled, relaxation: [{share: 1, time_s: "
       "1}]}}]",
       "2: 'bodies[0].material.relaxation[0].share' is '1', expected a number > 0 and <= 0.99"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: tled, relaxation: [{share: 0.6, time_s: 1}, "
       "{share: 0.5, time_s: 2}]}}]",
       "2: in 'bodies[0].material': the shares of 'relaxation' add up to 1 or more: nothing would be left"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: tled, relaxation: [{share: 0.1, time_s: 1}, "
       "{share: 0.1, time_s: 1}, {share: 0.1, time_s: 1}]}}]",
       "2: in 'bodies[0].material': 'relaxation' has 3 terms, expected at most 2"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: flsm, relaxation: [{share: 0.1, time_s: "
       "1}]}}]",
       "2: 'relaxation' in 'bodies[0].material' has no effect, it is for when 'model' is tled or hybrid"},
      {"bodies: [{name: a, shape: {kind: box}, regions: [{kind: sphere, poisson_ratio: 0.5}]}]",
       "2: 'bodies[0].regions[0].poisson_ratio' is '0.5', expected a number >= -0.99 and <= 0.499 or auto"},
      {"bodies: [{name: a, shape: {kind: box}, regions: [{kind: label}]}]",
       "2: in 'bodies[0].regions[0]': a region of kind label lacks the key 'labels', such as [1, 2]"},
      {"bodies: [{name: a, shape: {kind: box}, fixed: [{kind: label, labels: [1]}]}]",
       "2: in 'bodies[0]': a region is of kind label, which is for when 'shape.kind' is labels"},
      {"bodies: [{name: a, shape: {kind: box, fill: winding}}]",
       "2: 'fill' in 'bodies[0].shape' has no effect, it is for when 'kind' is mesh"},
      {"bodies: [{name: a, shape: {kind: mesh, path: x, fill: windng}}]",
       "2: 'bodies[0].shape.fill' is 'windng', expected one of: closed, winding; did you mean 'winding'?"},
      {"bodies: [{name: a, shape: {kind: box}, spacing_m: 0}]",
       "2: 'bodies[0].spacing_m' is '0', expected a number >= 0.0001 and <= 1 m"},
      {"bodies: [{name: a, shape: {kind: box}, placement: {position_m: [0, .inf, 0]}}]",
       "2: 'bodies[0].placement.position_m' is '.inf', expected a number >= -1000 and <= 1000 m"},
      {"bodies: [{name: a, shape: {kind: box}, fixed: [{kind: box}]}]",
       "2: in 'bodies[0].fixed[0]': a box needs 'min_m' and 'max_m' with 'max_m' larger along x, y and z"},
      {"bodies: [{name: a, shape: {kind: box}, fixed: [{kind: half_space, normal: [0,0,0]}]}]",
       "2: in 'bodies[0].fixed[0]': 'normal' is zero, expected a direction"},
      {"bodies: [{name: a, shape: {kind: box}, matching_every: 2}]",
       "2: 'matching_every' in 'bodies[0]' has no effect, it is for when 'material.model' is hybrid"},
      {"bodies: [{name: a, shape: {kind: box}, material: {model: hybrid, kappa: paper}, ratio: {tled: 1, "
       "flsm: "
       "1}, matching_every: 2}]",
       "2: in 'bodies[0]': 'matching_every' is for when 'material.kappa' is material: as printed, stiffness "
       "follows the step"},
      {"bodies: [{name: a, shape: {kind: box}, matching_every: 0}]",
       "2: 'bodies[0].matching_every' is '0', expected a whole number >= 1 and <= 64"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: sphere}]}]",
       "2: 'bodies[0].moved[0]' lacks the required key 'path': where it goes: keyframes, linear in between; "
       "from rest at 0 s; the last one holds"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: sphere, path: []}]}]",
       "2: in 'bodies[0].moved[0]': 'path' has no keyframe, expected at least one"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: sphere, path: [{time_s: 1}, {time_s: 0.5}]}]}]",
       "2: in 'bodies[0].moved[0]': 'path[1].time_s' is 0.5, expected more than the 1 before it"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: sphere, path: [{time_s: -1}]}]}]",
       "2: 'bodies[0].moved[0].path[0].time_s' is '-1', expected a number >= 0 and <= 1e+06 s"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: sphere, path: [{time_s: .nan}]}]}]",
       "2: 'bodies[0].moved[0].path[0].time_s' is '.nan', expected a number >= 0 and <= 1e+06 s"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: sphere, path: [{time_s: 0, angle_deg: 5}]}]}]",
       "2: in 'bodies[0].moved[0]': 'path[0]' moves its nodes at 0 s, all at once; expected a later "
       "'time_s', "
       "or no displacement"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: sphere, axis: [0,0,0], path: [{time_s: 1}]}]}]",
       "2: in 'bodies[0].moved[0]': 'axis' is zero, expected a direction"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: sphere, release_s: 0, path: [{time_s: 1}]}]}]",
       "2: 'bodies[0].moved[0].release_s' is '0', expected a number > 0 and <= 1e+06 s or auto"},
      {"bodies: [{name: a, shape: {kind: box}, moved: [{kind: label, labels: [1], path: [{time_s: 1}]}]}]",
       "2: in 'bodies[0]': a region is of kind label, which is for when 'shape.kind' is labels"},
      {"bodies: [{name: a, shape: {kind: box}, loads: [{kind: sphere}]}]",
       "2: in 'bodies[0].loads[0]': a load has 0 of the keys 'force_n', 'traction_pa' and 'pressure_pa', "
       "expected one of them"},
      {"bodies: [{name: a, shape: {kind: box}, loads: [{kind: sphere, pressure_pa: .nan}]}]",
       "2: 'bodies[0].loads[0].pressure_pa' is '.nan', expected a number >= -1e+09 and <= 1e+09 Pa or auto"},
      {"bodies: [{name: a, shape: {kind: box}, loads: [{kind: label, labels: [1], pressure_pa: 3}]}]",
       "2: in 'bodies[0].loads[0]': 'kind' is label, but loads lie on the surface; expected box, sphere or "
       "half_space"},
      {"bodies: [{name: a, shape: {kind: box}, loads: [{kind: sphere, pressure_pa: 3, over_time: [{time_s: "
       "1, "
       "factor: 1}, {time_s: 1, factor: 2}]}]}]",
       "2: in 'bodies[0].loads[0]': 'over_time[1].time_s' is 1, expected more than the 1 before it"},
      {"bodies: [{name: a, shape: {kind: box}}, {name: a, shape: {kind: box}}]",
       "2: two of the 'bodies' have the name 'a', names must differ"},
      {"bodies: [{name: a, shape: {kind: box}}]\nobstacles: [{name: a, kind: plane}]",
       "3: 'a' is the name of one of the 'bodies', too: names must differ"},
      {"bodies: [{name: '3', shape: {kind: box}}]",
       "2: the name '3' is a number, and so are those of the real surface's components: expected one with a "
       "letter"},
      {"bodies: [{name: cushion, shape: {kind: box}}]\nprobes: [{name: p, body: cusion, position_m: "
       "[0,0,0]}]",
       "3: probe 'p' sits on the unknown body 'cusion'; did you mean 'cushion'?"},
      {"fluid: {spacing_m: 0.0001, box: {min_m: [0,0,0], max_m: [1,1,1]}, blocks: [{min_m: [0,0,0], max_m: "
       "[0.1,0.05,0.1]}]}",
       "2: in 'fluid': 'spacing_m' is 0.0001, which takes 500000000 particles to fill the 'blocks', at most "
       "33500000 can "
       "be indexed: raise it to at least 0.00025, or make the blocks smaller"},
      {"fluid: {spacing_m: 0.01, max_particles: 50000000, box: {min_m: [0,0,0], max_m: [1,1,1]}}",
       "2: 'fluid.max_particles' is '50000000', expected a whole number >= 1 and <= 3.35e+07"},
      {"fluid: {spacing_m: 0.0001, box: {min_m: [0,0,0], max_m: [9,9,9]}, emitters: [{name: e, position_m: "
       "[1,1,1], "
       "radius_m: 9}]}",
       "2: in 'fluid': the 'radius_m' 9 of emitter 'e' brings 25446900495 particles at once at 'spacing_m' "
       "0.0001, more than 'max_particles' 40000: lower the radius, or raise 'max_particles' or 'spacing_m'"},
      {"fluid: {spacing_m: 0.01, max_particles: 3, box: {min_m: [0,0,0], max_m: [1,1,1]}, emitters: [{name: "
       "e, "
       "position_m: [0.5,0.5,0.5], radius_m: 0.01}]}",  // pi particles
       "2: in 'fluid': the 'radius_m' 0.01 of emitter 'e' brings 4 particles at once at 'spacing_m' 0.01, "
       "more than 'max_particles' 3: lower the radius, or raise 'max_particles' or 'spacing_m'"},
      {"fluid: {spacing_m: 0.01, box: {min_m: [0,0,0], max_m: [1,1,1]}, emitters: [{name: e, position_m: "
       "[0.5,0.5,0.5], from_s: 0.5, until_s: 0.2}]}",
       "2: in 'fluid.emitters[0]': 'until_s' 0.2 is not after 'from_s' 0.5: nothing would flow"},
      {"fluid: {spacing_m: 0.01, box: {min_m: [0,0,0], max_m: [1,1,1]}, emitters: [{name: q, position_m: "
       "[0.5,0.5,0.5]}, {name: q, position_m: [0.2,0.5,0.5]}]}",
       "2: two of the 'emitters' have the name 'q', names must differ"},
      {"probes: [{name: p, body: a, position_m: [0,0,0]}]",
       "2: probe 'p' sits on the unknown body 'a'; the scene has no bodies"},
  };
  for (const Bad& bad : all)
    EXPECT_EQ(error_of(kSource + std::string(bad.text) + "\n"), "scenes/x.yaml:" + std::string(bad.expected));
}

TEST(SceneFile, SourceErrors) {
  EXPECT_EQ(error_of("source: {kind: synthetic, frames: 9-3}\n"),
            "scenes/x.yaml:1: 'source.frames' is '9-3', expected A-B with 0 <= A <= B, or A- to the end");
  EXPECT_EQ(error_of("source: {kind: synthetic, path: a}\n"),
            "scenes/x.yaml:1: 'path' in 'source' has no effect, it is for when 'kind' is videos, masks, "
            "middlebury, kinect, recording or live");
  EXPECT_EQ(error_of("source: {kind: video, path: a}\n"),
            "scenes/x.yaml:1: 'source.kind' is 'video', expected one of: synthetic, videos, masks, "
            "middlebury, kinect, recording, live, none; did you "
            "mean 'videos'?");
}

TEST(SceneFile, NotYaml) {
  EXPECT_EQ(error_of("source: {kind: synthetic}\ncontact: [1, 2\nname: x\n").substr(0, 33),
            "scenes/x.yaml:3: not valid YAML: ");
  EXPECT_EQ(error_of(""),
            "scenes/x.yaml:1: the file is empty, expected a mapping of keys such as 'source:' and 'bodies:'");
  EXPECT_EQ(
      error_of("- 1\n- 2\n"),
      "scenes/x.yaml:1: the file is a list of 2, expected a mapping of keys such as 'source:' and 'bodies:'");
}

TEST(SceneFile, SecondDocumentIsRefused) {
  EXPECT_EQ(error_of("source: {kind: synthetic}\n---\nname: b\n"),
            "scenes/x.yaml:2: a second YAML document begins, expected one");
}

/// A body named "x/../../escaped" was written outside of the output folder, and a zero byte cut a name.
TEST(SceneFile, NamesThatBecomePathsStayInTheirFolder) {
  const auto body = [](const std::string& name) {
    return error_of("source: {kind: synthetic}\nbodies:\n- {name: " + name + ", shape: {kind: sphere}}\n");
  };
  const std::string expected =
      ", expected a name of at most 100 bytes that a file can have: not . or .., and without '/'";
  for (const std::string name : {"x/../../escaped", "/tmp/x", "a/", ".", ".."})
    EXPECT_EQ(body(name), "scenes/x.yaml:3: in 'bodies[0]': 'name' is '" + name + "'" + expected);
  EXPECT_EQ(body(std::string(100, 'a')), "");
  EXPECT_EQ(body(std::string(101, 'a')),
            "scenes/x.yaml:3: in 'bodies[0]': 'name' is '" + std::string(100, 'a') + "'" + expected);
  EXPECT_EQ(body("\"a\\0b\""),
            "scenes/x.yaml:3: 'bodies[0].name' is 'a\\x00b', expected a text without control characters");
  EXPECT_EQ(body("\"\""), "scenes/x.yaml:3: 'bodies[0].name' is '', expected a text");
  EXPECT_EQ(body("\"le foie gauche, \xc3\xa9paissi\""), "");
  const std::string box = "kind: box, min_m: [0, 0, 0], max_m: [1, 1, 1]";
  for (const std::string part : {"regions", "moved", "loads"}) {
    EXPECT_NE(error_of("source: {kind: synthetic}\nbodies:\n- {name: b, shape: {kind: sphere}, " + part +
                       ": [{name: a/b, " + box + ", force_n: [0, 0, 1]}]}\n"),
              "")
        << part;
  }
  EXPECT_EQ(error_of("source: {kind: synthetic}\nbodies:\n- {name: b, shape: {kind: sphere}}\n"
                     "probes:\n- {name: a/b, body: b, position_m: [0, 0, 0]}\n"),
            "scenes/x.yaml:5: in 'probes[0]': 'name' is 'a/b'" + expected);
  EXPECT_EQ(error_of("source: {kind: masks, path: \"a\\0b\"}\n"),
            "scenes/x.yaml:1: 'source.path' is 'a\\x00b', expected a path without control characters");
}

/// yaml-cpp made empty documents of ", x" until the memory was full.
TEST(SceneFile, WhatYamlCppCannotEndIsRefused) {
  EXPECT_EQ(error_of(", x"), "scenes/x.yaml:1: not valid YAML: ', x' belongs to no key and no list");
  EXPECT_EQ(error_of("source: {kind: synthetic}\n, x\n").substr(0, 17), "scenes/x.yaml:2: ");
  const auto repeated = [](const std::string& text, int count) {
    std::string all;
    for (int i = 0; i < count; ++i) all += text;
    return all;
  };
  EXPECT_EQ(error_of(repeated("[", 100000)), "scenes/x.yaml:1: nested more than 64 deep");
  EXPECT_EQ(error_of(repeated("- ", 100000)), "scenes/x.yaml:1: nested more than 64 deep");
  EXPECT_EQ(error_of("bodies: &a [" + repeated("*a,", 1001) + "]"),
            "scenes/x.yaml:1: more than 1000 aliases");
  EXPECT_EQ(error_of("[" + repeated("1,", 100001) + "]"), "scenes/x.yaml:1: more than 100000 values");
  EXPECT_EQ(error_of(repeated("#\n", 600000)), "scenes/x.yaml: 1.2 MB of YAML, expected at most 1.0 MB");
}

TEST(SceneFile, DamagedTextNeverEscapesAsAnotherException) {
  const std::string whole = read_file(source_path("scenes/demo.yaml"), kMaxMeshBytes);
  std::uint32_t state = 1;
  const auto random = [&](std::size_t below) {
    return ((state = state * 1664525U + 1013904223U) >> 8) % below;
  };
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string text = whole;
    for (int k = 0; k < 3; ++k) text[random(text.size())] = "\0\t :-[]{}#&*!|>'\"%@`~x7\xff"[random(24)];
    try {
      parse_scene(text.substr(0, i % 2 == 0 ? text.size() : random(text.size())), "scenes/x.yaml");
    } catch (const Error& e) {
      ++refused;
      EXPECT_TRUE(std::string(e.what()).starts_with("scenes/x.yaml:")) << e.what();
    }
  }
  EXPECT_GT(refused, 500);  // half of them are cut, and most cuts leave no valid scene
}

TEST(SceneFile, UnreadableFileIsNamed) {
  try {
    read_scene("no/such/scene.yaml");
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "can't read 'no/such/scene.yaml': No such file or directory");
  }
  EXPECT_THROW(read_scene(source_path("scenes")), Error);
}

TEST(SceneFile, DataFolderComesFromTheEnvironment) {
  const std::string text = "source: {kind: middlebury, path: $TACTUS_DATA/dino}\n";
  const char* before = std::getenv("TACTUS_DATA");
  const std::string kept = before == nullptr ? "" : before;
  setenv("TACTUS_DATA", "/somewhere", 1);
  EXPECT_EQ(parse_scene(text, "scenes/x.yaml").source.path, "/somewhere/dino");
  unsetenv("TACTUS_DATA");
  EXPECT_EQ(error_of(text),
            "scenes/x.yaml:1: 'source.path' is '$TACTUS_DATA/dino', but the environment variable "
            "TACTUS_DATA is not set");
  if (before != nullptr) setenv("TACTUS_DATA", kept.c_str(), 1);
}

TEST(SceneFile, ReferenceIsUpToDate) {
  std::ostringstream reference;
  write_scene_reference(reference);
  const std::string path = source_path("docs/scene.md");
  if (const char* update = std::getenv("TACTUS_UPDATE_DOCS"); update != nullptr) {
    SafeFile file(path);
    file.write(reference.str());
    file.commit();
  }
  EXPECT_EQ(read_file(path, kMaxMeshBytes), reference.str())
      << "run this test with TACTUS_UPDATE_DOCS=1 to renew it";
}

TEST(SceneFile, EveryShippedSceneIsValid) {
  setenv("TACTUS_DATA", "/somewhere", 0);  // scenes may name recordings; they are not opened here
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source_path("scenes"))) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(read_scene(entry.path().string())) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 3);
}

}  // namespace
}  // namespace tactus
