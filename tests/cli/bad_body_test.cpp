// Bodies that can't be: exit code, one message that names the thing, and no file left behind.
#include "cli/program.h"
#include "support/data_folder.h"

namespace tactus::test {
namespace {

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

constexpr const char* kCube =
    "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n"
    "f 1 3 2\nf 2 3 4\nf 5 6 7\nf 6 8 7\nf 1 2 5\nf 2 6 5\nf 3 7 4\nf 4 7 8\nf 1 5 3\nf 3 5 7\nf 2 4 6\n";
constexpr const char* kLastFace = "f 4 8 6\n";

class BadBody : public ProgramTest {
 protected:
  /// Command line of a scene with one body; `body`: its keys in flow style, without name.
  std::string run(const std::string& body, const std::string& more = "") const {
    write("s.yaml",
          "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: 16}\nbodies:\n  - {name: "
          "b, " +
              body + "}\n" + more);
    return "run " + path("s.yaml") + " --frames 2 --devices cpu --view none --json " + path("out.json");
  }
  std::string mesh(const std::string& text, const std::string& more = "") const {
    write("b.obj", text);
    return "shape: {kind: mesh, path: b.obj, unit_m: 0.1" + more + "}, spacing_m: 0.05";
  }
};

TEST_F(BadBody, MeshesThatBoundNoSolid) {
  const std::string open = kCube;
  expect_refused(
      run(mesh(open)), 1,
      {"error: body 'b': its mesh does not bound a solid: 3 open edges, the first from (0.1, 0.1, -0.1) "
       "to (0.1, -0.1, 0.1) m",
       "say 'fill: winding' to fill it"});
  const Outcome filled = run_tactus(run(mesh(open, ", fill: winding")));
  EXPECT_EQ(filled.code, 0) << filled.text;
  EXPECT_TRUE(has(filled.text, "warning: body 'b': its mesh does not bound a solid: 3 open edges"))
      << filled.text;
  expect_refused(run(mesh(open + "f 4 6 8\n")), 1, {"3 edges between triangles that face opposite ways"});
  // The winding number leaves a corner out, and the refusal says whose, and what is odd about its mesh.
  expect_refused(run(mesh(open + "f 4 6 8\n", ", fill: winding")), 1,
                 {"error: body 'b': surface vertex", "the mesh encloses nothing there",
                  "3 edges between triangles that face opposite ways"});
  expect_refused(run(mesh(open + kLastFace + "v 0 0 nan\nf 4 8 9\n")), 1,
                 {"b.obj:21: vertex 8 is (0, 0, nan)"});
  expect_refused(run(mesh("v 0 0 0\n")), 1, {"b.obj: no triangles in it, expected a surface"});
  expect_refused(run("shape: {kind: mesh, path: c.obj}"), 1,
                 {"can't read '" + path("c.obj") + "': No such file"});
}

TEST_F(BadBody, OddMeshesAreWarnedOf) {
  std::string inverted = kCube + std::string(kLastFace);
  for (std::size_t i = 0;
       (i = inverted.find("\nf ", i)) != std::string::npos;) {  // swap the last two corners
    const std::size_t end = inverted.find('\n', i + 1);
    std::swap(inverted[end - 1], inverted[end - 3]);
    i = end;
  }
  Outcome o = run_tactus(run(mesh(inverted)));
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_TRUE(
      has(o.text, "warning: body 'b': its triangles face inwards; they are taken the other way round"))
      << o.text;
  EXPECT_TRUE(has(o.text, "warning: body 'b': gravity pulls and nothing is 'fixed': it will fall")) << o.text;
  write("b.obj", kCube + std::string(kLastFace));
  o = run_tactus(run("shape: {kind: mesh, path: b.obj, unit_m: 10}, spacing_m: 1"));
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_TRUE(has(o.text, "it is 20 m long: is its file in millimetres? Then say 'unit_m: 0.001'")) << o.text;
}

TEST_F(BadBody, SizesAndSpacings) {
  const std::string cube = kCube + std::string(kLastFace);
  write("b.obj", cube);
  const std::string file = "shape: {kind: mesh, path: b.obj, ";
  expect_refused(run(file + "unit_m: 0.1}, spacing_m: 0.3"), 1,
                 {"body 'b': lattice spacing 0.300000 m is larger than the body (0.200000 m)"});
  expect_refused(run(file + "unit_m: 100}, spacing_m: 0.01"), 1,
                 {"body 'b': lattice spacing 0.010000 m needs ", " cubes, more than the limit of ",
                  "it is 200 m long: is its file in millimetres?"});
  expect_refused(run("shape: {kind: box, size_m: [9, 9, 9]}, spacing_m: 0.0001"), 1,
                 {"body 'b': lattice spacing 0.000100 m needs "});
}

TEST_F(BadBody, Materials) {
  const std::string box = "shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.05, ";
  expect_refused(run(box + "material: {model: tled, poisson_ratio: 0.5}"), 2,
                 {"s.yaml:4: 'bodies[0].material.poisson_ratio' is '0.5', expected a number"});
  expect_refused(run(box + "material: {young_modulus_pa: -5}"), 2,
                 {"s.yaml:4: 'bodies[0].material.young_modulus_pa' is '-5', expected a number > 0"});
  expect_refused(run(box + "material: {density_kg_m3: .nan}"), 2,
                 {"s.yaml:4: 'bodies[0].material.density_kg_m3' is '.nan'"});
  expect_refused(run(box + "material: {model: tled, law: rubber}"), 2,
                 {"s.yaml:4: 'bodies[0].material.law' is 'rubber', expected one of: neo_hookean"});
  expect_refused(
      run(box + "material: {model: tled}, regions: [{name: far, kind: sphere, center_m: [3, 0, 0]}]"), 2,
      {"body 'b': region 0 ('far') holds no cube of the body"});
  expect_refused(run(box + "regions: [{kind: sphere, young_modulus_pa: 5}]"), 2,
                 {"body 'b': region 0 holds no element"});
}

TEST_F(BadBody, NumbersThatAreNone) {
  const std::string box = "shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.05";
  expect_refused(run(box, "gravity_m_s2: [0, .nan, 0]\n"), 2, {"s.yaml:5: 'gravity_m_s2' is '.nan'"});
  expect_refused(run(box + ", placement: {position_m: [.nan, 0, 0]}"), 2,
                 {"placement.position_m' is '.nan'"});
  expect_refused(run(box, "frame: {dt_s: .nan}\n"), 2, {"s.yaml:5: 'frame.dt_s' is '.nan'"});
  expect_refused(run(box, "probes: [{name: p, body: b, position_m: [0, .nan, 0]}]\n"), 2,
                 {"s.yaml:5: 'probes[0].position_m' is '.nan'"});
}

/// One end is to go 0.6 m in 10 ms, four times as fast as waves, from frame 6 on.
TEST_F(BadBody, WhatExplodesIsExplained) {
  for (const std::string model : {"tled", "flsm, half_width: 2"}) {
    std::string command =
        run("shape: {kind: box, size_m: [0.6, 0.12, 0.12]}, spacing_m: 0.02, material: {model: " + model +
            ", young_modulus_pa: 20000}, fixed: [{kind: half_space, point_m: [-0.29, 0, 0], normal: [1, 0, "
            "0]}], moved: [{name: grip, kind: half_space, point_m: [0.29, 0, 0], normal: [-1, 0, 0], path: "
            "[{time_s: 0.2}, {time_s: 0.21, displacement_m: [-0.5, 0.3, 0]}]}]");
    command.replace(command.find("--frames 2"), 10, "--frames 9 --explain");
    const Outcome o = run_tactus(command);
    EXPECT_EQ(o.code, model == "tled" ? 3 : 0) << o.text;  // elements blow up, matched shapes go on
    EXPECT_TRUE(has(o.text,
                    "warning: body 'b': 'moved[0]' (grip) moves at 58.3 m/s on the way to keyframe 1, "
                    "faster than waves in the body ("))
        << o.text;
    if (model == "tled") {
      EXPECT_TRUE(has(o.text, "warning: body 'b' blew up: the volume of cube ")) << o.text;
      EXPECT_TRUE(has(o.text, "frame 7: body 'b' blew up: the volume of cube ")) << o.text;
    } else {
      EXPECT_TRUE(has(o.text, "frames 7 to 8, worst in 7: body 'b': node ")) << o.text;
      EXPECT_TRUE(has(o.text, "m/s, faster than waves, 4.47 m/s")) << o.text;
    }
    EXPECT_TRUE(has(o.text, "'moved[0]' (grip) moves it, at up to 58.3 m/s")) << o.text;
  }
}

TEST_F(BadBody, SubstepsThatAreTooFew) {
  const std::string box = "shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.05, material: {model: ";
  expect_refused(run(box + "tled, young_modulus_pa: 1e6}", "frame: {substeps: 2}\ngravity_m_s2: [0, 0, 0]\n"),
                 2,
                 {"body 'b': 'frame.substeps' is 2, steps of 0.0166667 s, but its elements are stable up to ",
                  "; expected at least ", ", or auto"});
  const Outcome o = run_tactus(
      run(box + "flsm, young_modulus_pa: 1e6}", "frame: {substeps: 2}\ngravity_m_s2: [0, 0, 0]\n"));
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_TRUE(has(o.text,
                  "warning: body 'b': 'frame.substeps' is 2, so its shape matching is as soft as a "
                  "young_modulus_pa of "))
      << o.text;
}

/// The three parts of the volume are 3,160,496 + 314,086 + 17,704 voxels of 0.617188^2 x 1.33333 mm^3, twice
/// as long: 0.01419 m^3. The smoothed surface rounds edges, and cubes know their fill to 4^3 samples: 2 %.
TEST_F(BadBody, LiverOfACT) {
  const std::string data = data_folder(), scene = source_path("scenes/liver.yaml");
  const std::string command =
      "run " + scene + " --frames 1 --devices cpu --view none --json " + path("out.json");
  const char* before = std::getenv("TACTUS_DATA");
  const std::string kept = before == nullptr ? "" : before;
  unsetenv("TACTUS_DATA");
  expect_refused(command, 2, {"liver.yaml:", "but the environment variable TACTUS_DATA is not set"});
  setenv("TACTUS_DATA", path("nowhere").c_str(), 1);
  expect_refused(command, 1, {"can't read '" + path("nowhere/meshes/liver.inr.gz") + "': No such file"});
  if (before != nullptr) setenv("TACTUS_DATA", kept.c_str(), 1);
  if (!std::filesystem::exists(data + "/meshes/liver.inr.gz"))
    GTEST_SKIP() << without_data("meshes/liver.inr.gz");
  const Outcome o = run_tactus(command);
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json monitors = read_json("out.json")["bodies"][0]["monitors"];
  EXPECT_NEAR(monitors["volume_m3"][0].get<double>() / 0.01419, 1, 0.02);
}

}  // namespace
}  // namespace tactus::test
