// What strangers try first, and what they forget: each is told.
#include "cli/program.h"
#include "support/recordings.h"

namespace tactus::test {
namespace {

class FirstTries : public ProgramTest {
 protected:
  /// A cube of the default material beside the floor.
  std::string scene(const std::string& more) const {
    return write(
        "s.yaml",
        "source: {kind: none, frames: 0-1}\nbodies:\n  - {name: a, shape: {kind: box, size_m: [0.1, 0.1, "
        "0.1]}, placement: {position_m: [0, 0.06, 0]}, spacing_m: 0.02}\nobstacles:\n  - {name: floor, kind: "
        "plane}\n" +
            more);
  }
};

TEST_F(FirstTries, AFileWithoutASourceIsNoFigure) {
  write("rig.yaml", "cameras: []\n");
  expect_refused("reconstruct " + path("rig.yaml"), 2, {"rig.yaml' is a file or folder", "--source masks"});
  expect_refused("reconstruct hnad", 2, {"unknown figure 'hnad'", "hand"});
}

TEST_F(FirstTries, PicturesAreNamedWhereTheyAre) {
  const std::string run = "run " + scene("output: {video: false, contact_sheet: false}\n") +
                          " --devices cpu --out " + path("out");
  const Outcome none = run_tactus(run);
  if (none.text.find("OpenGL") != std::string::npos) GTEST_SKIP() << "without OpenGL";
  EXPECT_EQ(none.code, 0) << none.text;
  EXPECT_EQ(none.text.find("pictures:"), std::string::npos) << none.text;
  scene("output: {video: false}\n");
  const Outcome sheet = run_tactus(run);
  EXPECT_NE(sheet.text.find("pictures: " + path("out") + "/s.png\n"), std::string::npos) << sheet.text;
}

/// Cubes whose shape is matched are crushed as elements are: to less than 0.3 of their volume. 1 m of the
/// default 10 kPa in cubes of 10 cm falls by 5 cm, and 2 s later a fifth of its cubes are inside out.
TEST_F(FirstTries, ABodyThatEndsCrushedIsTold) {
  const std::string crushed =
      write("c.yaml",
            "source: {kind: none, frames: 0-59}\nbodies:\n  - {name: heavy, shape: {kind: box, size_m: [1, "
            "0.5, 1]}, placement: "
            "{position_m: [0, 0.3, 0]}, spacing_m: 0.1}\nobstacles:\n  - {name: floor, kind: plane}\n");
  const Outcome o = run_tactus("run " + crushed + " --devices cpu --view none");
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_NE(o.text.find("crushed to less than 0.3 of their volume, or worse: 'heavy'"), std::string::npos)
      << o.text;
  const Outcome light = run_tactus("run " + scene("") + " --devices cpu --view none");
  EXPECT_EQ(light.text.find("crushed"), std::string::npos) << light.text;
}

/// Soft matter gives way where it is high: told before the first frame, with a modulus that does. Five cubes
/// of 1 kg weigh 49.05 N on 0.01 m^2, 4905 Pa. A column of height H and weight W, w wide, buckles below
/// E = 12 W H^2 / (7.84 w^2 A) (Greenhill): with W = 19.6 N, H = 0.2 m that is 12.0 kPa for two cubes; times
/// 1.3 and 1.25, upwards to two digits, 20 kPa is advised, which is silent.
TEST_F(FirstTries, BodiesTooSoftForTheirWeightAreTold) {
  const auto told = [&](int cubes, const std::string& size, const std::string& material) {
    const double height_m = size.empty() ? 0.1 : 0.5;
    std::string text =
        "source: {kind: none, frames: 0-1}\nobstacles:\n  - {name: floor, kind: plane}\nbodies:\n";
    for (int k = 0; k < cubes; ++k)
      text += "  - {name: c" + std::to_string(k) +
              ", shape: {kind: box, size_m: " + (size.empty() ? "[0.1, 0.1, 0.1]" : size) +
              "}, placement: {position_m: [0, " + std::to_string((k + 0.5) * height_m) +
              ", 0]}, spacing_m: 0.05, material: {" + material + "}}\n";
    return run_tactus("run " + write("h.yaml", text) + " --devices cpu --view none").text;
  };
  const std::string five = told(5, "", ""), two = told(2, "", ""), block = told(1, "[1, 0.5, 1]", "");
  EXPECT_NE(
      five.find("body 'c0' and the 4 bodies on it weigh 4905 Pa at its foot, 49 % of its 'young_modulus_pa' "
                "of 10000"),
      std::string::npos)
      << five;
  EXPECT_EQ(five.find("body 'c1' and"), std::string::npos) << five;
  EXPECT_NE(two.find("body 'c0' and the body on it are a column 0.2 m high and 0.1 m wide"),
            std::string::npos)
      << two;
  EXPECT_NE(two.find("take a 'young_modulus_pa' of at least 20000\n"), std::string::npos) << two;
  EXPECT_NE(block.find("body 'c0' weighs 4905 Pa at its foot"), std::string::npos) << block;
  EXPECT_NE(block.find("at least 21000\n"), std::string::npos) << block;  // 4905 / 0.3 * 1.25 = 20.4 kPa
  for (const std::string& silent :
       {told(1, "", ""), told(2, "", "young_modulus_pa: 20000"),
        told(1, "[1, 0.5, 1]", "young_modulus_pa: 21000"), told(1, "[1, 0.5, 1]", "model: tled")})
    EXPECT_EQ(silent.find("warning"), std::string::npos) << silent;
}

/// A rod that is tilted by 10 degrees lies down, and four legs keep one another: neither is a column that
/// falls, though boxes round them are high and narrow.
TEST_F(FirstTries, WhatLiesDownAndLegsAreNoColumns) {
  std::string text =
      "source: {kind: none, frames: 0-1}\nobstacles:\n  - {name: floor, kind: plane}\nbodies:\n"
      "  - {name: rod, shape: {kind: box, size_m: [0.02, 0.02, 0.5]}, placement: {position_m: [1, 0.1, 0], "
      "rotation_deg: [10, 0, 0]}, spacing_m: 0.02, material: {model: tled, young_modulus_pa: 30000}}\n"
      "  - {name: top, shape: {kind: box, size_m: [0.4, 0.08, 0.4]}, placement: {position_m: [0, 0.12, 0]}, "
      "spacing_m: 0.04, material: {model: tled, young_modulus_pa: 40000}}\n";
  for (int k = 0; k < 4; ++k)
    text += "  - {name: leg" + std::to_string(k) +
            ", shape: {kind: box, size_m: [0.08, 0.08, 0.08]}, placement: {position_m: [" +
            (k % 2 == 0 ? "-0.16" : "0.16") + ", 0.04, " + (k < 2 ? "-0.16" : "0.16") +
            "]}, spacing_m: 0.04, material: {model: tled, young_modulus_pa: 40000}}\n";
  const Outcome o = run_tactus("run " + write("l.yaml", text) + " --devices cpu --view none");
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_EQ(o.text.find("young_modulus_pa"), std::string::npos) << o.text;
}

/// A cube beside its tray falls 20 of its sizes, 2 m, in 0.64 s; one on it doesn't.
TEST_F(FirstTries, ABodyThatMissesItsTrayIsToldOnce) {
  const std::string file = write("f.yaml",
                                 "source: {kind: none, frames: 0-29}\nbodies:\n  - {name: beside, shape: "
                                 "{kind: box, size_m: [0.1, 0.1, 0.1]}, "
                                 "placement: {position_m: [0.4, 0.1, 0]}, spacing_m: 0.05}\n  - {name: upon, "
                                 "shape: {kind: box, size_m: [0.1, "
                                 "0.1, 0.1]}, placement: {position_m: [0, 0.07, 0]}, spacing_m: "
                                 "0.05}\nobstacles:\n  - {name: tray, kind: box, "
                                 "size_m: [0.3, 0.02, 0.3]}\n");
  const Outcome o = run_tactus("run " + file + " --devices cpu --view none");
  EXPECT_EQ(o.code, 0) << o.text;
  const auto at = o.text.find("body 'beside' falls for ever: its centre is at (0.4, -2");
  EXPECT_NE(at, std::string::npos) << o.text;
  EXPECT_EQ(o.text.find("for ever", at + 25), std::string::npos) << o.text;
}

/// One message for what is no format that is known, and which other kind of shape a known one is.
TEST_F(FirstTries, FilesOfUnknownFormatsAreToldAllThatAre) {
  write("a.plyy", "ply\n");
  expect_refused(
      "info " + path("a.plyy"), 1,
      {"a.plyy: no mesh and no label volume", "NIfTI (.nii, .nii.gz)", ".stl", "did you mean '.ply'?"});
  const auto body = [&](const std::string& kind, const std::string& file) {
    write(file, "nothing\n");
    return "run " + write("b.yaml", "source: {kind: none}\nbodies:\n  - {name: a, shape: {kind: " + kind +
                                        ", path: " + file + "}}\n");
  };
  expect_refused(body("mesh", "l.nii.gz"), 2,
                 {"l.nii.gz", "a label volume is a body's shape with 'kind: labels'"});
  expect_refused(body("labels", "m.ply"), 1, {"m.ply", "a mesh is a body's shape with 'kind: mesh'"});
}

/// A tetrahedron with triangles that are clockwise from outside holds a block as one that isn't.
TEST_F(FirstTries, EmptyFilesAreToldSo) {
  for (const std::string name : {"a.ply", "a.stl", "a.glb", "a.nii", "a.nrrd"})
    expect_refused("info " + write(name, ""), 1, {name + ": the file is empty"});
  for (const std::string verb : {"doctor ", "reconstruct --source masks "})
    expect_refused(verb + write("rig.yaml", ""), 2, {"rig.yaml:1: the file is empty"});
  expect_refused("run " + write("s.yaml", ""), 2, {"s.yaml:1: the file is empty"});
}

TEST_F(FirstTries, WordsOfTheShellInFilesAreTold) {
  for (const std::string folder : {"~", "$HOME"})
    expect_refused("run " + write("s.yaml", "source: {kind: masks, path: '" + folder + "/no/rig.yaml'}\n"), 1,
                   {folder + "/no/rig.yaml': No such file", "'~' and '$' are a shell's"});
}

TEST_F(FirstTries, AFilmOfAnOpenMeshIsTold) {
  const std::string open = write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const Outcome o = run_tactus("synth " + open + " --cameras 3 --no-colors --out " + path("film"));
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_NE(o.text.find("warning: '" + open + "' does not bound a solid: 3 open edges"), std::string::npos)
      << o.text;
}

/// Nothing on the command line is passed over, and every refusal begins alike.
TEST_F(FirstTries, WordsThatDoNothingAreRefused) {
  const std::string scene = write("s.yaml", "source: {kind: none}\n");
  expect_refused("run " + scene + " day", 2,
                 {"'day' is a word too many for 'tactus run'", "stand in quotes", "`tactus run --help`"});
  expect_refused("run " + scene + " --view window", 2, {"--view: 'window'"});
  expect_refused("run " + scene + " --json", 2, {"--json: "});
  expect_refused("run " + scene + " --frames 9999999999", 2, {"--frames: '9999999999'", "1 to 999999999"});
  expect_refused("run " + scene + " --json - --report -", 2, {"is given for two outputs"});
  expect_refused("synth hand --size 0.5 --out " + path("film"), 2, {"--size is of meshes"});
  expect_refused("synth a.ply --moving --out " + path("film"), 2, {"--moving moves figures"});
  expect_refused("info " + scene, 1, {"a scene: info --frame"});
  const std::string comma = write("c.yaml",
                                  "source: {kind: none}\nbodies: [{name: b, shape: {kind: box}, "
                                  "spacing_m: 0,02}]\n");
  expect_refused("run " + comma, 2, {"c.yaml:2: unknown key '02'", "has a point: 0.5, not 0,5"});
}

TEST_F(FirstTries, AnObstacleThatFacesInwardsIsTurned) {
  const std::string corners = "v -1 0 -1\nv 1 0 -1\nv 0 0 1\nv 0 -1 0\n";
  write("in.obj", corners + "f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n");
  write("out.obj", corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  int turned = 0;
  for (const std::string name : {"in", "out"}) {
    const std::string file =
        write(name + ".yaml",
              "source: {kind: none, frames: 0-9}\nbodies:\n  - {name: a, shape: {kind: box, size_m: [0.1, "
              "0.1, 0.1]}, placement: "
              "{position_m: [0, 0.06, 0]}, spacing_m: 0.02}\nobstacles:\n  - {name: m, kind: mesh, path: " +
                  name + ".obj}\n");
    const Outcome o = run_tactus("run " + file + " --devices cpu --view none --json " + path(name + ".json"));
    ASSERT_EQ(o.code, 0) << o.text;
    turned += o.text.find("obstacle 'm': its triangles face inwards") != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(turned, 1);
  EXPECT_EQ(read_json("in.json")["state_hash"], read_json("out.json")["state_hash"]);
}

/// Black on white: all of the rim is white. An object that three sides cut off covers 56 % of it.
TEST_F(FirstTries, MasksOfABlackObjectAreTold) {
  write_calibration(path("camera.yaml"));
  const auto told = [&](const cv::Rect& square, int of_square, int round) {
    cv::Mat mask(64, 64, CV_8U, cv::Scalar(round));
    mask(square).setTo(of_square);
    write_image(path("m.png"), mask);
    write_rig(path("rig.yaml"), {{.name = "a", .mask = "m.png"}, {.name = "b", .mask = "m.png"}});
    return run_tactus("reconstruct --source masks " + path("rig.yaml") + " --resolution 16 --devices cpu")
        .text;
  };
  const std::string inverted = told({26, 26, 12, 12}, 0, 255), right = told({26, 26, 12, 12}, 255, 0),
                    at_a_side = told({0, 0, 64, 40}, 255, 0);
  EXPECT_NE(inverted.find("is its object black?"), std::string::npos) << inverted;
  EXPECT_EQ(right.find("is its object black?"), std::string::npos) << right;
  EXPECT_EQ(at_a_side.find("is its object black?"), std::string::npos) << at_a_side;
}

/// Of three cameras one lacks its mask, and none has a film: the doctor names that one, not a film of the
/// first.
TEST_F(FirstTries, TheDoctorNamesTheCameraThatLacksItsMask) {
  write_calibration(path("camera.yaml"));
  write_picture(path("m.png"), 255);
  write_rig(path("rig.yaml"),
            {{.name = "left", .mask = "m.png"}, {.name = "right", .mask = "m.png"}, {.name = "top"}});
  expect_refused("doctor " + path("rig.yaml"), 2, {"camera 'top'", "has no 'mask'"});
}

}  // namespace
}  // namespace tactus::test
