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

/// A tetrahedron with triangles that are clockwise from outside holds a block as one that isn't.
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
