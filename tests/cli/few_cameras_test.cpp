/// Rigs and masks that strangers bring: labels for masks, one or two cameras, lenses of other images.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <regex>

#include "cli/program.h"
#include "support/recordings.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

class FewCameras : public ProgramTest {
 protected:
  /// A synthetic hand, filmed by so many cameras.
  std::string film(int cameras, const std::string& more = "") {
    const std::string folder = path("film" + std::to_string(cameras));
    const Outcome o = run_tactus("synth hand --frames 1 --depth-cameras 0 --no-colors --cameras " +
                                 std::to_string(cameras) + " --out " + folder + " " + more);
    EXPECT_EQ(o.code, 0) << o.text;
    return folder;
  }
  Outcome reconstruct(const std::string& folder) {
    return run_tactus("reconstruct --source masks " + folder +
                      "/rig.yaml --resolution 64 --devices cpu --json " + path("r.json"));
  }
  /// Each mask becomes what `of` makes of its pixels.
  template <class F>
  void change_masks(const std::string& folder, F&& of) {
    for (const auto& file : fs::directory_iterator(folder + "/masks"))
      ASSERT_TRUE(
          write_image(file.path().string(), of(cv::imread(file.path().string(), cv::IMREAD_UNCHANGED))));
  }
  /// Each camera file's matrix, its first two rows times `by`.
  static void change_lenses(const std::string& folder, double focal, double center) {
    const std::string number = R"(\s*([-+0-9.eE]+)\s*)";
    std::string nine = number;
    for (int i = 1; i < 9; ++i) nine += "," + number;
    const std::regex matrix(R"(data:\s*\[)" + nine + R"(\])");
    for (const auto& file : fs::directory_iterator(folder + "/cameras")) {
      std::ifstream in(file.path());
      std::string text((std::istreambuf_iterator<char>(in)), {});
      std::smatch m;
      ASSERT_TRUE(std::regex_search(text, m, matrix)) << text;
      double k[9];
      for (int i = 0; i < 9; ++i) k[i] = std::stod(m[static_cast<std::size_t>(i) + 1]);
      k[0] *= focal;
      k[4] *= focal;
      k[2] *= center;
      k[5] *= center;
      std::string data = "data: [";
      for (int i = 0; i < 9; ++i) data += (i > 0 ? ", " : "") + std::to_string(k[i]);
      text = std::string(m.prefix()) + data + "]" + std::string(m.suffix());
      std::ofstream(file.path()) << text;
    }
  }
};

int count_of(const std::string& text, const std::string& part) {
  int count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

/// masks_of_0_and_1: 8 and 16 bit, and another label. The hull is that of the same masks in black and white.
TEST_F(FewCameras, LabelsAreForeground) {
  const std::string folder = film(6);
  ASSERT_EQ(reconstruct(folder).code, 0);
  const double volume_m3 = read_json("r.json")["frames"][0]["volume_m3"];
  for (const auto& [label, type] :
       {std::pair{1, CV_8U}, {38, CV_8U}, {1, CV_16U}, {38, CV_16U}, {255, CV_16U}}) {
    change_masks(folder, [&](const cv::Mat& mask) {
      cv::Mat labels;
      cv::Mat(mask > 0).convertTo(labels, type, label / 255.0);
      return labels;
    });
    const Outcome o = reconstruct(folder);
    EXPECT_EQ(o.code, 0) << o.text;
    const std::string reported = "the mask has values 0 and " + std::to_string(label) + "; white is " +
                                 (type == CV_8U ? "255" : "65535") + ": all but 0 is taken as foreground";
    EXPECT_NE(o.text.find(reported), std::string::npos) << o.text;
    EXPECT_EQ(read_json("r.json")["frames"][0]["volume_m3"], volume_m3);
    const Outcome doctor = run_tactus("doctor " + folder + "/rig.yaml");
    EXPECT_EQ(doctor.code, 0);
    // A line for all cameras.
    for (const std::string& text : {o.text, doctor.text}) {
      EXPECT_EQ(count_of(text, reported + "; likewise 'cam1', 'cam2', 'cam3', 'cam4', 'cam5'\n"), 1) << text;
      EXPECT_EQ(count_of(text, reported), 1) << text;
    }
  }
  // Grey values that are neither: no guess.
  change_masks(folder, [](const cv::Mat& mask) {
    cv::Mat noise(mask.size(), CV_8U);
    cv::randu(noise, 0, 100);
    return noise;
  });
  const Outcome o = reconstruct(folder);
  EXPECT_EQ(o.code, 1) << o.text;
  EXPECT_NE(o.text.find("tell no foreground from background; white is 255"), std::string::npos) << o.text;
}

/// A right rig: masks of a black object don't tell of a calibration, whether all or one are. Nor do those
/// that show nothing.
TEST_F(FewCameras, TheDoctorKeepsOddMasksFromTheCalibration) {
  const std::string folder = film(6), doctor = "doctor " + folder + "/rig.yaml";
  const Outcome well = run_tactus(doctor);
  EXPECT_EQ(well.code, 0) << well.text;
  EXPECT_EQ(count_of(well.text, "not checked: the scale"), 1) << well.text;
  int number = 0;
  change_masks(folder, [&](const cv::Mat& mask) { return number++ == 0 ? cv::Mat(255 - mask) : mask; });
  const Outcome one = run_tactus(doctor);
  EXPECT_EQ(count_of(one.text, ": inverted mask"), 1) << one.text;
  EXPECT_EQ(count_of(one.text, "calibrat"), 0) << one.text;
  change_masks(folder, [](const cv::Mat& mask) {
    return mask.at<std::uint8_t>(0, 0) == 0 ? cv::Mat(255 - mask) : mask;
  });
  const Outcome all = run_tactus(doctor);
  EXPECT_EQ(count_of(all.text, "cam0: inverted mask"), 1) << all.text;
  EXPECT_EQ(count_of(all.text, "likewise: cam1, cam2, cam3, cam4, cam5\n"), 1) << all.text;
  EXPECT_EQ(count_of(all.text, "calibrat"), 0) << all.text;
  EXPECT_EQ(all.code, 4);
  change_masks(folder, [](const cv::Mat& mask) { return cv::Mat(0 * mask); });
  const Outcome black = run_tactus(doctor);
  EXPECT_EQ(count_of(black.text, "cam0: the mask is all black"), 1) << black.text;
  EXPECT_EQ(count_of(black.text, "calibrat"), 0) << black.text;
}

/// Lenses that are 5 % too long: silhouettes agree, so it isn't known, and the doctor says by what it could
/// be.
TEST_F(FewCameras, TheDoctorIsUnsureOfLensesThatAreALittleOff) {
  const std::string folder = film(8);
  change_lenses(folder, 1.05, 1);
  const Outcome o = run_tactus("doctor " + folder + "/rig.yaml --distance cam0 cam4 3.2");
  EXPECT_EQ(o.code, 5) << o.text;
  EXPECT_EQ(count_of(o.text, "too long"), 1) << o.text;
  EXPECT_EQ(count_of(o.text, "an object of known size"), 1) << o.text;
}

TEST_F(FewCameras, OneIsNoHull) {
  const std::string folder = film(1);
  const Outcome o = reconstruct(folder);
  EXPECT_NE(o.text.find("one camera bounds nothing along its line of sight: its cone is no hull"),
            std::string::npos)
      << o.text;
  EXPECT_EQ(o.text.find("min_views"), std::string::npos) << o.text;
}

/// two_cameras_iou: they stand opposite, and the IoU is that of a right hull.
TEST_F(FewCameras, TwoBoundBadlyAndSixDoNot) {
  const std::string two = film(2);
  Outcome o = reconstruct(two);
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_GT(read_json("r.json")["frames"][0]["iou_mean"], 0.9);
  for (const char* command : {"reconstruct", "doctor"}) {
    if (command == std::string("doctor")) o = run_tactus("doctor " + two + "/rig.yaml");
    EXPECT_NE(o.text.find("two cameras bound the object badly: the hull reaches "), std::string::npos)
        << o.text;
    EXPECT_EQ(o.text.find("the workspace holds"), std::string::npos) << o.text;
  }
  EXPECT_EQ(o.code, 5) << o.text;
  for (const int enough : {3, 6}) {
    o = reconstruct(film(enough));
    EXPECT_EQ(o.text.find("badly"), std::string::npos) << o.text;
  }
}

/// Lenses of images half as large.
TEST_F(FewCameras, LensesOfOtherImagesAreNamed) {
  const std::string folder = film(8);
  change_lenses(folder, 0.5, 0.5);
  const Outcome o = reconstruct(folder);
  EXPECT_EQ(o.code, 1) << o.text;
  EXPECT_NE(o.text.find("K of half the size"), std::string::npos) << o.text;
}

/// Contact's surface had capacity for 2^21 triangles, less than that of a hull of 512 voxels.
TEST_F(FewCameras, FineHullsHaveCapacity) {
  Outcome o =
      run_tactus("reconstruct hand --resolution 512 --devices cpu --no-depth --json " + path("r.json"));
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_EQ(read_json("r.json")["frames"][0]["boundary_edges"], 0);
  o = run_tactus("reconstruct hand --resolution 20000 --devices cpu");
  EXPECT_EQ(o.code, 1) << o.text;
  EXPECT_NE(o.text.find("resolution 20000 would need"), std::string::npos) << o.text;
}

}  // namespace
}  // namespace tactus::test
