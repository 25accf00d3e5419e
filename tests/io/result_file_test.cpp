/// Label volumes and JSON results.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "io/io_test_files.h"
#include "support/message_of.h"
#include "tactus/base/read_file.h"
#include "tactus/base/safe_file.h"
#include "tactus/io/json_file.h"
#include "tactus/io/labels/label_file.h"

namespace tactus {
namespace {
namespace fs = std::filesystem;
using test::message_of;

std::string inr_header(std::string fields) {
  fields = "#INRIMAGE-4#{\n" + fields;
  fields.resize(252, '\n');
  return fields + "##}\n";
}
const std::string kFields =
    "XDIM=2\nYDIM=3\nZDIM=1\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 "
    "bits\nSCALE=2**0\nCPU=decm\nVX=0.5\nVY=1\nVZ=2\n";

std::string gzip(const std::string& bytes) {
  const TempFolder folder;
  const std::string path = folder.path + "/a.gz";
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
  return read_file(path, kMaxMeshBytes);
}

TEST(LabelFile, ReadsPlainAndCompressed) {
  const TempFolder folder;
  const std::string bytes = inr_header(kFields) + "abcdef";
  for (const std::string& path : {folder.write("a.inr", bytes), folder.write("a.inr.gz", gzip(bytes))}) {
    const LabelVolume volume = read_label_volume(path);
    EXPECT_EQ(volume.dims, (Vec3i{2, 3, 1}));
    EXPECT_EQ(volume.voxel_size_m, (Vec3f{0.0005F, 0.001F, 0.002F}));
    EXPECT_EQ(volume.labels, (std::vector<VoxelLabel>{'a', 'b', 'c', 'd', 'e', 'f'}));
  }
}

std::string label_error(const std::string& name, const std::string& bytes) {
  const TempFolder folder;
  std::string message = message_of([&] { read_label_volume(folder.write(name, bytes)); });
  if (message.starts_with(folder.path)) message.replace(0, folder.path.size() + 1 + name.size(), "FILE");
  return message;
}

std::string with(const std::string& from, const std::string& to) {
  std::string fields = kFields;
  return inr_header(fields.replace(fields.find(from), from.size(), to)) + "abcdef";
}

TEST(LabelFile, Errors) {
  EXPECT_EQ(message_of([] { read_label_volume("none.inr.gz"); }),
            "can't read 'none.inr.gz': No such file or directory");
  EXPECT_EQ(message_of([] { read_label_volume("."); }), "can't read '.': Is a directory");
  EXPECT_EQ(label_error("a.inr", "P5 2 2"),
            "FILE: no label volume, expected NIfTI (.nii, .nii.gz), NRRD (.nrrd), MetaImage (.mha, .mhd) or "
            "INRIMAGE-4 (.inr, .inr.gz)");
  EXPECT_EQ(label_error("a.inr", std::string("#INRIMAGE-4#{") + std::string(300, '\n')),
            "FILE: the header has no end ('##}')");
  EXPECT_EQ(label_error("a.inr", with("XDIM=2\n", "")), "FILE: the header lacks XDIM");
  EXPECT_EQ(label_error("a.inr", with("XDIM=2", "XDIM=-2")),
            "FILE: header field XDIM=-2, expected a number above 0");
  EXPECT_EQ(label_error("a.inr", with("VX=0.5", "VX=nan")),
            "FILE: header field VX=nan, expected a number above 0");
  EXPECT_EQ(label_error("a.inr", with("8 bits", "16 bits")),
            "FILE: header field PIXSIZE=16 bits, expected 8 bits (labels are one unsigned byte a voxel)");
  EXPECT_EQ(label_error("a.inr", with("XDIM=2\nYDIM=3\nZDIM=1", "XDIM=9999\nYDIM=9999\nZDIM=9999")),
            "FILE: 9999 x 9999 x 9999 voxels are too many, expected fewer than 2^31");
  const std::string good = inr_header(kFields) + "abcdef";
  EXPECT_EQ(label_error("a.inr", good.substr(0, 260)), "FILE: truncated, it holds 4 of 6 voxels");
  // Data that barely compress, so that the cut falls into them.
  std::string noise(6000, ' ');
  std::uint32_t state = 1;
  for (char& c : noise) c = static_cast<char>((state = state * 1664525U + 1013904223U) >> 24);
  std::string large = kFields;
  large.replace(large.find("XDIM=2"), 6, "XDIM=2000");
  std::string packed = gzip(inr_header(large) + noise);
  EXPECT_TRUE(label_error("a.inr.gz", packed.substr(0, 3000)).starts_with("FILE: truncated, it holds "));
  packed[packed.size() - 6] = static_cast<char>(packed[packed.size() - 6] ^ 1);  // in the check sum
  packed[packed.size() / 2] = static_cast<char>(packed[packed.size() / 2] ^ 64);
  EXPECT_TRUE(label_error("a.inr.gz", packed).starts_with("FILE: ")) << label_error("a.inr.gz", packed);
}

TEST(LabelFile, LiverVolume) {
  TACTUS_DATA_OR_SKIP(data);
  const LabelVolume volume = read_label_volume(data + "/meshes/liver.inr.gz");
  EXPECT_EQ(volume.dims, (Vec3i{438, 353, 165}));
  const auto count = std::count(volume.labels.begin(), volume.labels.end(), 255);
  const Vec3d size = vec_cast<double>(volume.voxel_size_m);
  // The known answer has four digits: 0.5 % covers its rounding and that of the voxel sizes in the header.
  EXPECT_NEAR(static_cast<double>(count) * size.x * size.y * size.z, 1605e-6, 0.005 * 1605e-6);
}

TEST(JsonFile, WritesCompletely) {
  const TempFolder folder;
  const std::string path = folder.path + "/a.json";
  const nlohmann::json value = {{"ms", 1.5}, {"bad", std::nan("")}, {"text", "caf\xe9"}};
  write_json_file(path, value);
  const nlohmann::json back = nlohmann::json::parse(read_file(path, kMaxMeshBytes));
  EXPECT_EQ(back["ms"], 1.5);
  EXPECT_TRUE(back["bad"].is_null());
  EXPECT_EQ(back["text"], "caf\xef\xbf\xbd");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace tactus
