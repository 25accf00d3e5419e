// docs/your_cameras.md does what it says: its rig file and every command on it, with four real cameras.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "cli/program.h"
#include "support/data_folder.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::run_tactus;

class YourCameras : public test::ProgramTest {};

TEST_F(YourCameras, EveryCommandOfThePageWorks) {
  if (data_folder().empty()) GTEST_SKIP() << "no data: set TACTUS_DATA";
  const fs::path horseman = fs::path(data_folder()) / "utrecht_horseman";
  for (int c = 1; c <= 4; ++c) {
    const std::string cam = "cam" + std::to_string(c);
    fs::create_directories(path(cam));
    fs::copy(horseman / cam / "background.avi", path(cam + "/empty.mp4"));
    fs::copy(horseman / cam / "video.avi", path(cam + "/film.mp4"));
    fs::copy(horseman / cam / "other_calib" / "fergusdemari_config.xml", path(cam + "/calibration.xml"));
  }
  std::ifstream page(source_path("docs/your_cameras.md"));
  std::string line, rig;
  std::vector<std::string> commands;
  bool in_yaml = false;
  while (std::getline(page, line)) {
    if (line.rfind("```", 0) == 0)
      in_yaml = line == "```yaml";
    else if (in_yaml)
      rig += line + "\n";
    else if (line.rfind("    tactus ", 0) == 0)
      commands.push_back(line.substr(11));
  }
  write("rig.yaml", rig);
  ASSERT_EQ(commands.size(), 7U);
  const fs::path before = fs::current_path();
  fs::current_path(path(""));
  for (const std::string& command : commands) {
    const Outcome o = run_tactus(command);
    EXPECT_EQ(o.code, 0) << command << "\n" << o.text;
  }
  fs::current_path(before);
  const nlohmann::json frame = read_json("hull.json")["frames"][0];
  EXPECT_GT(frame["recall"].get<double>(), 0.85);
  // Independent calibrations and hand-painted masks give 0.199 to 0.206 m3; background subtraction is
  // rougher.
  EXPECT_NEAR(frame["volume_m3"].get<double>(), 0.2, 0.04);
  EXPECT_TRUE(fs::exists(path("hull.ply")));
  EXPECT_TRUE(fs::exists(path("doctor.html")));
  EXPECT_TRUE(fs::exists(path("masks/cam4_0000.png")));
  EXPECT_TRUE(fs::exists(path("masks/cam4_0000_alpha.png")));
}

class Doctor : public test::ProgramTest {
 protected:
  std::string horseman_rig(const std::string& calibration, const std::string& more) const {
    std::string text = more +
                       "up: +z\nimage_size_px: [644, 486]\n"
                       "workspace_m: {min: [-0.1, -0.15, -0.9], max: [1.05, 1.55, 0.0]}\ncameras:\n";
    for (int c = 1; c <= 4; ++c) {
      const std::string cam = "cam" + std::to_string(c);
      text += "  - {name: " + cam + ", calibration: utrecht_horseman/" + cam + "/" + calibration +
              ", mask: utrecht_horseman/" + cam + "/customMask.png}\n";
    }
    return text;
  }
  std::string corners() const {
    std::string flags = " --board 8x6x0.115";
    for (int c = 1; c <= 4; ++c)
      flags += " --corners cam" + std::to_string(c) + "=utrecht_horseman/cam" + std::to_string(c) +
               "/boardcorners.xml";
    return flags;
  }
};

TEST_F(Doctor, HorsemanIsUnsureBySilhouettesAndSettledByItsBoard) {
  if (data_folder().empty()) GTEST_SKIP() << "no data: set TACTUS_DATA";
  write("good.yaml", horseman_rig("other_calib/fergusdemari_config.xml", "unit_m: 0.001\n"));
  write("wrong.yaml", horseman_rig("config.xml",
                                   "unit_m: 0.001\ncalibration_nodes: {rotation: Rotation, "
                                   "translation: Translation}\n"));
  Outcome o = run_tactus("doctor " + path("good.yaml") + " --json " + path("alone.json"));
  EXPECT_EQ(o.code, 5) << o.text;
  EXPECT_EQ(read_json("alone.json")["verdict"], "unsure");
  EXPECT_NE(o.text.find("--distance"), std::string::npos);
  o = run_tactus("doctor " + path("good.yaml") + corners() + " --json " + path("good.json"));
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_EQ(read_json("good.json")["verdict"], "well");
  o = run_tactus("doctor " + path("wrong.yaml") + corners() + " --json " + path("wrong.json"));
  EXPECT_EQ(o.code, 4) << o.text;
  EXPECT_NE(o.text.find("no one scale cures it"), std::string::npos) << o.text;
  const nlohmann::json finding = read_json("wrong.json")["findings"].back();
  for (const char* key : {"camera", "fault", "cure", "recall_before", "recall_after"})
    EXPECT_TRUE(finding.contains(key)) << key;
}

TEST_F(Doctor, NamesAndCuresAndTheCureIsWell) {
  Outcome o = run_tactus("synth hand --cameras 8 --no-colors --frames 1 --out " + path("set"));
  ASSERT_EQ(o.code, 0) << o.text;
  o = run_tactus("doctor " + path("set/rig.yaml"));
  EXPECT_EQ(o.code, 0) << o.text;
  // Two cameras get each other's calibration.
  fs::rename(path("set/cameras/cam1.yaml"), path("set/cameras/x.yaml"));
  fs::rename(path("set/cameras/cam4.yaml"), path("set/cameras/cam1.yaml"));
  fs::rename(path("set/cameras/x.yaml"), path("set/cameras/cam4.yaml"));
  o = run_tactus("doctor " + path("set/rig.yaml") + " --fix " + path("cured") + " --json " + path("d.json") +
                 " --html " + path("d.html"));
  EXPECT_EQ(o.code, 4) << o.text;
  const nlohmann::json d = read_json("d.json");
  EXPECT_EQ(d["verdict"], "faulty");
  ASSERT_EQ(d["findings"].size(), 1U) << o.text;
  EXPECT_EQ(d["findings"][0]["camera"], "cam1, cam4");
  EXPECT_GT(d["findings"][0]["recall_after"].get<double>(), 0.99);
  o = run_tactus("doctor " + path("cured/rig.yaml"));
  EXPECT_EQ(o.code, 0) << o.text;
}

TEST_F(Doctor, ReconstructStopsWhereNothingCanBeRight) {
  Outcome o = run_tactus("synth hand --cameras 8 --no-colors --frames 1 --out " + path("set"));
  ASSERT_EQ(o.code, 0) << o.text;
  o = run_tactus("reconstruct --source masks " + path("set/rig.yaml") +
                 " --resolution 32 --workspace 2,2,2,3,3,3");
  EXPECT_EQ(o.code, 1) << o.text;
  EXPECT_NE(o.text.find("tactus doctor"), std::string::npos) << o.text;
  o = run_tactus("reconstruct --source masks " + path("set/rig.yaml") + " --resolution 64 --workspace auto");
  EXPECT_EQ(o.code, 0) << o.text;
}

TEST_F(Doctor, TimesTellWhetherCamerasAreSynchronised) {
  if (data_folder().empty()) GTEST_SKIP() << "no data: set TACTUS_DATA";
  Outcome o = run_tactus("synth sphere --cameras 8 --no-colors --frames 1 --out " + path("set"));
  ASSERT_EQ(o.code, 0) << o.text;
  const std::string times =
      data_folder() + "/charuco_4cam/tests/sessions/post_optimization/calibration/extrinsic/timestamps.csv";
  o = run_tactus("doctor " + path("set/rig.yaml") + " --timestamps " + times);
  EXPECT_EQ(o.code, 4) << o.text;
  EXPECT_NE(o.text.find("not synchronised"), std::string::npos) << o.text;
  EXPECT_NE(o.text.find("2.0 ms apart"), std::string::npos) << o.text;
  EXPECT_NE(o.text.find("at most 19.9 ms"), std::string::npos) << o.text;
}

}  // namespace
}  // namespace tactus
