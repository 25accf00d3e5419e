// Depth cameras and masks through rig files: what is used, what is refused, and what is said about it.
#include "support/recordings.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <fstream>
#include <functional>
#include <sstream>

#include "cli/program.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// A data set of one figure, as `tactus synth` writes it.
class DepthInput : public ProgramTest {
 protected:
  void synth(const std::string& figure, const std::string& more = "") const {
    fs::remove_all(path("data"));
    const Outcome o = run_tactus("synth " + figure + " --no-colors --out " + path("data") + " " + more);
    ASSERT_EQ(o.code, 0) << o.text;
  }
  std::string depth_file() const { return path("data/depth/tof_0000.png"); }
  /// Replaces every 16-bit value (units of 0.1 mm) of the first depth image.
  void change_depth(const std::function<double(int x, int y, double value)>& change) const {
    cv::Mat image = cv::imread(depth_file(), cv::IMREAD_UNCHANGED);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        auto& value = image.at<std::uint16_t>(y, x);
        value = cv::saturate_cast<std::uint16_t>(change(x, y, value));
      }
    }
    cv::imwrite(depth_file(), image);
  }
  void change_rig(const std::string& from, const std::string& to) const {
    std::stringstream text;
    text << std::ifstream(path("data/rig.yaml")).rdbuf();
    std::string yaml = text.str();
    const auto at = yaml.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    std::ofstream(path("data/rig.yaml")) << yaml.replace(at, from.size(), to);
  }
  std::string reconstruct(const std::string& more = "") const {
    return "reconstruct --source masks " + path("data/rig.yaml") + " --resolution 64 --devices cpu --json " +
           path("out.json") + " " + more;
  }
  /// The only frame of a run that must succeed; its standard output and error in `text`.
  nlohmann::json frame(const std::string& more = "", std::string* text = nullptr) const {
    const Outcome o = run_tactus(reconstruct(more));
    EXPECT_EQ(o.code, 0) << o.text;
    if (text != nullptr) *text = o.text;
    const nlohmann::json json = read_json("out.json");
    EXPECT_EQ(json["frames"].size(), 1U);
    return json["frames"][0];
  }
  /// The depth is named as `what` in a warning and the status, and the silhouettes alone are used.
  void expect_unused(const std::string& what) const {
    std::string text;
    const nlohmann::json with = frame("", &text), without = frame("--no-depth");
    EXPECT_TRUE(has(text, "warning: " + what)) << text;
    EXPECT_TRUE(has(with["status"], what)) << with["status"];
    EXPECT_EQ(with["volume_m3"], without["volume_m3"]);
    EXPECT_EQ(without["status"], "");
  }
};

TEST_F(DepthInput, RigFilesListDepthCameras) {
  synth("bowl", "--depth-cameras 2");
  const double truth = 0.02263;  // m3, see the figure's own test
  EXPECT_EQ(frame()["status"], "");
  // The bowl's goal with depth, here with one camera before and one behind it; without, the cavity is filled.
  EXPECT_NEAR(frame()["volume_m3"].get<double>() / truth, 1, 0.05);
  EXPECT_GT(frame("--no-depth")["volume_m3"].get<double>(), 2 * truth);
  const nlohmann::json json = read_json("out.json");
  EXPECT_EQ(json["depth"], false);
}

TEST_F(DepthInput, WrongUnitsAreNamedByTheMasks) {
  synth("hand");
  change_rig("unit_m: 0.0001", "unit_m: 0.1");
  expect_unused("the depth of camera 'tof' looks like millimetres given as metres: of ");
  synth("hand");
  change_depth([](int x, int y, double e) {  // radial to z; 200x200 pixels, 200 px focal length
    return e / std::hypot(1.0, (x - 99.5) / 200, (y - 99.5) / 200);
  });
  expect_unused(
      "the depth of camera 'tof' looks like z (distance along the optical axis) given as radial distance");
  change_rig("distance: radial", "distance: z");
  EXPECT_EQ(frame()["status"], "");
  synth("hand");
  change_rig("distance: radial", "distance: z");
  expect_unused(
      "the depth of camera 'tof' looks like radial distance given as z (distance along the optical axis)");
}

TEST_F(DepthInput, NoValidPixel) {
  synth("hand");
  change_depth([](int, int, double) { return 0; });
  expect_unused("camera 'tof': the depth image has no valid pixel");
}

TEST_F(DepthInput, HalfACameraAndAStripHaveNoOpenEdge) {
  synth("bowl");
  const double whole = frame()["volume_m3"], none = frame("--no-depth")["volume_m3"];
  for (const bool half : {true, false}) {
    synth("bowl");
    change_depth([half](int x, int, double e) { return half ? (x < 100 ? e : 0) : (x / 12 == 8 ? 0 : e); });
    const nlohmann::json f = frame();
    EXPECT_EQ(f["boundary_edges"], 0);
    EXPECT_EQ(f["nonmanifold_edges"], 0);
    EXPECT_GT(f["volume_m3"].get<double>(), whole);
    EXPECT_LT(f["volume_m3"].get<double>(), none);
  }
}

TEST_F(DepthInput, ImagesThatCantBeUsed) {
  synth("sphere");
  const std::string file = depth_file();
  // Of a sequence, the camera misses the tick; the others go on.
  write_picture(file, 7, {200, 200});
  expect_unused("camera 'tof': " + file + ": expected distances as 16-bit grey");
  cv::imwrite(file, cv::Mat(100, 200, CV_16U, cv::Scalar(15000)));
  expect_unused("camera 'tof': " + file + ": 200x100 pixels, expected 200x200");
  write("data/depth/tof_0000.png", "no picture");
  expect_unused("camera 'tof': " + file + ": not an image that can be read");
  // One image is the whole recording.
  change_rig("tof_%04d.png", "tof_0000.png");
  expect_refused(reconstruct(), 1, {"rig.yaml: camera 'tof': " + file + ": not an image that can be read"});
  fs::remove(file);
  expect_refused(reconstruct(), 1, {"rig.yaml: camera 'tof': depth/tof_0000.png: no such file"});
  change_rig("tof_0000.png", "tof_%04d.png");
  expect_refused(reconstruct(), 1,
                 {"camera 'tof': " + path("data/depth/tof_%04d.png") + ": no file has such a name"});
}

TEST_F(DepthInput, ATickWithoutDepthIsToldAndTheNextHasIt) {
  synth("sphere", "--frames 3");
  fs::remove(path("data/depth/tof_0001.png"));
  const Outcome o = run_tactus(reconstruct("--frames 0-2"));
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json frames = read_json("out.json")["frames"];
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_TRUE(has(frames[1]["status"], "camera 'tof': ")) << frames[1]["status"];
  EXPECT_TRUE(has(frames[1]["status"], "tof_0001.png: no such image")) << frames[1]["status"];
  EXPECT_EQ(frames[2]["status"], "");
  EXPECT_EQ(frames[0]["volume_m3"], frames[2]["volume_m3"]);
  EXPECT_GT(frames[1]["volume_m3"].get<double>(), frames[0]["volume_m3"].get<double>());
}

/// Videos with a depth camera beside them that sees a wall through the middle of the workspace.
TEST_F(DepthInput, VideosHaveDepthCamerasToo) {
  write_calibration(path("camera.yaml"));
  write_video(path("a.avi"), Scene::object, 2);
  write_video(path("room.avi"), Scene::empty_room, 2);
  cv::imwrite(path("tof0.png"),
              cv::Mat(64, 64, CV_16U, cv::Scalar(4000)));  // mm; the cube is at 3.5 to 4.5 m
  write_rig(path("rig.yaml"), {{.name = "a", .video = "a.avi", .empty_room = "room.avi"}},
            "depth_cameras:\n  - {name: tof, calibration: camera.yaml, depth: 'tof%d.png', image_size_px: "
            "[64, 64]}\n");
  const auto volumes = [&](const std::string& more) {
    const Outcome o = run_tactus("reconstruct --source videos " + path("rig.yaml") +
                                 " --resolution 32 --devices cpu --json " + path("out.json") + " " + more);
    EXPECT_EQ(o.code, 0) << o.text;
    std::vector<double> list;
    const nlohmann::json json = read_json("out.json");
    for (const nlohmann::json& frame : json["frames"]) list.push_back(frame["volume_m3"]);
    EXPECT_EQ(list.size(), 2U);
    return list;
  };
  const std::vector<double> with = volumes(""), without = volumes("--no-depth");
  // The silhouette (16 px of 60 px focal length) holds the cube of 1 m; the plane at its middle halves it, to
  // the millimetre of its own images. The opening takes its four corners: 4 / 16^2.
  EXPECT_NEAR(without[0], 1 - 4.0 / 256, 0.01);
  EXPECT_NEAR(with[0], 0.5 * (1 - 4.0 / 256), 0.01);
  EXPECT_EQ(with[1], without[1]);  // there is no tof1.png
  EXPECT_TRUE(has(read_json("out.json")["depth"].dump(), "false"));
}

TEST_F(DepthInput, MistakesInARigFileAreRefusedWithTheLine) {
  synth("sphere");
  const std::string camera = "name: tof\n    calibration: cameras/tof.yaml";
  const std::pair<std::string, std::string> changes[] = {
      {"distance: radial", "distance: raidal"},
      {"unit_m: 0.0001", "unit_m: -1"},
      {"depth: depth/tof", "dpeth: depth/tof"},
      {"    depth: depth/tof_%04d.png\n", ""},
      {camera, "name: tof"},
      {camera, "name: cam3\n    calibration: cameras/tof.yaml"},
      {"image_size_px: [200, 200]", "image_size_px: [64, 200]"}};
  const std::vector<std::string> messages[] = {{"'raidal', expected z", "or radial", ":39: 'distance'"},
                                               {":38: 'unit_m'", "-1"},
                                               {"'dpeth'", "did you mean 'depth'?"},
                                               {"'depth': expected the 16-bit PNG of the distances"},
                                               {"'calibration': camera 'tof' has none"},
                                               {"'cam3' stands here a second time"},
                                               {"data/cameras/tof.yaml: ", "images of 200x200", "64x200"}};
  for (std::size_t i = 0; i < std::size(changes); ++i) {
    change_rig(changes[i].first, changes[i].second);
    expect_refused(reconstruct(), i + 1 == std::size(changes) ? 1 : 2, messages[i]);
    synth("sphere");
  }
}

TEST_F(DepthInput, PhotosOfAnotherSizeThanTheMasks) {
  write_calibration(path("camera.yaml"));
  write_picture(path("m.png"), 255);
  write_picture(path("photo.png"), 99, {32, 64});
  write_rig(path("rig.yaml"), {{.name = "left", .mask = "m.png\n    photo: photo.png"}});
  const std::string verb = "reconstruct --source masks " + path("rig.yaml") +
                           " --resolution 16 --devices cpu --json " + path("out.json");
  expect_refused(verb + " --texture 1", 1,
                 {"camera 'left': " + path("photo.png") + ": 32x64 pixels, expected 64x64"});
  write_picture(path("photo.png"), 99);
  expect_refused(verb + " --texture 2", 2, {"k = 2 cameras a vertex, expected 1 to 1"});
  EXPECT_EQ(run_tactus(verb + " --texture 1").code, 0);
}

TEST_F(DepthInput, CapacitiesThatAreTooSmallAreRefused) {
  synth("sphere");
  for (const char* flag : {"--max-vertices", "--max-triangles", "--max-active-bricks"}) {
    const std::string reported = ", capacity for 90: raise " + std::string(flag) + " to ";
    const std::string text = run_tactus(reconstruct(std::string(flag) + " 90")).text;
    expect_refused(reconstruct(std::string(flag) + " 90"), 1, {reported, "its mesh would be open"});
    expect_refused(reconstruct(std::string(flag) + " -3"), 2,
                   {std::string(flag) + " -3: expected 1 to 2^30"});
    // What the remedy says cures it.
    const std::string remedy = text.substr(text.find(reported) + reported.size());
    EXPECT_EQ(frame(std::string(flag) + " " + remedy.substr(0, remedy.find(' ')))["status"], "") << flag;
  }
  expect_refused(reconstruct("--depth-jump-m 0"), 2, {"--depth-jump-m", "expected > 0 to 100 m"});
}

TEST_F(DepthInput, AHoleInOneMaskIsNamedAndRepaired) {
  synth("rabbit", "--depth-cameras 0");
  const double whole = frame()["volume_m3"];
  cv::Mat mask = cv::imread(path("data/masks/cam3_0000.png"), cv::IMREAD_UNCHANGED);
  const cv::Moments m = cv::moments(mask, true);
  cv::circle(mask, cv::Point(static_cast<int>(m.m10 / m.m00), static_cast<int>(m.m01 / m.m00)), 40, 0,
             cv::FILLED);
  cv::imwrite(path("data/masks/cam3_0000.png"), mask);
  const nlohmann::json harmed = frame();
  EXPECT_LT(harmed["volume_m3"].get<double>(), 0.8 * whole);
  EXPECT_TRUE(has(harmed["status"], "camera 'cam3' carves ")) << harmed["status"];
  EXPECT_FALSE(harmed.contains("repairs"));
  const nlohmann::json repaired = frame("--repair-masks");
  EXPECT_NEAR(repaired["volume_m3"].get<double>() / whole, 1, 0.02);
  ASSERT_EQ(repaired["repairs"].size(), 1U);
  EXPECT_EQ(repaired["repairs"][0]["camera"], "cam3");
  EXPECT_TRUE(has(repaired["status"], "px of the mask of camera 'cam3' were filled")) << repaired["status"];
  // The mesh agrees with the repaired masks, and not with the mask that came: both are told.
  EXPECT_LT(repaired["iou_min"].get<double>(), repaired["repaired"]["iou_min"].get<double>() - 0.01);
  EXPECT_EQ(repaired["views"][3]["iou"], repaired["iou_min"]);
  EXPECT_GT(repaired["views"][3]["iou_repaired"].get<double>(), repaired["iou_min"].get<double>() + 0.01);
  EXPECT_FALSE(repaired["views"][2].contains("iou_repaired"));
  EXPECT_FALSE(harmed.contains("repaired"));
  EXPECT_TRUE(has(repaired["status"], "IoU with the repaired masks")) << repaired["status"];
  EXPECT_GT(frame("--tolerate-views 1")["volume_m3"].get<double>(), whole);
  fs::remove(path("out.json"));
  expect_refused(reconstruct("--tolerate-views 8"), 2, {"tolerated views 8: expected 0 to 7 with 8 cameras"});
}

/// Not what the numbers are (docs/robustness.md has them), but that they are, and which way they go.
TEST_F(ProgramTest, NoiseCostsAccuracy) {
  const Outcome o = run_tactus("noise sphere --runs 2 --resolution 48 --json " + path("noise.json"));
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json rows = read_json("noise.json")["rows"];
  const auto row = [&](const std::string& noise, const std::string& amount) -> nlohmann::json {
    for (const nlohmann::json& r : rows) {
      if (r["noise"] == noise && r["amount"] == amount) return r;
    }
    ADD_FAILURE() << noise << " " << amount;
    return {};
  };
  const nlohmann::json none = row("none", ""), goal = row("goal", "0.3 px, 1 px"),
                       much = row("calibration", "3 px"), depth = row("depth", "20 mm");
  for (const char* how : {"silhouettes", "depth"}) {
    EXPECT_GT(none[how]["iou"], goal[how]["iou"]) << how;
    EXPECT_GT(goal[how]["iou"], much[how]["iou"]) << how;
    EXPECT_GT(much[how]["surface_rms_m"], none[how]["surface_rms_m"]) << how;
  }
  EXPECT_LT(none["depth"]["surface_rms_m"], none["silhouettes"]["surface_rms_m"]);
  EXPECT_EQ(depth["silhouettes"], none["silhouettes"]);
  EXPECT_GT(depth["depth"]["surface_rms_m"], none["depth"]["surface_rms_m"]);
  fs::remove(path("noise.json"));
  expect_refused("noise sphere --runs 0", 2, {"--runs 0: expected 1 to 1000"});
  expect_refused("noise spere", 2, {"unknown figure 'spere'; did you mean 'sphere'?"});
}

/// A folder as an Azure Kinect's capture is kept: a pinhole of 640x576 pixels, f 504 px, before a wall.
class KinectInput : public ProgramTest {
 protected:
  void write_capture(double wall_m) const {
    fs::create_directories(path("kinect"));
    write_image(path("kinect/depth.png"), cv::Mat(576, 640, CV_16U, cv::Scalar(1000 * wall_m)));
    write_image(path("kinect/color.png"), cv::Mat(720, 1280, CV_8UC3, cv::Scalar(200, 100, 50)));
    const auto camera = [](const std::string& purpose, const std::string& pinhole) {
      return R"({"Purpose":"CALIBRATION_CameraPurpose)" + purpose + R"(","Intrinsics":{"ModelParameters":[)" +
             pinhole +
             R"(,0,0,0,0,0,0,0,0,0,0]},"Rt":{"Rotation":[1,0,0,0,1,0,0,0,1],"Translation":[0,0,0]}})";
    };
    // Of the sensors' sizes: 1024x1024, of which 640x576 from (192, 180); 4096x3072.
    write("kinect/calibration.json", R"({"CalibrationInformation":{"Cameras":[)" +
                                         camera("Depth", "0.5,0.45703125,0.4921875,0.4921875") + "," +
                                         camera("PhotoVideo", "0.5,0.5,0.478125,0.6375") + "]}}");
  }
  std::string reconstruct(const std::string& more) const {
    return "reconstruct --source kinect " + path("kinect") + " --resolution 80 --devices cpu --json " +
           path("out.json") + " " + more;
  }
};

TEST_F(KinectInput, DepthAloneMakesWhatLiesBehindTheMeasuredSurface) {
  write_capture(1.5);
  const Outcome o = run_tactus(reconstruct("--workspace=-1.6,-1.4,-2.3,1.6,1.4,-0.4"));
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json frame = read_json("out.json")["frames"][0];
  // The pyramid of 636x572 pixels (two are lost at each border) between 1.5 m and 2.3 m. Voxels of 4 cm: the
  // wall is met exactly, the far end, where the workspace ends, to half a voxel: 0.02 m of 0.8 at an area
  // (2.3^2 of a mean of 3.7 m^2) of 1.4 times the mean.
  const double behind = 636 / 504.0 * 572 / 504.0 * (2.3 * 2.3 * 2.3 - 1.5 * 1.5 * 1.5) / 3;
  EXPECT_NEAR(frame["volume_m3"].get<double>() / behind, 1, 0.036);
  EXPECT_EQ(frame["boundary_edges"], 0);
  EXPECT_EQ(frame["euler"], 2);
  EXPECT_TRUE(has(frame["status"], "one depth camera and no silhouettes")) << frame["status"];
  EXPECT_FALSE(has(o.text, "radial")) << o.text;
}

TEST_F(KinectInput, WorkspacesThatHoldNothingAreRefused) {
  write_capture(3);
  expect_refused(reconstruct(""), 1, {"depth.png", "no point of it lies in the workspace", "z -2.3 to -0.3"});
  expect_refused(reconstruct("--workspace=-1,-1,-2,1,1,1"), 2,
                 {"ends at z = 1 m", "expected at most -0.1 m"});
  expect_refused(reconstruct("--workspace=-9,-9,-4,9,9,-0.2"), 2, {"too wide for how near it comes"});
}

}  // namespace
}  // namespace tactus::test
