// What users hand over by mistake: exit code, one message that names the thing, and no file left behind.
#include "support/recordings.h"

#include <opencv2/videoio.hpp>

#include <array>
#include <fstream>
#include <limits>
#include <regex>
#include <tuple>

#include "cli/program.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

class BadInput : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (!IsSkipped()) write_calibration(path("camera.yaml"));
  }
  std::string rig(const std::vector<RigCamera>& cameras, const std::string& more = "") const {
    write_rig(path("rig.yaml"), cameras, more);
    return path("rig.yaml");
  }
  std::string reconstruct(const std::string& kind, const std::string& what,
                          const std::string& more = "") const {
    return "reconstruct --source " + kind + " " + what + " --resolution 16 --devices cpu --json " +
           path("out.json") + " --mesh " + path("out.ply") + " " + more;
  }
  /// A square in the middle; 12 of 64 pixels are 0.7 to 0.9 m wide in the workspace of 1 m.
  static void write_square(const std::string& file, int size_px = 12) {
    cv::Mat photo = cv::Mat::zeros(64, 64, CV_8U);
    photo(cv::Rect(32 - size_px / 2, 32 - size_px / 2, size_px, size_px)).setTo(255);
    test::write_image(file, photo);
  }
  /// One mask and one camera; what is wrong with them must be refused in `parts`.
  void expect_mask_refused(const std::vector<std::string>& parts, int code = 1) const {
    expect_refused(reconstruct("masks", rig({{.name = "left", .mask = "m.png"}})), code, parts);
  }
  void expect_video_refused(const std::string& video, const std::vector<std::string>& parts,
                            int code = 1) const {
    write_video(path("room.avi"), Scene::empty_room, 2);
    expect_refused(reconstruct("videos", rig({{.name = "left", .video = video, .empty_room = "room.avi"}})),
                   code, parts);
  }
  void expect_calibration_refused(const Calibration& calibration,
                                  const std::vector<std::string>& parts) const {
    SCOPED_TRACE(parts.front());
    write_picture(path("m.png"), 255);
    write_calibration(path("camera.yaml"), calibration);
    std::vector<std::string> all = parts;
    all.push_back("rig.yaml: camera 'left': " + path("camera.yaml") + ":");
    expect_mask_refused(all);
  }
};

/// A chess board of single pixels cuts the workspace into columns: far more surface than any object has. A
/// capacity that nobody set grows until the mesh is closed; one that somebody set is kept, and nothing open
/// is written.
TEST_F(BadInput, SurfacesThatNeedMoreCapacityAreClosedOrRefused) {
  cv::Mat board(64, 64, CV_8U);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) board.at<std::uint8_t>(y, x) = (x / 2 + y / 2) % 2 == 0 ? 255 : 0;
  }
  ASSERT_TRUE(write_image(path("board.png"), board));
  const std::string what = rig({{.name = "left", .mask = "board.png"}});
  const std::string finer = reconstruct("masks", what, "--verbose") + " --resolution 120";
  const Outcome o = run_tactus(std::regex_replace(finer, std::regex("--resolution 16 "), ""));
  ASSERT_EQ(o.code, 0) << o.text;
  EXPECT_TRUE(has(o.text, "capacity is made, and the frame done again")) << o.text;
  EXPECT_EQ(read_json("out.json")["frames"][0]["boundary_edges"], 0);
  EXPECT_GT(read_json("out.json")["frames"][0]["volume_m3"], 0.1);
  for (const char* name : {"out.json", "out.ply"}) fs::remove(path(name));
  for (const std::string flag : {"--max-vertices", "--max-triangles", "--max-active-bricks"}) {
    expect_refused(reconstruct("masks", what, flag + " 7"), 1,
                   {"frame 0", "capacity for 7: raise " + flag + " to", "would be open and is not written"});
  }
  write("s.yaml",
        "source: {kind: masks, path: rig.yaml}\nreconstruction: {resolution: 16, max_vertices: 7}\n"
        "output: {mesh_every: 1}\n");
  const Outcome run = run_tactus("run " + path("s.yaml") + " --view none --devices cpu --out " + path("out"));
  EXPECT_EQ(run.code, 1) << run.text;
  EXPECT_TRUE(has(run.text, "1 of 1 frames had too little capacity")) << run.text;
  EXPECT_TRUE(has(run.text, "raise reconstruction.max_vertices to")) << run.text;
  EXPECT_FALSE(fs::exists(path("out/s-real-00000.ply")));
}

/// The test's videos have 25 frames a second, and so has the film of a run, whose scene says nothing.
TEST_F(BadInput, FilmsHaveTheRateOfTheRecording) {
  for (const char* name : {"a.avi", "b.avi"}) write_video(path(name), Scene::object, 3);
  write_video(path("room.avi"), Scene::empty_room, 2);
  rig({{.name = "left", .video = "a.avi", .empty_room = "room.avi"},
       {.name = "right", .video = "b.avi", .empty_room = "room.avi"}});
  write("s.yaml",
        "source: {kind: videos, path: rig.yaml}\nreconstruction: {resolution: 16, workspace_m: {min_m: [-2, "
        "-2, -2], max_m: [2, 2, 2]}}\nview: {size_px: [64, "
        "48]}\n");
  const Outcome o = run_tactus("run " + path("s.yaml") + " --devices cpu --out " + path("out"));
  if (o.code == 1 && has(o.text, "OpenGL")) GTEST_SKIP() << "no pictures here: " << o.text;
  ASSERT_EQ(o.code, 0) << o.text;
  EXPECT_NEAR(cv::VideoCapture(path("out/s.mp4"), cv::CAP_FFMPEG).get(cv::CAP_PROP_FPS), 25, 0.01);
}

TEST_F(BadInput, PhotographsThatAreNotThere) {
  write_picture(path("m.png"), 255);
  rig({{.name = "left", .mask = "m.png"}});
  write("s.yaml", "source: {kind: masks, path: rig.yaml}\nview: {photographs: 2}\n");
  for (const std::string view : {"none", "file"})
    expect_refused("run " + path("s.yaml") + " --devices cpu --out " + path(".") + " --view " + view, 2,
                   {"s.yaml: 'view.photographs' is 2, but its source has no photographs for every camera: '",
                    "rig.yaml' needs a 'photo' beside each 'mask'; expected 0 for a surface of clay"});
  write("s.yaml", "source: {kind: masks, path: rig.yaml}\n");
  cv::Mat square = cv::Mat::zeros(64, 64, CV_8U);
  square(cv::Rect(29, 29, 6, 6)) = 255;  // a mask that is all white carves nothing, and a run refuses it
  ASSERT_TRUE(write_image(path("m.png"), square));
  const Outcome clay = run_tactus("run " + path("s.yaml") + " --devices cpu --view none");
  EXPECT_EQ(clay.code, 0) << clay.text;
}

TEST_F(BadInput, MasksThatCantBeUsed) {
  expect_mask_refused({"rig.yaml: camera 'left': m.png: no such file"});
  write_picture(path("mm.png"), 255);
  expect_mask_refused({"m.png: no such file", "did you mean 'mm.png'?"});
  write("m.png", "no picture");
  expect_mask_refused({"camera 'left': " + path("m.png") + ": not an image that can be read"});
  write("m.png", "");
  expect_mask_refused({"camera 'left': " + path("m.png") + ": not an image that can be read"});
  write_picture(path("m.png"), 255);
  truncate_file(path("m.png"), 0.7);
  expect_mask_refused({"camera 'left': " + path("m.png") + ": the image is cut short"});
  write_picture(path("m.png"), 255, {64, 48});
  expect_mask_refused({"camera 'left': " + path("m.png") + ": 64x48 pixels", "image_size_px is 64x64"});
  fs::remove(path("m.png"));
  fs::create_directories(path("m.png"));
  expect_mask_refused({"camera 'left': " + path("m.png") + ": no such image"});
  expect_refused(reconstruct("masks", rig({{.name = "left"}})), 2, {"camera 'left': has no 'mask'"});
  expect_refused("masks " + rig({{.name = "left", .mask = "m.png"}}) + " --alpha --out " + path("out"), 2,
                 {"--alpha", "--source 'masks'", "expected --source videos"});
}

TEST_F(BadInput, VideosThatCantBeUsed) {
  write_video(path("video.avi"), Scene::object, 4);
  expect_video_refused("vdeo.avi",
                       {"rig.yaml: camera 'left': vdeo.avi: no such file", "did you mean 'video.avi'?"});
  write("bad.avi", "no video");
  expect_video_refused("bad.avi", {"camera 'left': " + path("bad.avi") + ": not a video that can be read"});
  write_video(path("cut.mp4"), Scene::object, 50);
  truncate_file(path("cut.mp4"), 0.5);  // the index stands at its end
  expect_video_refused("cut.mp4",
                       {"camera 'left': " + path("cut.mp4") + ": not a video that can be read (cut short"});
  write_video(path("short.avi"), Scene::object, 0);
  expect_video_refused("short.avi", {"camera 'left': " + path("short.avi") + ": "});
  write_video(path("small.avi"), Scene::object, 4, {32, 48});
  expect_video_refused("small.avi",
                       {path("small.avi") + ": the video has 32x48 pixels", "image_size_px is 64x64"});
  expect_video_refused("", {"camera 'left': has no 'video'"}, 2);
  expect_refused(reconstruct("videos", rig({{.name = "left", .video = "video.avi"}})), 2,
                 {"camera 'left': has no 'empty_room'"});
  expect_refused(
      reconstruct("videos", rig({{.name = "left", .video = "video.avi", .empty_room = "bad.avi"}})), 1,
      {"camera 'left': " + path("bad.avi") + ": not a video that can be read"});
}

TEST_F(BadInput, VideosOfDifferentLengthsGoOnToTheShortestAndSaySo) {
  write_video(path("a.avi"), Scene::object, 5);
  write_video(path("b.avi"), Scene::object, 3);
  write_video(path("room.avi"), Scene::empty_room, 2);
  const std::string reported = "the videos differ in length: camera 'b' has 3 frames, camera 'a' has 5";
  const Outcome o = run_tactus(reconstruct("videos",
                                           rig({{.name = "a", .video = "a.avi", .empty_room = "room.avi"},
                                                {.name = "b", .video = "b.avi", .empty_room = "room.avi"}}),
                                           "--workspace=-1,-1,-1,1,1,1"));
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_TRUE(has(o.text, "warning: " + reported)) << o.text;
  const nlohmann::json json = read_json("out.json");
  ASSERT_EQ(json["frames"].size(), 3U);
  EXPECT_TRUE(has(json["frames"][0]["status"], reported)) << json["frames"][0]["status"];
}

TEST_F(BadInput, FramesBeyondARecordingAreRefused) {
  write_video(path("a.avi"), Scene::object, 5);
  write_video(path("room.avi"), Scene::empty_room, 2);
  const std::vector<RigCamera> videos{{.name = "a", .video = "a.avi", .empty_room = "room.avi"}};
  const std::string holds = path("rig.yaml") + ": frames ";
  expect_refused(reconstruct("videos", rig(videos), "--frames 2-99"), 2,
                 {holds + "2-99 are asked for, but the recording holds frames 0-4; 2- is all from there"});
  expect_refused(reconstruct("videos", rig(videos), "--frames 7-"), 2,
                 {holds + "7- are asked for, but the recording holds frames 0-4"});
  expect_refused(reconstruct("videos", rig(videos, "frames: [0, 99]\n")), 2, {holds + "0-99 are asked for"});
  for (const int i : {0, 1}) write_picture(path("m" + std::to_string(i) + ".png"), 255);
  expect_refused(reconstruct("masks", rig({{.name = "a", .mask = "'m%d.png'"}}), "--frames 0-2"), 2,
                 {holds + "0-2 are asked for, but the recording holds frames 0-1; 0- is all from there"});
  expect_refused(reconstruct("masks", rig({{.name = "a", .mask = "m0.png"}}), "--frames 0-2"), 2,
                 {holds + "0-2 are asked for, but the recording holds one frame, number 0"});
  const Outcome inside = run_tactus(reconstruct("videos", rig(videos), "--frames 2-4"));
  EXPECT_EQ(inside.code, 0) << inside.text;
  EXPECT_EQ(read_json("out.json")["frames"].size(), 3U);
}

TEST_F(BadInput, CalibrationsThatAreNone) {
  write_picture(path("m.png"), 255);
  expect_refused(reconstruct("masks", rig({{.name = "left", .mask = "m.png", .calibration = ""}})), 2,
                 {"rig.yaml:5: 'calibration': camera 'left' has none; expected the path of a calibration"});
  expect_refused(reconstruct("masks", rig({{.name = "left", .mask = "m.png", .calibration = "camara.yaml"}})),
                 1, {"camera 'left': camara.yaml: no such file", "did you mean 'camera.yaml'?"});
  write("camera.yaml", "this is no calibration");
  expect_mask_refused({"camera 'left': " + path("camera.yaml") + ": no calibration of a known format"});
  write("camera.yaml", "");
  expect_mask_refused({"camera 'left': " + path("camera.yaml") + ":"});
  write_calibration(path("camera.yaml"));
  truncate_file(path("camera.yaml"), 0.5);
  expect_mask_refused({"camera 'left': " + path("camera.yaml") + ":"});
  expect_calibration_refused({.intrinsics_node = "CameraMatrx"},
                             {"no 'CameraMatrix'; did you mean 'CameraMatrx'?"});
}

TEST_F(BadInput, CalibrationsOfNoCamera) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto matrix = [](std::array<double, 9> v) { return cv::Mat(3, 3, CV_64F, v.data()).clone(); };
  const std::string K = "'CameraMatrix': is [",
                    expected = "expected [fx s cx; 0 fy cy; 0 0 1] with focal lengths";
  expect_calibration_refused({.K = matrix({60, 0, nan, 0, 60, 32, 0, 0, 1})},
                             {"'CameraMatrix.data[2]': '.Nan', expected a finite number"});
  expect_calibration_refused({.K = matrix({60, 0, 32, 0, 60, 32, 0, 0, 0})},
                             {K + "60 0 32; 0 60 32; 0 0 0]", expected});
  expect_calibration_refused({.K = matrix({0, 0, 32, 0, 60, 32, 0, 0, 1})},
                             {K + "0 0 32; 0 60 32; 0 0 1]", expected});
  expect_calibration_refused({.K = matrix({60, 0, 32, 0, -60, 32, 0, 0, 1})}, {K, "0 -60 32", expected});
  expect_calibration_refused({.K = matrix({60, 0, 32, 60, 0, 32, 0, 0, 1})}, {K, expected});
  expect_calibration_refused({.K = cv::Mat::eye(2, 2, CV_64F)}, {"'CameraMatrix': is 2x2, expected 3x3"});
  expect_calibration_refused(
      {.distortion = cv::Mat::zeros(3, 1, CV_64F)},
      {"'DistortionCoeffs': a lens 'brown' with 3 coefficients, expected 2, 4, 5, 8, 12 or 14"});
  expect_calibration_refused({.distortion = cv::Mat(5, 1, CV_64F, cv::Scalar(nan))},
                             {"'DistortionCoeffs.data[0]': '.Nan', expected a finite number"});
  expect_calibration_refused({.R = 2 * cv::Mat::eye(3, 3, CV_64F)},
                             {"its rotation is not a rotation", "det R = 8"});
  expect_calibration_refused({.R = cv::Mat::zeros(3, 3, CV_64F)},
                             {"its rotation is not a rotation", "det R = 0"});
  expect_calibration_refused({.R = matrix({1, 0, 0, 0, 1, 0, 0, 0, -1})},
                             {"its rotation is not a rotation", "det R = -1"});
  expect_calibration_refused({.R = cv::Mat::zeros(2, 2, CV_64F)},
                             {"'RotationValues': holds 4 numbers, expected 3 (Rodrigues) or 3x3"});
  expect_calibration_refused({.t = cv::Mat(3, 1, CV_64F, cv::Scalar(nan))},
                             {"'TranslationValues.data[0]': '.Nan', expected a finite number"});
}

TEST_F(BadInput, CalibrationsOfAnotherImageSize) {
  Calibration other;
  other.image_size = {640, 480};
  expect_calibration_refused(other, {"calibrated for images of 640x480 pixels", "'image_size_px' is 64x64"});
  other.image_size = {64, 64};
  write_calibration(path("camera.yaml"), other);
  write_picture(path("m.png"), 255);
  const std::string verb = reconstruct("masks", rig({{.name = "left", .mask = "m.png"}}));
  const Outcome good = run_tactus(verb);
  EXPECT_EQ(good.code, 0);
  EXPECT_FALSE(has(good.text, "principal point"));
  // A cropped picture's principal point may lie outside. The camera looks over the workspace, which lies
  // lower by 71.5 px of 60 at 4 m: in the middle of what was left.
  other.K = (cv::Mat_<double>(3, 3) << 60, 0, 31.5, 0, 60, -40, 0, 0, 1);
  other.t = (cv::Mat_<double>(3, 1) << 0, 71.5 * 4 / 60, 4);
  write_calibration(path("camera.yaml"), other);
  const Outcome cropped = run_tactus(verb);
  EXPECT_EQ(cropped.code, 0);
  EXPECT_TRUE(has(cropped.text,
                  "camera 'left': the principal point (31.5, -40) lies outside the image of 64x64 pixels: "
                  "right for cropped pictures"))
      << cropped.text;
}

TEST_F(BadInput, NoCameras) {
  expect_refused(reconstruct("masks", rig({})), 2,
                 {"rig.yaml:4: 'cameras': no camera, expected at least one"});
  expect_refused(reconstruct("videos", rig({})), 2, {"'cameras': no camera, expected at least one"});
}

/// A folder as the Middlebury sets are, with two photos; `cameras`: what differs.
class BadMiddlebury : public BadInput {
 protected:
  static std::string line(const std::string& photo, const std::string& K = "60 0 32 0 60 32 0 0 1",
                          const std::string& R = "1 0 0 0 1 0 0 0 1") {
    return photo + " " + K + " " + R + " 0 0 4\n";
  }
  std::string set(const std::string& cameras) const {
    fs::create_directories(path("set"));
    write("set/x_par.txt", cameras);
    write("set/README.txt", "The tight bounding box is\n(-0.5 -0.5 -0.5)\n(0.5 0.5 0.5)\n");
    for (const char* name : {"set/a.png", "set/b.png"}) write_square(path(name), 6);
    return path("set");
  }
  void expect_set_refused(const std::string& cameras, const std::vector<std::string>& parts) const {
    expect_refused(reconstruct("middlebury", set(cameras)), 1, parts);
  }
};

TEST_F(BadMiddlebury, Cameras) {
  const Outcome good = run_tactus(reconstruct("middlebury", set("2\n" + line("a.png") + line("b.png"))));
  ASSERT_EQ(good.code, 0) << good.text;
  for (const char* file : {"out.json", "out.ply"}) fs::remove(path(file));
  const std::string par = path("set/x_par.txt");
  expect_set_refused("0\n", {par + ": no camera"});
  expect_set_refused("", {par + ":1: '', expected the number of cameras"});
  expect_set_refused("3\n" + line("a.png") + line("b.png"), {par + ": 3 cameras are announced, 2 are there"});
  expect_set_refused("1\na.png 60 0 32\n",
                     {par + ":2: camera 'a.png': expected a name and 21 finite numbers", "found 3"});
  expect_set_refused("1\n" + line("a.png", "60 0 nan 0 60 32 0 0 1"),
                     {par + ":2: camera 'a.png': ", "found 2"});
  expect_set_refused("1\n" + line("a.png", "60 0 32 0 60 32 0 0 0"),
                     {par + ":2: camera 'a.png': K is not a camera matrix"});
  expect_set_refused("1\n" + line("a.png", "0 0 32 0 60 32 0 0 1"),
                     {par + ":2: camera 'a.png': focal length 0"});
  expect_set_refused("1\n" + line("a.png", "60 0 32 0 60 32 0 0 1", "1 0 0 0 1 0 0 0 2"),
                     {par + ":2: camera 'a.png': its rotation is not a rotation"});
  expect_refused(reconstruct("middlebury", path("sett")), 1,
                 {path("sett") + ": no such folder; did you mean 'set'?"});
  expect_refused(reconstruct("middlebury", path("set"), "--frames 0-3"), 2,
                 {"frames 0-3 are asked for", "holds one frame"});
}

TEST_F(BadMiddlebury, Photos) {
  const std::string two = "2\n" + line("a.png") + line("b.png");
  expect_set_refused("1\n" + line("aa.png"), {path("set/aa.png") + ": no such image; did you mean 'a.png'?"});
  set(two);
  write_picture(path("set/b.png"), 255, {80, 64});
  const std::string again = reconstruct("middlebury", path("set"));
  expect_refused(again, 1,
                 {path("set/b.png") + ": the photo has 80x64 pixels, expected 64x64 like the first"});
  write_picture(path("set/b.png"), 255);
  truncate_file(path("set/b.png"), 0.7);
  expect_refused(again, 1, {path("set/b.png") + ": the image is cut short"});
  set(two);
  write("set/README.txt", "nothing\n");
  expect_refused(again, 1, {"set/README.txt: no bounding box"});
}

TEST_F(BadInput, BlackAndWhiteVideosHaveAStatus) {
  write_video(path("room.avi"), Scene::empty_room, 3);
  write_video(path("white.avi"), Scene::everything, 3);
  // No frame shows anything: the measures are written, and the command fails.
  const auto frame_of = [&](const std::string& a, const std::string& b) {
    const Outcome o =
        run_tactus(reconstruct("videos", rig({{.name = "a", .video = a, .empty_room = "room.avi"},
                                              {.name = "b", .video = b, .empty_room = "room.avi"}})));
    EXPECT_EQ(o.code, 1) << o.text;
    return read_json("out.json")["frames"].at(2);
  };
  const nlohmann::json black = frame_of("room.avi", "room.avi");
  EXPECT_EQ(black["triangles"], 0);
  EXPECT_EQ(black["volume_m3"], 0);
  EXPECT_EQ(black["iou_mean"], 0);
  EXPECT_TRUE(has(black["status"], "camera 'a': the mask is all black; camera 'b': the mask is all black"));
  EXPECT_EQ(frame_of("white.avi", "room.avi")["triangles"], 0);
  // The hull would be the workspace: nothing can be right.
  const Outcome white =
      run_tactus(reconstruct("videos", rig({{.name = "a", .video = "white.avi", .empty_room = "room.avi"},
                                            {.name = "b", .video = "white.avi", .empty_room = "room.avi"}})));
  EXPECT_EQ(white.code, 1) << white.text;
  for (const char* part :
       {"warning: camera 'a': the mask is all white; likewise 'b'\n", "`tactus doctor RIG`"})
    EXPECT_TRUE(has(white.text, part)) << white.text;
}

TEST_F(BadInput, HolesInASequenceOfMasks) {
  for (const char* name : {"a0", "b0", "a1", "a3", "b3"}) write_square(path(std::string(name) + ".png"));
  const Outcome o = run_tactus(reconstruct(
      "masks", rig({{.name = "a", .mask = "'a%d.png'"}, {.name = "b", .mask = "'b%d.png'"}}), "--frames 0-"));
  EXPECT_EQ(o.code, 0) << o.text;
  const nlohmann::json json = read_json("out.json");
  ASSERT_EQ(json["frames"].size(), 3U);
  EXPECT_EQ(json["frames"][1]["tick"], 1);
  EXPECT_TRUE(has(json["frames"][1]["status"], "camera 'b': " + path("b1.png") + ": no such image"))
      << json["frames"][1]["status"];
  EXPECT_EQ(json["frames"][1]["views"].size(), 1U);  // the camera without a mask is not measured
  EXPECT_GT(json["frames"][1]["volume_m3"], 0.6);    // and did not carve: of 0.2^2 (4.5^3 - 3.5^3) / 3 = 0.64
  EXPECT_EQ(json["frames"][2]["tick"], 3);
  ASSERT_EQ(json["bad_frames"].size(), 1U);
  EXPECT_EQ(json["bad_frames"][0]["tick"], 2);
  EXPECT_TRUE(has(json["bad_frames"][0]["status"], "frame 2 is missed by all cameras")) << json["bad_frames"];
  EXPECT_TRUE(has(o.text, "warning: frame 2 is missed by all cameras")) << o.text;
}

TEST_F(BadInput, KinectHoldsOneFrame) {
  fs::create_directories(path("kinect"));
  expect_refused(
      reconstruct("kinect", path("kinect"), "--frames 0-3"), 2,
      {path("kinect") + ": frames 0-3 are asked for, but the recording holds one frame, number 0"});
  expect_refused(reconstruct("kinect", path("kinekt")), 1,
                 {path("kinekt") + ": no such folder; did you mean 'kinect'?"});
}

TEST_F(BadInput, NoUsableFrameAtAllIsAFailure) {
  for (const char* name : {"a0.png", "a1.png"}) write(name, "no picture");
  const std::string rig_file = rig({{.name = "a", .mask = "'a%d.png'"}});
  expect_refused(reconstruct("masks", rig_file, "--frames 0- --quiet"), 1,
                 {"gave no usable frame: frame 1 is missed by all cameras: camera 'a': " + path("a1.png") +
                  ": not an image"});
  const std::string scene =
      write("s.yaml",
            "source: {kind: masks, path: rig.yaml}\nreconstruction: {resolution: 16}\n"
            "bodies:\n  - {name: b, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.1}\n");
  expect_refused("run " + scene + " --devices cpu --view none --quiet --json " + path("out.json"), 1,
                 {"its source gave no usable frame: frame 1 is missed by all cameras", path("a1.png")});
}

TEST_F(BadInput, Resolutions) {
  for (const std::string devices : {"cpu", "cpu:2"}) {
    const std::string sphere =
        "reconstruct sphere --json " + path("out.json") + " --devices " + devices + " --resolution ";
    expect_refused(sphere + "0", 2, {"resolution 0: expected a positive number of voxels"});
    expect_refused(sphere + "-7", 2, {"resolution -7: expected a positive number of voxels"});
    expect_refused(sphere + "2147483647", 2, {"resolution 2147483647: expected", "at most 1048576"});
    for (const char* large : {"100000", "1048576"}) {
      const Outcome o = run_tactus(sphere + large);
      EXPECT_EQ(o.code, 1) << o.text;
      EXPECT_TRUE(std::regex_search(
          o.text, std::regex("error: resolution " + std::string(large) +
                             " would need [0-9.]+ [TP]B on cpu.*, which has [0-9.]+ [GT]B; choose a lower")))
          << o.text;
    }
  }
  for (const char* wrong : {"99999999999999", "1.5", "many"}) {
    const Outcome o = run_tactus(std::string("reconstruct sphere --resolution ") + wrong);
    EXPECT_EQ(o.code, 2) << o.text;
    EXPECT_TRUE(has(o.text, "--resolution") && has(o.text, wrong)) << o.text;
  }
  for (const auto& [value, code, part] :
       {std::tuple{"0", 2, "s.yaml:2"}, {"-7", 2, "s.yaml:2"}, {"1000000", -1, "resolution"}}) {
    const std::string scene =
        write("s.yaml", "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: " +
                            std::string(value) + "}\n");
    const Outcome o = run_tactus("run " + scene + " --devices cpu --view none");
    if (code > 0)
      EXPECT_EQ(o.code, code) << o.text;
    else
      EXPECT_GT(o.code, 0) << o.text;
    EXPECT_TRUE(has(o.text, part) && has(o.text, value)) << o.text;
  }
}

TEST_F(BadInput, DevicesThatAreNotHere) {
  const std::string scene =
      write("s.yaml", "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: 16}\n");
  for (const std::string& verb :
       {std::string("reconstruct sphere"), "run " + scene + " --view none", std::string("bench affine")}) {
    for (const auto& [devices, why] : {std::pair{"gpu", "unknown device"},
                                       {"cpuu", "did you mean 'cpu'?"},
                                       {"cuda:99", "cuda:99"},
                                       {"cpu:x", "'x' is not a number"},
                                       {"cpu:65", "between 1 and 64"}}) {
      expect_refused(
          verb + " --json " + path("out.json") + " --devices " + devices, 2,
          {"devices '" + std::string(devices) + "': ", why, "here are: cpu (", "write cpu, cpu:N, cuda:0"});
    }
  }
}

TEST_F(BadInput, OutputsThatCantBeWritten) {
  const std::string scene =
      write("s.yaml",
            "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: 16}\n"
            "bodies:\n  - {name: b, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.1}\n");
  write("file", "a file where a folder is wanted");
  fs::create_directories(path("folder.json"));
  fs::create_directories(path("folder.ply"));
  const std::string deep = path("no/such/out.json"), below = path("file/out.json");
  for (const std::string& verb : {std::string("reconstruct sphere --devices cpu"),
                                  "run " + scene + " --devices cpu --view none --frames 1",
                                  std::string("bench affine --devices cpu"), std::string("info")}) {
    for (const std::string& target : {deep, below, path("folder.json")})
      expect_refused(verb + " --json " + target, 1, {"can't write '" + target + "': "});
  }
  expect_refused("reconstruct sphere --devices cpu --mesh " + path("folder.ply"), 1,
                 {"can't write '" + path("folder.ply") + "': it is a folder"});
  expect_refused("run " + scene + " --devices cpu --out " + path("file/out"), 1,
                 {"output folder '" + path("file/out") + "': "});
}

}  // namespace
}  // namespace tactus::test
