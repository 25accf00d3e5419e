/// Readers and writers of calibrations, held against a rig that write_calibrations.py writes in every format.
#include "tactus/rig/calibration_files/calibration_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "support/data_folder.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/rig/background/background_model.h"
#include "tactus/rig/rig_keys.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::message_of;

/// A line of the script's manifest.
struct Written {
  std::string format, file, camera, points, unit_m, size, lens;
  CalibrationAnswers answers() const {
    CalibrationAnswers a;
    if (unit_m != "-") a.unit_m = std::stod(unit_m);
    if (size != "-") a.image_size_px = Vec2i{1280, 720};
    if (lens == "fisheye") a.lens = LensModel::fisheye;
    return a;
  }
};

class CalibrationFiles : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = fs::temp_directory_path() / ("tactus_calibrations_" + std::to_string(getpid()));
    const std::string command =
        "python3 '" + source_path("tests/rig/write_calibrations.py") + "' '" + folder().string() + "'";
    if (std::system(command.c_str()) != 0) return;
    std::ifstream in(folder() / "manifest.txt");
    std::string line;
    while (std::getline(in, line)) {
      std::istringstream words(line);
      Written w;
      words >> w.format >> w.file >> w.camera >> w.points >> w.unit_m >> w.size >> w.lens;
      manifest().push_back(w);
    }
  }
  static void TearDownTestSuite() { fs::remove_all(folder()); }
  void SetUp() override { ASSERT_GT(manifest().size(), 100U) << "python3 is needed"; }

  static fs::path& folder() {
    static fs::path path;
    return path;
  }
  static std::vector<Written>& manifest() {
    static std::vector<Written> list;
    return list;
  }
  static std::string path(const std::string& name) { return (folder() / name).string(); }

  /// Largest distance from where the script saw the 1,000 points [px].
  static double worst_px(const CalibratedCamera& camera, const std::string& points) {
    std::ifstream in(folder() / points);
    double worst = 0, x = 0, y = 0, z = 0, u = 0, v = 0;
    int count = 0;
    for (; in >> x >> y >> z >> u >> v; ++count) {
      const Pixel seen = project(camera, {x, y, z});
      worst = std::max(worst, std::hypot(seen.u_px - u, seen.v_px - v));
    }
    EXPECT_GT(count, 900);
    return worst;
  }
  /// One file of each format, and what it is asked with.
  static std::map<std::string, Written> one_of_each() {
    std::map<std::string, Written> files;
    for (const Written& w : manifest()) files.emplace(w.format, w);
    return files;
  }
};

TEST_F(CalibrationFiles, EveryFormatProjectsWhereAnIndependentWriterDoes) {
  double worst = 0;
  std::set<std::string> formats;
  for (const Written& w : manifest()) {
    const CalibrationData data = read_calibration_file(path(w.file), w.answers());
    EXPECT_EQ(data.format, w.format) << w.file;
    formats.insert(data.format);
    const FileCamera* camera = nullptr;
    for (const FileCamera& c : data.cameras) {
      if (c.calibrated.camera.name == w.camera) camera = &c;
    }
    ASSERT_NE(camera, nullptr) << w.file << " " << w.camera;
    EXPECT_EQ(camera->has_pose, w.format != "ros");
    EXPECT_EQ(camera->calibrated.camera.width_px, 1280);
    EXPECT_EQ(camera->calibrated.camera.height_px, 720);
    const double px = worst_px(camera->calibrated, w.points);
    EXPECT_LT(px, 1e-3) << w.file << " " << w.camera;
    worst = std::max(worst, px);
  }
  RecordProperty("worst_px", std::to_string(worst));
  std::printf("largest distance of %zu cameras: %.2g px\n", manifest().size(), worst);
  // The Azure Kinect's own file is held against its vendor's library in kinect_test.
  EXPECT_EQ(formats.size(), calibration_formats().size() - 1);
}

/// What is written reads back to the same cameras.
TEST_F(CalibrationFiles, WrittenFilesReadBack) {
  for (const std::string source : {"multical.json", "mc_calib.yml"}) {
    CalibrationAnswers answers;
    answers.unit_m = source == "mc_calib.yml" ? 0.01 : 1;
    const CalibrationData data = read_calibration_file(path(source), answers);
    for (const CalibrationFormatInfo& format : calibration_formats()) {
      if (!format.written) continue;
      const std::string file =
          path("converted_" + format.name + source + (format.name == "multical" ? ".json" : ""));
      if (format.name == "kalibr" && source == "multical.json") {
        EXPECT_NE(message_of([&] {
                    write_calibration_file(file, format.name, data.cameras);
                  }).find("hold 4 coefficients"),
                  std::string::npos);
        continue;
      }
      write_calibration_file(file, format.name, data.cameras);
      answers.unit_m = 1;
      if (format.name == "kalibr") answers.unit_m.reset();
      for (const FileCamera& from : data.cameras) {
        const std::string name = from.calibrated.camera.name;
        const bool is_folder = format.name == "opencv";
        const CalibrationData back =
            read_calibration_file(is_folder ? file + "/" + name + ".yaml" : file, answers);
        EXPECT_EQ(back.format, format.name);
        const std::size_t i = static_cast<std::size_t>(&from - data.cameras.data());
        const CalibratedCamera& to =
            is_folder ? back.cameras.at(0).calibrated : back.cameras.at(i).calibrated;
        EXPECT_TRUE(format.name == "kalibr" || to.camera.name == name);
        for (const Vec3d p : {Vec3d{0.1, 0.3, -0.2}, Vec3d{-0.4, 0.9, 0.4}}) {
          // Kalibr's world is the first camera.
          const Vec3d q = format.name == "kalibr" ? data.cameras[0].calibrated.camera.T_cam_world * p : p;
          const Pixel a = project(from.calibrated, p), b = project(to, q);
          EXPECT_NEAR(a.u_px, b.u_px, 1e-9) << format.name;
          EXPECT_NEAR(a.v_px, b.v_px, 1e-9) << format.name;
        }
      }
    }
  }
}

/// Lenses that project onto spheres have one format, and names with folders become files without.
TEST_F(CalibrationFiles, SphereLensesAndFoldersInNames) {
  const CalibrationData data = read_calibration_file(path("camchain_sphere.yaml"));
  ASSERT_EQ(data.cameras.size(), 5U);
  const std::string file = path("sphere_again.yaml");
  write_calibration_file(file, "kalibr", data.cameras);
  const CalibrationData back = read_calibration_file(file);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(back.cameras[i].calibrated.lens, data.cameras[i].calibrated.lens) << i;
    EXPECT_NEAR(back.cameras[i].calibrated.camera.fx_px, data.cameras[i].calibrated.camera.fx_px, 1e-9);
  }
  for (const std::string format : {"opencv", "multical", "colmap", "pose2sim"})
    EXPECT_NE(message_of([&] { write_calibration_file(path("sphere_" + format), format, data.cameras); },
                         ErrorKind::usage)
                  .find("files can't hold the lens 'omni' of camera 'cam0'; write kalibr"),
              std::string::npos)
        << format;
  CalibrationAnswers metres;
  metres.unit_m = 1;
  std::vector<FileCamera> cameras = read_calibration_file(path("multical.json"), metres).cameras;
  cameras.resize(2);
  cameras[0].calibrated.camera.name = "images/left";
  write_calibration_file(path("foldered"), "opencv", cameras);
  EXPECT_EQ(read_calibration_file(path("foldered/images_left.yaml"), metres).cameras.size(), 1U);
  cameras[1].calibrated.camera.name = "images_left";
  EXPECT_NE(message_of([&] { write_calibration_file(path("foldered"), "opencv", cameras); }, ErrorKind::usage)
                .find("another one is written to images_left.yaml already"),
            std::string::npos);
}

TEST_F(CalibrationFiles, LensesWithoutPosesStayBesideTheOthers) {
  CalibrationAnswers answers;
  answers.unit_m = 1;
  answers.image_size_px = Vec2i{1280, 720};
  const CalibrationData data = read_calibration_file(path("easymocap"), answers);
  ASSERT_EQ(data.cameras.size(), 9U);
  EXPECT_TRUE(camera_of(data, "view3", "x").has_pose);
  EXPECT_NE(message_of([&] { camera_of(data, "never_placed", "x"); }).find("has no pose"), std::string::npos);
}

/// Rotations of three decimals: off by up to 5e-4 an entry, so by up to 1.5e-3 rad in all, half that as a
/// rule. Points 2.5 m away at 900 px then move by at most 1.5e-3 * 900 px, and the rows are orthonormal.
TEST_F(CalibrationFiles, RotationsOfThreeDecimalsAreMadeRotations) {
  CalibrationAnswers answers;
  answers.unit_m = 1;
  const CalibrationData exact = read_calibration_file(path("multical.json"), answers);
  std::vector<FileCamera> rounded = exact.cameras;
  const auto round_to = [&](double step) {
    for (std::size_t c = 0; c < rounded.size(); ++c) {
      for (int i = 0; i < 9; ++i)
        rounded[c].calibrated.camera.T_cam_world.R(i / 3, i % 3) =
            step * std::round(exact.cameras[c].calibrated.camera.T_cam_world.R(i / 3, i % 3) / step);
    }
    write_calibration_file(path("rounded.json"), "multical", rounded);
    return read_calibration_file(path("rounded.json"), answers);
  };
  const CalibrationData read = round_to(1e-3);
  for (std::size_t c = 0; c < read.cameras.size(); ++c) {
    const Camera& camera = read.cameras[c].calibrated.camera;
    const Mat3d off = camera.T_cam_world.R * transpose(camera.T_cam_world.R) - Mat3d::identity();
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(off(i / 3, i % 3), 0, 1e-12);
    const Vec3d p{0.1, 0.4, -0.2};
    const Pixel a = project(camera, p), b = project(exact.cameras[c].calibrated.camera, p);
    EXPECT_NEAR(a.u_px, b.u_px, 1.4);
    EXPECT_NEAR(a.v_px, b.v_px, 1.4);
  }
  EXPECT_NE(message_of([&] { round_to(1e-1); }).find("its rotation is not a rotation"), std::string::npos);
}

/// Editors of Windows begin UTF-8 with a mark, which is no part of the text.
TEST_F(CalibrationFiles, ByteOrderMarkIsPassedOver) {
  for (const auto& [format, w] : one_of_each()) {
    const std::string file = path(w.file);
    if (fs::is_directory(file)) continue;
    const CalibrationData without = read_calibration_file(file, w.answers());
    std::ifstream in(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (text.find('\0') != std::string::npos) continue;
    const std::string marked = file + "_marked" + fs::path(file).extension().string();
    std::ofstream(marked, std::ios::binary) << "\xEF\xBB\xBF" << text;
    const CalibrationData with = read_calibration_file(marked, w.answers());
    fs::remove(marked);
    EXPECT_EQ(with.format, format);
    ASSERT_EQ(with.cameras.size(), without.cameras.size()) << format;
    for (std::size_t i = 0; i < with.cameras.size(); ++i) {
      EXPECT_EQ(with.cameras[i].calibrated.camera.fx_px, without.cameras[i].calibrated.camera.fx_px)
          << format;
      EXPECT_EQ(with.cameras[i].calibrated.camera.T_cam_world.t,
                without.cameras[i].calibrated.camera.T_cam_world.t)
          << format;
    }
  }
}

TEST_F(CalibrationFiles, TruncatedFilesGiveOneMessage) {
  for (const auto& [format, w] : one_of_each()) {
    std::string file = w.file;
    if (format == "colmap") file += "/cameras.txt";
    if (format == "colmap-binary") file += "/images.bin";
    if (format == "easymocap") file = "easymocap/extri.yml";
    const std::size_t count = read_calibration_file(path(w.file), w.answers()).cameras.size();
    std::ifstream in(folder() / file, std::ios::binary);
    const std::string whole{std::istreambuf_iterator<char>(in), {}};
    in.close();
    const std::string kept = path("kept");
    fs::rename(folder() / file, kept);
    for (const double part : {0.0, 0.1, 0.37, 0.62, 0.9}) {
      // Within a line: at the end of one, a list of cameras may be a whole one of fewer.
      auto end = static_cast<std::size_t>(part * static_cast<double>(whole.size()));
      while (end > 0 && (whole[end - 1] == '\n' || whole[end] == '\n')) --end;
      std::ofstream(folder() / file, std::ios::binary) << whole.substr(0, end);
      CalibrationData rest;
      const std::string message =
          message_of([&, &w = w] { rest = read_calibration_file(path(w.file), w.answers()); });
      if (message.empty()) {
        // What is missing was not needed: all cameras are there, and right.
        ASSERT_EQ(rest.cameras.size(), count) << file << " " << part;
        EXPECT_LT(worst_px(rest.cameras[0].calibrated, w.points), 1e-3) << file << " " << part;
        continue;
      }
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      EXPECT_NE(message.find(path(w.format == "colmap" || w.format == "colmap-binary" ? w.file : file)),
                std::string::npos)
          << message;
    }
    fs::rename(kept, folder() / file);
  }
}

/// Content tells the format, not the name.
TEST_F(CalibrationFiles, RenamedFilesAreRead) {
  for (const auto& [format, w] : one_of_each()) {
    if (fs::is_directory(folder() / w.file) || format == "easymocap") continue;
    const std::string renamed = path("renamed.dat");
    fs::copy_file(folder() / w.file, renamed, fs::copy_options::overwrite_existing);
    EXPECT_EQ(read_calibration_file(renamed, w.answers()).format, format);
  }
  EXPECT_NE(message_of([] {
              read_calibration_file(path("multicall.json"));
            }).find("no such calibration; did you mean"),
            std::string::npos);
}

TEST_F(CalibrationFiles, OtherFilesAreNoCalibration) {
  const std::pair<const char*, std::string> others[] = {
      {"a.png", std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16)},
      {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"a.txt", "These are no numbers.\n"},
      {"a.json", "{\"name\": \"package\", \"version\": \"1.0\"}"},
      {"a.yaml", "unit_m: 1\ncameras: []\n"},
      {"a.toml", "[package]\nname = \"x\"\n"},
      {"a.xml", "<svg><path d=\"M 0 0\"/></svg>"},
      {"b.json", "{\"frames\": 3}"},
      {"c.json", "[1, 2"},
      {"deep.json", std::string(100000, '[')},
      {"deep.xml",
       [] {
         std::string text;
         for (int i = 0; i < 100000; ++i) text += "<a>";
         return text;
       }()},
      {"blank.yaml", " \n"}};
  for (const auto& [name, text] : others) {
    std::ofstream(folder() / name, std::ios::binary) << text;
    const std::string message = message_of([&, &name = name] { read_calibration_file(path(name)); });
    EXPECT_TRUE(message.starts_with(path(name))) << name << ": " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_LT(message.size(), 700U) << message;
  }
  fs::create_directories(folder() / "empty");
  EXPECT_NE(message_of([] { read_calibration_file(path("empty")); }).find("no calibration of a known format"),
            std::string::npos);
}

/// What a format doesn't say is asked for; what it does say can't be overruled.
TEST_F(CalibrationFiles, AsksForWhatIsNotWritten) {
  const auto message = [](const std::string& file, const CalibrationAnswers& answers = {}) {
    return message_of([&] { read_calibration_file(path(file), answers); }, ErrorKind::usage);
  };
  EXPECT_NE(message("multical.json")
                .find("multical files do not say their unit of length; give --unit-m (1 for metres"),
            std::string::npos);
  EXPECT_NE(message("matrices.txt").find("give --image-size"), std::string::npos);
  CalibrationAnswers metres;
  metres.unit_m = 1;
  EXPECT_NE(message("calib.qca.txt", metres)
                .find("Qualisys files have a unit of 0.001 m, --unit-m says 1; leave it out"),
            std::string::npos);
  metres.image_size_px = Vec2i{640, 480};
  EXPECT_NE(message_of([&] {
              read_calibration_file(path("multical.json"), metres);
            }).find("calibrated for images of 1280x720 pixels, --image-size is 640x480"),
            std::string::npos);
}

/// Distortion has no unit: a file's numbers are the lens's. Of the same XML with whole pixels is told who
/// writes it.
TEST_F(CalibrationFiles, QualisysLensesAreNotDividedBy64) {
  std::ifstream in(path("calib.qca.txt"));
  const std::string text(std::istreambuf_iterator<char>(in), {});
  std::smatch first;
  ASSERT_TRUE(std::regex_search(text, first, std::regex("radialDistortion1=\"([^\"]*)\"")));
  const std::vector<FileCamera> cameras = read_calibration_file(path("calib.qca.txt")).cameras;
  ASSERT_FALSE(cameras.empty());
  EXPECT_EQ(cameras.front().calibrated.lens.k[0], std::stod(first[1]));
  EXPECT_GT(std::abs(std::stod(first[1])), 0.01);  // a lens that a division would hide
  std::ofstream(path("theia.xml")) << std::regex_replace(text, std::regex("sensorMaxU=\"[^\"]*\""),
                                                         "sensorMaxU=\"1344\"");
  const std::string reported = message_of([&] { read_calibration_file(path("theia.xml")); });
  EXPECT_NE(reported.find("whole pixels, as files of Theia do"), std::string::npos) << reported;
}

TEST_F(CalibrationFiles, NamesWhatItCanNotRead) {
  const auto changed = [](const std::string& file, const std::string& from, const std::string& to) {
    std::ifstream in(folder() / file);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    text.replace(text.find(from), from.size(), to);
    std::ofstream(folder() / "changed") << text;
    CalibrationAnswers answers;
    if (!file.starts_with("camchain") && file != "config.toml" && file != "rig.xcp") answers.unit_m = 1;
    return message_of([&] { read_calibration_file(path("changed"), answers); });
  };
  const std::string at = path("changed");
  EXPECT_TRUE(changed("camchain.yaml", "camera_model: pinhole", "camera_model: fov")
                  .starts_with(at + ":2: 'cam0.camera_model': 'fov', expected pinhole, omni, eucm or ds"));
  EXPECT_NE(changed("camchain.yaml", "camera_model: pinhole", "camera_model: ds")
                .find("'cam0.intrinsics': holds 4 numbers, expected 6"),
            std::string::npos);
  EXPECT_NE(changed("camchain_sphere.yaml", "[0.62, 1.1,", "[1.62, 1.1,")
                .find("'cam2.intrinsics': alpha of the lens is 1.62, expected 0 to 1"),
            std::string::npos);
  EXPECT_NE(changed("rig.xcp", "-1.5e-08", "-0.15").find("its radial distortion is no lens"),
            std::string::npos);
  EXPECT_NE(changed("rig.xcp", "Vicon3Parameter", "Other").find("expected Vicon3Parameter and five numbers"),
            std::string::npos);
  EXPECT_EQ(changed("camchain.yaml", "intrinsics:", "intrinsicz:"),
            at + ":1: 'cam0' has no 'intrinsics'; did you mean 'intrinsicz'?");
  EXPECT_NE(changed("config.toml", "0.0, 1.0", "0.0, nan")
                .find("'cam_0.matrix[2][2]': 'nan', expected a finite number"),
            std::string::npos);
  EXPECT_NE(changed("multical.json", "\"dist\": [[", "\"dist\": [[1,")
                .find("'cameras.view0.dist': a lens 'brown' with 6"),
            std::string::npos);
  EXPECT_NE(
      changed("multical.json", "\"R\": [[", "\"R\": [[9,").find("'camera_poses.view0.R': holds 10 numbers"),
      std::string::npos);
  EXPECT_NE(changed("multical.json", "\"R\": [[", "\"R\": [[9").find("its rotation is not a rotation"),
            std::string::npos);
}

TEST(CalibrationData, BothTomlsOfCharucoAgree) {
  const std::string folder = data_folder() + "/charuco_4cam/tests/sessions/post_optimization";
  if (!fs::is_directory(folder)) GTEST_SKIP() << "no charuco_4cam: set TACTUS_DATA";
  const CalibrationData a = read_calibration_file(folder + "/config.toml"),
                        b = read_calibration_file(folder + "/camera_array.toml");
  ASSERT_EQ(a.cameras.size(), 4U);
  ASSERT_EQ(b.cameras.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const CalibratedCamera &p = a.cameras[i].calibrated, &q = b.cameras[i].calibrated;
    EXPECT_EQ(p.camera.name, q.camera.name);
    for (int k = 0; k < 9; ++k) {
      EXPECT_NEAR(p.camera.T_cam_world.R(k / 3, k % 3), q.camera.T_cam_world.R(k / 3, k % 3), 1e-9);
      EXPECT_NEAR(p.camera.intrinsics()(k / 3, k % 3), q.camera.intrinsics()(k / 3, k % 3), 1e-9);
    }
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(p.camera.T_cam_world.t[k], q.camera.T_cam_world.t[k], 1e-9);
    for (std::size_t k = 0; k < 14; ++k) EXPECT_NEAR(p.lens.k[k], q.lens.k[k], 1e-9);
  }
}

TEST(CalibrationData, OpenCvsOwnBoards) {
  const std::string folder = data_folder() + "/opencv_boards";
  if (!fs::is_directory(folder)) GTEST_SKIP() << "no opencv_boards: set TACTUS_DATA";
  const CalibrationData left = read_calibration_file(folder + "/left_intrinsics.yml");
  EXPECT_FALSE(left.cameras.at(0).has_pose);
  EXPECT_NEAR(left.cameras[0].calibrated.camera.fx_px, 535.91573396163199, 1e-12);
  CalibrationAnswers answers;
  answers.image_size_px = Vec2i{640, 480};
  EXPECT_EQ(read_calibration_file(folder + "/intrinsics.yml", answers).cameras.size(), 2U);
}

TEST(RigReference, DefaultsOfTheBackgroundAreThoseOfTheCode) {
  const BackgroundOptions o;
  const std::map<std::string, double> numbers{
      {"chroma", o.chroma},           {"darkest_shadow", o.darkest_shadow},
      {"brightest", o.brightest},     {"noise", o.noise},
      {"spread", o.spread},           {"adapt_s", o.adapt_s},
      {"key_degrees", o.key_degrees}, {"open_px", o.open_px},
      {"close_px", o.close_px},       {"largest_hole_px", o.largest_hole_px},
      {"least_part", o.least_part}};
  std::size_t compared = 0;
  for (const RigSection& section : rig_sections()) {
    if (std::string(section.where) != "background") continue;
    for (const RigKey& key : section.keys) {
      const auto found = numbers.find(key.name);
      if (found == numbers.end()) continue;
      EXPECT_EQ(std::atof(key.otherwise + 1), found->second) << key.name;  // after the backtick
      ++compared;
    }
  }
  EXPECT_EQ(compared, numbers.size());
}

TEST(RigReference, IsUpToDate) {
  std::ostringstream reference;
  write_rig_reference(reference);
  const std::string path = source_path("docs/rig.md");
  if (std::getenv("TACTUS_UPDATE_DOCS") != nullptr) std::ofstream(path) << reference.str();
  std::ifstream in(path);
  const std::string file{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(file, reference.str()) << "TACTUS_UPDATE_DOCS=1 calibration_files_test writes docs/rig.md anew";
}

}  // namespace
}  // namespace tactus
