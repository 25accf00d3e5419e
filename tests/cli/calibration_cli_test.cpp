/// tactus calibration, calibrate and masks, from the shell.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "cli/program.h"
#include "support/data_folder.h"
#include "tactus/rig/calibrate/bundle.h"
#include "tactus/rig/calibration_files/calibration_file.h"
#include "tactus/rig/images/camera_file.h"
#include "tactus/rig/rig_file.h"

namespace tactus::test {
namespace {

class CalibrationProgram : public ProgramTest {};

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_F(CalibrationProgram, ConvertsAndShows) {
  ASSERT_EQ(run_tactus("synth hand --out " + path("set") + " --frames 1 --no-colors").code, 0);
  std::string files;
  for (int i = 0; i < 8; ++i) files += path("set/cameras/cam" + std::to_string(i) + ".yaml") + " ";
  const Outcome converted =
      run_tactus("calibration convert " + files + path("rig.json") + " --to multical --unit-m 1");
  ASSERT_EQ(converted.code, 0) << converted.text;
  const Outcome shown = run_tactus("calibration show " + path("rig.json") + " --unit-m 1");
  EXPECT_EQ(shown.code, 0);
  EXPECT_TRUE(has(shown.text, "multical, 8 cameras")) << shown.text;
  expect_refused("calibration show " + path("rig.json"), 2,
                 {"multical files do not say their unit of length; give --unit-m"});
  expect_refused("calibration convert " + path("rig.json") + " " + path("x") + " --to qualisys --unit-m 1", 2,
                 {"--to 'qualisys' is only read; written are: "});
  expect_refused("calibration convert " + path("rig.json") + " " + path("x") + " --to kalibre --unit-m 1", 2,
                 {"did you mean 'kalibr'?"});
  // The rig's cameras may all come from the one file.
  std::ifstream in(path("set/rig.yaml"));
  std::string yaml{std::istreambuf_iterator<char>(in), {}};
  for (int i = 0; i < 8; ++i) {
    const std::string line = "    calibration: cameras/cam" + std::to_string(i) + ".yaml\n";
    const std::size_t at = yaml.find(line);
    ASSERT_NE(at, std::string::npos);
    yaml.erase(at, line.size());
  }
  std::ofstream(path("set/one.yaml")) << "calibration: ../rig.json\n" << yaml;
  const RigFile one = read_rig_file(path("set/one.yaml")), each = read_rig_file(path("set/rig.yaml"));
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(length(one.rig.cameras[i].center_world() - each.rig.cameras[i].center_world()), 0, 1e-12);
    EXPECT_EQ(one.rig.cameras[i].fx_px, each.rig.cameras[i].fx_px);
  }
}

TEST_F(CalibrationProgram, MasksAreThoseThatAreUsed) {
  ASSERT_EQ(run_tactus("synth sphere --out " + path("set") + " --frames 1 --no-colors").code, 0);
  const Outcome o = run_tactus("masks " + path("set/rig.yaml") + " --out " + path("masks"));
  ASSERT_EQ(o.code, 0) << o.text;
  // No lens: what is written is what was read.
  const RigFile rig = read_rig_file(path("set/rig.yaml"));
  const Camera& c = rig.rig.cameras[0];
  EXPECT_EQ(read_mask(path("masks/" + c.name + "_0000.png"), c.width_px, c.height_px).pixels,
            read_mask(path("set/masks/" + c.name + "_0000.png"), c.width_px, c.height_px).pixels);
  expect_refused("masks " + path("set/rig.yaml") + " --out " + path("masks") + " --mask-threshold 1.5", 2,
                 {"--mask-threshold 1.5: expected above 0 and below 1"});
}

TEST_F(CalibrationProgram, IntrinsicsOfOpenCvsBoards) {
  if (!calibration_missing().empty()) GTEST_SKIP() << calibration_missing();
  const std::string folder = data_folder() + "/opencv_boards";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no opencv_boards: set TACTUS_DATA";
  const std::string verb = "calibrate intrinsics '" + folder + "/left%02d.jpg' --square-mm 25 ";
  const Outcome o = run_tactus(verb + "--board chessboard:9x6 --out " + path("left.yaml") + " --report " +
                               path("left.html"));
  ASSERT_EQ(o.code, 0) << o.text;
  EXPECT_TRUE(has(o.text, "board in 13 of 13 pictures")) << o.text;
  const CalibrationData data = read_calibration_file(path("left.yaml"));
  EXPECT_FALSE(data.cameras.at(0).has_pose);
  // The window that fits the squares gives 533.9; OpenCV's own of 11 px 536 (calibrate_test).
  EXPECT_NEAR(data.cameras[0].calibrated.camera.fx_px, 534, 1);
  EXPECT_GT(std::filesystem::file_size(path("left.html")), 10000U);
  expect_refused(verb + "--board chess:9x6 --out " + path("x.yaml"), 2, {"expected chessboard:9x6"});
  expect_refused("calibrate rig --camera a=x.mp4 --board chessboard:9x6 --square-mm 25 --out " + path("x"), 2,
                 {"expected at least two cameras"});
}

}  // namespace
}  // namespace tactus::test
