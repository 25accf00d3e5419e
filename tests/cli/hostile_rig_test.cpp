// Rig files that mean no good, or are wrong by many powers of ten: refused by name, or told.
#include <fstream>
#include <regex>
#include <sstream>

#include "cli/program.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

std::string text_of(const std::string& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Four cameras and a depth camera, six frames.
class HostileRig : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (IsSkipped()) return;
    const Outcome film = run_tactus(
        "synth sphere --moving --frames 6 --cameras 4 --depth-cameras 1 --no-colors --out " + path("film"));
    ASSERT_EQ(film.code, 0) << film.text;
    rig_ = path("film/rig.yaml");
    yaml_ = text_of(rig_);
  }
  /// Puts `to` in the place of what matches, once, in a file.
  static void change(const std::string& file, const std::string& pattern, const std::string& to) {
    const std::string text = text_of(file);
    const std::string changed =
        std::regex_replace(text, std::regex(pattern), to, std::regex_constants::format_first_only);
    ASSERT_NE(changed, text) << pattern << " in " << file;
    std::ofstream(file) << changed;
  }
  std::string reconstruct() const {
    return "reconstruct --source masks " + rig_ + " --resolution 32 --devices cpu";
  }
  std::string rig_, yaml_;
};

TEST_F(HostileRig, WorkspacesBeyondReasonAreRefused) {
  for (const char* box :
       {"{min: [-1e300, 0, -1], max: [1, 2, 1]}", "{min: [-1e38, 0, -1], max: [1e38, 2, 1]}",
        "{min: [-1, 0, -1], max: [1, 1e7, 1]}", "{min: [0, 0, 0], max: [1e-30, 1e-30, 1e-30]}"}) {
    std::ofstream(rig_) << std::regex_replace(yaml_, std::regex("workspace_m: .*"),
                                              std::string("workspace_m: ") + box);
    expect_refused(reconstruct(), 2, {"rig.yaml", "workspace_m"});
  }
  std::ofstream(rig_) << yaml_;
  const std::string body =
      "bodies:\n  - {name: b, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.1}\n";
  write("s.yaml",
        "source: {kind: masks, path: film/rig.yaml}\nreconstruction: {resolution: 16, workspace_m: {min_m: "
        "[-1e30, 0, 0], "
        "max_m: [1e30, 1, 1]}}\n" +
            body);
  const Outcome scene = run_tactus("run " + path("s.yaml") + " --view none --devices cpu");
  EXPECT_EQ(scene.code, 2) << scene.text;
}

/// With depth: a hole's point is projected into every silhouette, and a kernel read beyond it.
TEST_F(HostileRig, CamerasBeyondReasonAreRefused) {
  for (const char* camera : {"cam1", "tof"}) {
    const std::string file = path(std::string("film/cameras/") + camera + ".yaml"), before = text_of(file);
    for (const char* huge : {"1e38", "1e300", "1e12"}) {
      std::ofstream(file) << before;
      change(file, R"((CameraMatrix[\s\S]*?data: *\[ *)[^,]*)", std::string("$01") + huge);
      const Outcome focal = run_tactus(reconstruct());
      EXPECT_EQ(focal.code, 1) << camera << huge << focal.text;
      EXPECT_NE(focal.text.find("focal length"), std::string::npos) << focal.text;
      std::ofstream(file) << before;
      change(file, R"((Translation[\s\S]*?data: *\[ *)[^,]*)", std::string("$01") + huge);
      const Outcome far = run_tactus(reconstruct());
      EXPECT_EQ(far.code, 1) << camera << huge << far.text;
      EXPECT_NE(far.text.find("translation"), std::string::npos) << far.text;
    }
    std::ofstream(file) << before;
  }
}

/// A mask that is a link to itself is a mask that isn't there: its camera misses the tick.
TEST_F(HostileRig, AMaskThatLeadsToItselfIsAMissingMask) {
  const std::string file = path("film/masks/cam1_0002.png");
  ASSERT_TRUE(fs::remove(file));
  fs::create_symlink("cam1_0002.png", file);
  const std::string json = " --frames 0-5 --json " + path("r.json");
  const Outcome loop = run_tactus(reconstruct() + json);
  EXPECT_EQ(loop.code, 0) << loop.text;
  EXPECT_NE(loop.text.find("cam1_0002.png"), std::string::npos) << loop.text;
  fs::remove(file);
  const Outcome missing = run_tactus(reconstruct() + json);
  EXPECT_EQ(missing.code, loop.code);
  // And where it is the rig's only mask of a camera.
  change(rig_, R"(masks/cam1_%04d\.png)", "masks/loop.png");
  fs::create_symlink("loop.png", path("film/masks/loop.png"));
  const Outcome only = run_tactus(reconstruct());
  EXPECT_EQ(only.code, 1) << only.text;
  EXPECT_NE(only.text.find("loop.png"), std::string::npos) << only.text;
}

/// A rig file may name any file that its reader may read. What is in it stays there.
TEST_F(HostileRig, FilesThatAreNoCalibrationsAreNotQuoted) {
  const std::string secret = "ySecretOfRootThatNobodyMayRead";
  const std::string shadow = "root:$y$j9T$" + secret + ":19000:0:99999:7:::\ndaemon:*:19000:0:99999:7:::\n";
  for (const std::string& text :
       {shadow, "{\"a\": \"" + secret + "\"}", "12 " + secret + "\n" + secret + "\n",
        "key = \"" + secret + "\"\n", "token: " + secret + "\n", secret + "\n"}) {
    write("secret", text);
    std::ofstream(rig_) << std::regex_replace(yaml_, std::regex(R"(cameras/cam1\.yaml)"), "../secret");
    for (const char* format : {"", "opencv", "kalibr", "middlebury", "projections", "colmap-text"}) {
      std::string rig = text_of(rig_);
      if (*format != '\0') rig += std::string("calibration_format: ") + format + "\nunit_m: 1\n";
      write("film/hostile.yaml", rig);
      const Outcome o =
          run_tactus("reconstruct --source masks " + path("film/hostile.yaml") + " --devices cpu");
      EXPECT_NE(o.code, 0);
      EXPECT_EQ(o.text.find("ThatNobodyMayRead"), std::string::npos) << format << ": " << o.text;
    }
  }
}

TEST_F(HostileRig, ABodyFarFromTheCamerasIsTold) {
  const auto text = [&](const std::string& x_m) {
    write("s.yaml",
          "source: {kind: masks, path: film/rig.yaml}\nreconstruction: {resolution: 16}\n"
          "gravity_m_s2: [0, 0, 0]\n"
          "bodies:\n  - {name: lost, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.1, placement: "
          "{position_m: [" +
              x_m + ", 0.5, 0]}}\n");
    const Outcome o = run_tactus("run " + path("s.yaml") + " --frames 1 --view none --devices cpu --json " +
                                 path("r.json"));
    EXPECT_EQ(o.code, 0) << o.text;
    std::string found;
    const nlohmann::json json = read_json("r.json");
    for (const nlohmann::json& n : json["notices"])
      if (n["code"] == "body.far") found += n["text"].get<std::string>();
    return found;
  };
  EXPECT_NE(text("50").find("body 'lost' lies 4"), std::string::npos) << text("50");
  EXPECT_EQ(text("0.5"), "");
}

/// A million cubes take some seconds: lines before, between and after.
TEST_F(HostileRig, ManyCubesSayHowFarTheyAre) {
  write("s.yaml",
        "source: {kind: none}\nbodies:\n  - {name: fine, shape: {kind: box, size_m: [0.1, 0.1, 0.1]}, "
        "spacing_m: 0.00098, "
        "contact: false, fixed: [{kind: half_space, point_m: [0, 1, 0], normal: [0, -1, 0]}]}\n");
  const Outcome o = run_tactus("run " + path("s.yaml") + " --frames 1 --view none --devices cpu");
  for (const char* part :
       {"cubes in its box: finding those inside", "painting, fixing and loading",
        "making tables of their elements", "finding their surface's points", "cubes: made"})
    EXPECT_NE(o.text.find(part), std::string::npos) << part << " in " << o.text;
}

}  // namespace
}  // namespace tactus::test
