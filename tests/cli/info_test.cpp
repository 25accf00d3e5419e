// What `tactus info FILE` says of meshes and label volumes.
#include <cstdint>
#include <cstring>

#include "cli/program.h"

namespace tactus::test {
namespace {

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

using InfoFile = ProgramTest;

/// A box of 2 x 3 x 4 cm, its corner at (1, 0, 0) cm, without its top.
TEST_F(InfoFile, Mesh) {
  const std::string corners =
      "v 10 0 0\nv 30 0 0\nv 30 30 0\nv 10 30 0\nv 10 0 40\nv 30 0 40\nv 30 30 40\nv 10 30 40\n";
  const std::string walls = "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  const std::string whole = write("a.obj", corners + walls + "f 5 6 7 8\n"),
                    open = write("b.obj", corners + walls);
  const Outcome o = run_tactus("info " + whole + " --unit-m 0.001 --json " + path("a.json"));
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_TRUE(has(o.text, "8 vertices, 12 triangles")) << o.text;
  EXPECT_TRUE(has(o.text, "(0.01, 0, 0) to (0.03, 0.03, 0.04) m, size 0.02 x 0.03 x 0.04 m")) << o.text;
  const auto json = read_json("a.json");
  EXPECT_EQ(json["kind"], "mesh");
  EXPECT_NEAR(json["volume_m3"].get<double>(), 24e-6, 1e-11);  // floats of 1e-2 m
  EXPECT_NEAR(json["area_m2"].get<double>(), 5.2e-3, 1e-9);
  EXPECT_EQ(json["open_edges"], 0);
  EXPECT_EQ(json["bounds_solid"], true);
  EXPECT_EQ(json["pieces"], 1);
  const Outcome holed = run_tactus("info " + open + " --unit-m 0.001 --json " + path("b.json"));
  EXPECT_EQ(holed.code, 0) << holed.text;
  EXPECT_TRUE(has(holed.text, "of no solid")) << holed.text;
  EXPECT_EQ(read_json("b.json")["open_edges"], 4);
  EXPECT_EQ(read_json("b.json")["bounds_solid"], false);
}

/// A NIfTI of 4x4x4 voxels of 2 mm, whose first is centred at (10, 20, 30) mm: label 14175 in 2x2x2 of them,
/// label 117 in one.
TEST_F(InfoFile, Labels) {
  std::string nifti(352, '\0');
  const auto put = [&](std::size_t at, const auto& value) { std::memcpy(&nifti[at], &value, sizeof value); };
  put(0, std::int32_t{348});
  const std::int16_t dims[] = {3, 4, 4, 4, 1, 1, 1, 1};
  put(40, dims);
  put(70, std::int16_t{8});  // 32-bit integers
  put(108, 352.F);
  put(123, char{2});  // millimetres
  put(254, std::int16_t{1});
  const float rows[] = {2, 0, 0, 10, 0, 2, 0, 20, 0, 0, 2, 30};
  put(280, rows);
  put(344, std::int32_t{0x00312b6e});  // "n+1"
  for (int i = 0; i < 64; ++i) {
    const bool in = i % 4 >= 2 && i / 4 % 4 >= 2 && i / 16 >= 2;
    const std::int32_t label = i == 0 ? 117 : in ? 14175 : 0;
    nifti.append(reinterpret_cast<const char*>(&label), 4);
  }
  const Outcome o = run_tactus("info " + write("a.nii", nifti) + " --json " + path("a.json"));
  EXPECT_EQ(o.code, 0) << o.text;
  const auto json = read_json("a.json");
  EXPECT_EQ(json["kind"], "labels");
  ASSERT_EQ(json["labels"].size(), 2U);
  EXPECT_EQ(json["labels"][0]["label"], 117);
  // Sizes of voxels are floats: three relative errors of 6e-8.
  EXPECT_NEAR(json["labels"][0]["volume_m3"].get<double>(), 8e-9, 2e-15);
  EXPECT_EQ(json["labels"][1]["label"], 14175);
  EXPECT_NEAR(json["labels"][1]["volume_m3"].get<double>(), 64e-9, 2e-14);
  // Voxels 2 and 3 reach from 1 mm before the centre of the third to 1 mm behind that of the fourth.
  const double low_m[] = {0.013, 0.023, 0.033}, high_m[] = {0.017, 0.027, 0.037};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(json["labels"][1]["min_m"][k].get<double>(), low_m[k], 1e-8);
    EXPECT_NEAR(json["labels"][1]["max_m"][k].get<double>(), high_m[k], 1e-8);
  }
  expect_refused("info " + write("b.txt", "no volume"), 1, {"b.txt", "no label volume"});
}

TEST_F(InfoFile, RefusesFlagsThatItWouldNotHeed) {
  for (const char* both : {"--frame a.yaml --json b.json", "--parameters a.yaml --json b.json",
                           "--frame a.yaml --parameters a.yaml", "a.obj --frame a.yaml"}) {
    const Outcome o = run_tactus(std::string("info ") + both);
    EXPECT_EQ(o.code, 2) << both << o.text;
    EXPECT_TRUE(has(o.text, "excludes")) << both << o.text;
  }
}

}  // namespace
}  // namespace tactus::test
