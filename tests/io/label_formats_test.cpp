// One ellipsoid, written as each format of label volumes writes it, is the same body at the same place.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "io/io_test_files.h"
#include "support/message_of.h"
#include "tactus/base/byte_io.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/io/labels/label_file.h"
#include "tactus/tissue/surface_nets.h"

namespace tactus {
namespace {

using test::message_of;

constexpr double kPi64 = 3.14159265358979323846;
const Vec3d kCenter_mm{20, -35, 50}, kHalf_mm{15, 11, 8};  // right, front, head
constexpr std::uint8_t kLabel = 7;

/// Where voxels are, in millimetres; all directions are right, front and head.
struct Grid {
  Index dims[3] = {44, 30, 20};
  Vec3d step[3], first;
  std::vector<VoxelLabel> labels;

  /// @param axes unit vectors of the file's axes; the ellipsoid lies in the middle, a little off it.
  explicit Grid(const Mat3d& axes) {
    const double size[3] = {1, 1.25, 1.5};
    first = kCenter_mm + Vec3d{0.3, -0.2, 0.1};
    for (int k = 0; k < 3; ++k) {
      step[k] = size[k] * axes.column(k);
      first = first - (0.5 * (dims[k] - 1)) * step[k];
    }
    for (Index z = 0; z < dims[2]; ++z) {
      for (Index y = 0; y < dims[1]; ++y) {
        for (Index x = 0; x < dims[0]; ++x) {
          const Vec3d p =
              first + double(x) * step[0] + double(y) * step[1] + double(z) * step[2] - kCenter_mm;
          const Vec3d q{p.x / kHalf_mm.x, p.y / kHalf_mm.y, p.z / kHalf_mm.z};
          labels.push_back(dot(q, q) <= 1 ? kLabel : 0);
        }
      }
    }
  }
};

template <class T>
std::string numbers(const std::vector<VoxelLabel>& labels, bool big, double slope = 1, double intercept = 0) {
  std::string bytes;
  for (const VoxelLabel label : labels) {
    const std::size_t at = bytes.size();
    put_bytes(bytes, static_cast<T>((label - intercept) / slope));
    if (big) std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
  }
  return bytes;
}

std::string packed(const std::string& bytes, bool gzip) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, gzip ? 31 : 15, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<unsigned>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<unsigned>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

/// How a NIfTI header says where its voxels are.
enum class Form { sform, qform, none };

/// A header by hand, from the tables of the two standards.
class Nifti {
 public:
  Nifti(const Grid& grid, int version, Form form, std::int16_t type, bool big)
      : bytes_(version == 1 ? 352 : 544, '\0'), first_(version == 1), big_(big) {
    integer(0, version == 1 ? 348 : 540);
    std::memcpy(bytes_.data() + (first_ ? 344 : 4), first_ ? "n+1" : "n+2\0\r\n\032\n", first_ ? 4 : 8);
    dim(0, 3);
    for (int k = 0; k < 3; ++k) dim(k + 1, grid.dims[k]);
    for (int k = 4; k < 8; ++k) dim(k, 1);
    put<std::int16_t>(first_ ? 70 : 12, type);
    for (int k = 0; k < 3; ++k) real(first_ ? 76 : 104, k + 1, length(grid.step[k]));
    first_ ? real(108, 0, 352) : put<std::int64_t>(168, 544);
    first_ ? put<char>(123, 2) : put<std::int32_t>(500, 2);
    if (form == Form::sform) {
      code(first_ ? 254 : 348, 1);
      for (int row = 0; row < 3; ++row) {
        for (int k = 0; k < 3; ++k) real(first_ ? 280 : 400, 4 * row + k, grid.step[k][row]);
        real(first_ ? 280 : 400, 4 * row + 3, grid.first[row]);
      }
    }
    if (form == Form::qform) quaternion(grid);
  }
  void scale(double slope, double intercept) {
    real(first_ ? 112 : 176, 0, slope);
    real(first_ ? 112 : 176, 1, intercept);
  }
  void dim(int i, std::int64_t n) {
    first_ ? put(40 + 2 * static_cast<std::size_t>(i), static_cast<std::int16_t>(n))
           : put(16 + 8 * static_cast<std::size_t>(i), n);
  }
  template <class T>
  void put(std::size_t at, T value) {
    set_bytes(bytes_, at, value);
    if (big_) std::reverse(bytes_.data() + at, bytes_.data() + at + sizeof(T));
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void integer(std::size_t at, std::int32_t value) { put(at, value); }
  void code(std::size_t at, std::int32_t value) {
    first_ ? put(at, static_cast<std::int16_t>(value)) : put(at, value);
  }
  void real(std::size_t at, int i, double value) {
    first_ ? put(at + 4 * static_cast<std::size_t>(i), static_cast<float>(value))
           : put(at + 8 * static_cast<std::size_t>(i), value);
  }
  /// From a rotation of less than 180 degrees; a mirrored third axis stands in pixdim[0].
  void quaternion(const Grid& grid) {
    Vec3d axis[3];
    for (int k = 0; k < 3; ++k) axis[k] = (1 / length(grid.step[k])) * grid.step[k];
    const bool mirrored = dot(cross(axis[0], axis[1]), axis[2]) < 0;
    if (mirrored) axis[2] = -1. * axis[2];
    const double a = 0.5 * std::sqrt(1 + axis[0].x + axis[1].y + axis[2].z);
    ASSERT_GT(a, 0.1);
    code(first_ ? 252 : 344, 1);
    real(first_ ? 76 : 104, 0, mirrored ? -1 : 1);
    const double q[3] = {(axis[1].z - axis[2].y) / (4 * a), (axis[2].x - axis[0].z) / (4 * a),
                         (axis[0].y - axis[1].x) / (4 * a)};
    for (int k = 0; k < 3; ++k) {
      real(first_ ? 256 : 352, k, q[k]);
      real(first_ ? 268 : 376, k, grid.first[k]);
    }
  }
  std::string bytes_;
  bool first_, big_;
};

std::string triple(Vec3d v, const char* open, const char* between, const char* close) {
  char text[128];
  std::snprintf(text, sizeof text, "%s%.17g%s%.17g%s%.17g%s", open, v.x, between, v.y, between, v.z, close);
  return text;
}

/// @param signs of the space's axes, seen from right, front and head
std::string nrrd_header(const Grid& g, const std::string& space, Vec3d signs, const std::string& type,
                        const std::string& more) {
  const auto in_space = [&](Vec3d v) {
    return triple({signs.x * v.x, signs.y * v.y, signs.z * v.z}, "(", ",", ")");
  };
  return "NRRD0005\n# made by hand\ntype: " + type + "\ndimension: 3\nspace: " + space +
         "\nsizes: " + std::to_string(g.dims[0]) + " " + std::to_string(g.dims[1]) + " " +
         std::to_string(g.dims[2]) + "\nspace directions: " + in_space(g.step[0]) + " " +
         in_space(g.step[1]) + " " + in_space(g.step[2]) + "\nspace origin: " + in_space(g.first) +
         "\nSegment0_Name:=liver\n" + more;
}

std::string meta_header(const Grid& g, const std::string& type, const std::string& more) {
  const auto in_lps = [](Vec3d v) { return triple({-v.x, -v.y, v.z}, "", " ", ""); };
  std::string matrix;
  for (const Vec3d s : g.step) matrix += " " + in_lps((1 / length(s)) * s);
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nTransformMatrix =" + matrix +
         "\nOffset = " + in_lps(g.first) + "\nElementSpacing = " +
         triple({length(g.step[0]), length(g.step[1]), length(g.step[2])}, "", " ", "") +
         "\nDimSize = " + std::to_string(g.dims[0]) + " " + std::to_string(g.dims[1]) + " " +
         std::to_string(g.dims[2]) + "\nElementType = " + type + "\n" + more;
}

/// The body of the label has the ellipsoid's volume, extent and place.
void expect_ellipsoid(const LabelVolume& volume, double scale = 1e-3) {
  ASSERT_EQ(volume.labels.size(), 44U * 30U * 20U);
  const TriangleMesh mesh = surface_of_labels(volume, {kLabel}, static_cast<float>(scale));
  EXPECT_TRUE(topology(mesh).closed_manifold());
  const double exact = 4. / 3 * kPi64 * kHalf_mm.x * kHalf_mm.y * kHalf_mm.z * std::pow(scale, 3);
  // The middle between voxel centres that differ lies within h^2 / 8R of the surface: 0.04 mm of 8, three
  // times in the volume; what stairs leave after smoothing is of the same size.
  EXPECT_NEAR(volume_m3(mesh), exact, 0.03 * exact);
  const Box3f box = bounds(mesh);
  for (int k = 0; k < 3; ++k) {
    // A voxel or less at either end, and half of that in the middle.
    EXPECT_NEAR(static_cast<double>(box.center()[k]), scale * kCenter_mm[k], 0.6 * scale) << k;
    EXPECT_NEAR(static_cast<double>(box.extent()[k]), 2 * scale * kHalf_mm[k], 1.6 * scale) << k;
  }
  // A point off the middle is in, its mirror image with respect to the file's axes is not of this label.
  EXPECT_EQ(volume.at(scale * (kCenter_mm + Vec3d{0.9 * kHalf_mm.x, 0, 0})), kLabel);
  EXPECT_EQ(volume.at(scale * (kCenter_mm + Vec3d{0, 0.9 * kHalf_mm.x, 0})), 0);
  EXPECT_EQ(volume.at(scale * kCenter_mm), kLabel);
}

std::vector<Mat3d> orientations() {
  const auto columns = [](Vec3d a, Vec3d b, Vec3d c) { return transpose(Mat3d{{a, b, c}}); };
  return {columns({1, 0, 0}, {0, 1, 0}, {0, 0, 1}),    // RAS
          columns({-1, 0, 0}, {0, 1, 0}, {0, 0, 1}),   // LAS: mirrored
          columns({-1, 0, 0}, {0, -1, 0}, {0, 0, 1}),  // LPS
          columns({0, 1, 0}, {0, 0, 1}, {1, 0, 0}),    // sagittal
          columns({0, 0, -1}, {1, 0, 0}, {0, 1, 0}),   // mirrored
          mat_cast<double>(rotation_matrix(axis_angle(normalized(Vec3f{1, 2, 3}), 0.4F)))};
}

TEST(LabelFormats, NiftiPlacesItsVoxels) {
  const TempFolder folder;
  for (const Mat3d& axes : orientations()) {
    const Grid grid(axes);
    for (const int version : {1, 2}) {
      for (const bool big : {false, true}) {
        SCOPED_TRACE(std::to_string(version) + (big ? ", big" : ""));
        const std::string bytes =
            Nifti(grid, version, Form::sform, 2, big).bytes() + numbers<std::uint8_t>(grid.labels, false);
        expect_ellipsoid(read_label_volume(folder.write("a.nii", bytes)));
        if (big) expect_ellipsoid(read_label_volume(folder.write("a.nii.gz", packed(bytes, true))));
      }
    }
    if (1 + axes(0, 0) + axes(1, 1) + axes(2, 2) < 0.1 && axes(0, 0) < 0) continue;  // half turns
    if (1 + axes(0, 0) + axes(1, 1) - axes(2, 2) < 0.1 && determinant(axes) < 0) continue;
    const std::string bytes =
        Nifti(grid, 1, Form::qform, 2, false).bytes() + numbers<std::uint8_t>(grid.labels, false);
    expect_ellipsoid(read_label_volume(folder.write("q.nii", bytes)));
  }
}

TEST(LabelFormats, NiftiHoldsNumbersOfAllTypes) {
  const TempFolder folder;
  const Grid grid(Mat3d::identity());
  const auto expect = [&](std::int16_t type, auto number) {
    using T = decltype(number);
    for (const bool big : {false, true}) {
      SCOPED_TRACE(type);
      Nifti header(grid, 1, Form::sform, type, big);
      expect_ellipsoid(
          read_label_volume(folder.write("a.nii", header.bytes() + numbers<T>(grid.labels, big))));
      header.scale(0.5, -3);
      const std::string scaled = header.bytes() + numbers<T>(grid.labels, big, 0.5, -3);
      EXPECT_EQ(read_label_volume(folder.write("b.nii", scaled)).labels, grid.labels);
    }
  };
  expect(2, std::uint8_t{});
  expect(256, std::int8_t{});
  expect(512, std::uint16_t{});
  expect(4, std::int16_t{});
  expect(768, std::uint32_t{});
  expect(8, std::int32_t{});
  expect(1280, std::uint64_t{});
  expect(1024, std::int64_t{});
  expect(16, float{});
  expect(64, double{});
}

/// Numbers as TotalSegmentator and FreeSurfer have them, and the largest.
TEST(LabelFormats, LabelsBeyondABytesAreKept) {
  const TempFolder folder;
  Grid grid(Mat3d::identity());
  const VoxelLabel large[] = {117, 256, 1035, 14175, 65535};
  for (std::size_t i = 0; i < grid.labels.size(); i += 97) grid.labels[i] = large[i / 97 % 5];
  const std::string as_u16 =
      Nifti(grid, 1, Form::sform, 512, false).bytes() + numbers<std::uint16_t>(grid.labels, false);
  EXPECT_EQ(read_label_volume(folder.write("a.nii", as_u16)).labels, grid.labels);
  const std::string as_f32 =
      Nifti(grid, 1, Form::sform, 16, true).bytes() + numbers<float>(grid.labels, true);
  EXPECT_EQ(read_label_volume(folder.write("b.nii", as_f32)).labels, grid.labels);
}

TEST(LabelFormats, NrrdPlainPackedAndDetached) {
  const TempFolder folder;
  for (const Mat3d& axes : orientations()) {
    const Grid grid(axes);
    const std::string bytes = numbers<std::uint8_t>(grid.labels, false),
                      big = numbers<std::int16_t>(grid.labels, true);
    const Vec3d lps{-1, -1, 1};
    expect_ellipsoid(read_label_volume(folder.write(
        "a.nrrd",
        nrrd_header(grid, "left-posterior-superior", lps, "unsigned char", "encoding: raw\n\n") + bytes)));
    expect_ellipsoid(read_label_volume(folder.write(
        "b.seg.nrrd", nrrd_header(grid, "RAS", {1, 1, 1}, "short", "endian: big\nencoding: gzip\n\n") +
                          packed(big, true))));
    folder.write("c.raw.gz", packed(bytes, true));
    expect_ellipsoid(read_label_volume(
        folder.write("c.nhdr", nrrd_header(grid, "left-anterior-superior", {-1, 1, 1}, "uint8",
                                           "encoding: gz\ndata file: c.raw.gz\n"))));
    folder.write("d.raw", "two\nlines\nskip" + bytes);
    expect_ellipsoid(read_label_volume(
        folder.write("d.nhdr", nrrd_header(grid, "left-posterior-superior", lps, "uchar",
                                           "encoding: raw\nline skip: 2\nbyte skip: 4\ndatafile: d.raw\n"))));
  }
}

TEST(LabelFormats, MetaImagePlainPackedAndDetached) {
  const TempFolder folder;
  for (const Mat3d& axes : orientations()) {
    const Grid grid(axes);
    const std::string bytes = numbers<std::uint8_t>(grid.labels, false),
                      big = numbers<std::uint16_t>(grid.labels, true);
    expect_ellipsoid(read_label_volume(
        folder.write("a.mha", meta_header(grid, "MET_UCHAR", "ElementDataFile = LOCAL\n") + bytes)));
    const std::string zlib = packed(big, false);
    expect_ellipsoid(read_label_volume(folder.write(
        "b.mha", meta_header(grid, "MET_USHORT",
                             "CompressedData = True\nCompressedDataSize = " + std::to_string(zlib.size()) +
                                 "\nBinaryDataByteOrderMSB = True\nElementDataFile = LOCAL\n") +
                     zlib)));
    folder.write("c.raw", "head" + bytes);
    expect_ellipsoid(read_label_volume(
        folder.write("c.mhd", meta_header(grid, "MET_UCHAR", "HeaderSize = 4\nElementDataFile = c.raw\n"))));
  }
}

TEST(LabelFormats, WithoutAPlaceTheCornerIsTheOrigin) {
  const TempFolder folder;
  const Grid grid(Mat3d::identity());
  const std::string bytes = numbers<std::uint8_t>(grid.labels, false);
  const std::string sizes = "sizes: 44 30 20\n";
  for (const std::string& path :
       {folder.write("a.nii", Nifti(grid, 1, Form::none, 2, false).bytes() + bytes),
        folder.write("a.nrrd", "NRRD0004\ntype: uchar\ndimension: 3\n" + sizes +
                                   "spacings: 1 1.25 1.5\nencoding: raw\n\n" + bytes)}) {
    const LabelVolume volume = read_label_volume(path);
    EXPECT_EQ(volume.dims, (Vec3i{44, 30, 20}));
    EXPECT_EQ(volume.voxel_size_m, (Vec3f{0.001F, 0.00125F, 0.0015F}));
    EXPECT_EQ(volume.origin_m, (Vec3f{}));
    EXPECT_EQ(volume.R_body_volume, Mat3d::identity());
    EXPECT_EQ(volume.labels, grid.labels);
  }
}

TEST(LabelFormats, UnitsOfLength) {
  const TempFolder folder;
  const Grid grid(Mat3d::identity());
  const std::string bytes = numbers<std::uint8_t>(grid.labels, false);
  for (const auto& [code, scale] : {std::pair{1, 1.}, {2, 1e-3}, {3, 1e-6}, {0, 1e-3}}) {
    Nifti header(grid, 1, Form::sform, 2, false);
    header.put<char>(123, static_cast<char>(code));
    expect_ellipsoid(read_label_volume(folder.write("a.nii", header.bytes() + bytes)), scale);
  }
}

class LabelErrors : public testing::Test {
 protected:
  std::string error(const std::string& name, const std::string& bytes) const {
    const std::string path = folder_.write(name, bytes);
    const std::string message = message_of([&] { read_label_volume(path); });
    return message.starts_with(path) ? "FILE" + message.substr(path.size()) : message;
  }
  std::string nrrd(const std::string& from = "", const std::string& to = "") const {
    std::string text =
        nrrd_header(grid_, "left-posterior-superior", {-1, -1, 1}, "uchar", "encoding: raw\n\n");
    if (!from.empty()) text.replace(text.find(from), from.size(), to);
    return text + bytes_;
  }
  std::string meta(const std::string& from = "", const std::string& to = "") const {
    std::string text = meta_header(grid_, "MET_UCHAR", "ElementDataFile = LOCAL\n");
    if (!from.empty()) text.replace(text.find(from), from.size(), to);
    return text + bytes_;
  }
  TempFolder folder_;
  const Grid grid_{Mat3d::identity()};
  const std::string bytes_ = numbers<std::uint8_t>(grid_.labels, false);
};

TEST_F(LabelErrors, Nifti) {
  const auto with = [&](auto&& change) {
    Nifti header(grid_, 1, Form::sform, 2, false);
    change(header);
    return header.bytes() + bytes_;
  };
  EXPECT_EQ(error("a.nii", with([](Nifti& h) { h.dim(0, 4), h.dim(4, 3); })),
            "FILE: it has 3 volumes along axis 4 (dim[0]=4), expected one volume of labels");
  EXPECT_EQ(error("a.nii", with([](Nifti& h) { h.dim(0, 4), h.dim(4, 1); })), "");
  EXPECT_EQ(error("a.nii", with([](Nifti& h) { h.put<std::int16_t>(70, 128); })),
            "FILE: header field datatype=128, expected whole or real numbers, such as 2 (unsigned bytes)");
  EXPECT_EQ(error("a.nii", with([](Nifti& h) { h.dim(2, -5); })),
            "FILE: 44 x -5 x 20 voxels, expected 1 or more along each axis");
  EXPECT_EQ(error("a.nii", with([](Nifti& h) { h.dim(1, 32767), h.dim(2, 32767), h.dim(3, 32767); })),
            "FILE: 32767 x 32767 x 32767 voxels are too many, expected fewer than 2^31");
  EXPECT_EQ(
      error("a.nii", with([](Nifti& h) { h.put<float>(280 + 4, 0.5F); })),
      "FILE: its axes are not at right angles (cosine 0.371391), expected a volume that is moved and turned "
      "only; resample it");
  EXPECT_EQ(error("a.nii", with([](Nifti& h) { h.put<float>(108, 12); })),
            "FILE: header field vox_offset=12, expected 352 or more");
  EXPECT_EQ(error("a.nii", with([](Nifti& h) { h.put<char>(345, 'i'), h.put<char>(344, 'n'); })),
            "FILE: its voxels are in another file (.img), expected one file, .nii or .nii.gz");
  EXPECT_EQ(error("a.nii", with([](Nifti& h) { h.put<char>(344, 0); })),
            "FILE: a header of Analyze 7.5, which says no orientation; expected NIfTI (.nii, .nii.gz)");
  Nifti image(grid_, 1, Form::sform, 4, false);
  EXPECT_EQ(error("a.nii", image.bytes() + numbers<std::int16_t>(grid_.labels, false, 1, 1024)),
            "FILE: voxel (0, 0, 0) holds -1024, expected labels from 0 to 65535: is it an image and no "
            "segmentation?");
  const std::string good = with([](Nifti&) {});
  EXPECT_EQ(error("a.nii", good.substr(0, 400)), "FILE: truncated, it holds 48 of 26400 voxels");
  EXPECT_EQ(error("a.nii", good.substr(0, 40)), "FILE: truncated in its header of 348 bytes");
  std::string gz = packed(good, true);
  gz[gz.size() - 6] = static_cast<char>(gz[gz.size() - 6] ^ 1);  // in the check sum
  EXPECT_EQ(error("a.nii.gz", gz), "FILE: damaged compressed data (incorrect data check)");
}

/// Numbers written out, and words in capitals.
TEST_F(LabelErrors, NrrdAsText) {
  std::string text;
  for (std::size_t i = 0; i < grid_.labels.size(); ++i)
    text += std::to_string(grid_.labels[i]) + (i % 44 == 43 ? "\r\n" : " ");
  for (const std::string encoding : {"ascii", "text", "TXT"}) {
    const std::string header =
        nrrd_header(grid_, "left-posterior-superior", {-1, -1, 1}, "short", "encoding: " + encoding + "\n\n");
    expect_ellipsoid(read_label_volume(folder_.write("a.nrrd", header + text)), 1e-3);
    EXPECT_EQ(error("a.nrrd", header + text.substr(0, 100)), "FILE: truncated, it holds 50 of 26400 voxels");
    EXPECT_EQ(error("a.nrrd", header + "0 0 x 0"),
              "FILE: header field data=x, expected numbers, as its encoding says");
  }
  const std::string header =
      nrrd_header(grid_, "left-posterior-superior", {-1, -1, 1}, "short", "endian: BIG\nencoding: GZIP\n\n");
  expect_ellipsoid(read_label_volume(folder_.write(
                       "a.nrrd", header + packed(numbers<std::int16_t>(grid_.labels, true), true))),
                   1e-3);
}

TEST_F(LabelErrors, Nrrd) {
  EXPECT_EQ(error("a.nrrd", nrrd()), "");
  EXPECT_EQ(error("a.nrrd", nrrd("dimension: 3", "dimension: 4")),
            "FILE: header field dimension=4, expected 3; where segments overlap, 3D Slicer writes a list of "
            "volumes: "
            "export them as a label map");
  EXPECT_EQ(error("a.nrrd", nrrd("encoding: raw", "encoding: bzip2")),
            "FILE: header field encoding=bzip2, expected raw, gzip or ascii");
  EXPECT_EQ(error("a.nrrd", nrrd("type: uchar", "type: block")),
            "FILE: header field type=block, expected whole or real numbers, such as uchar");
  EXPECT_EQ(error("a.nrrd", nrrd("sizes: 44 30", "sizes: 44 x")),
            "FILE: header field sizes=x, expected a number");
  EXPECT_EQ(error("a.nrrd", nrrd("sizes: 44 30", "sizes: 44")),
            "FILE: header field sizes=44 20, expected 3 numbers");
  EXPECT_EQ(error("a.nrrd", nrrd("posterior", "upward")),
            "FILE: header field space=left-upward-superior, expected left-posterior-superior, "
            "right-anterior-superior or left-anterior-superior");
  EXPECT_EQ(error("a.nrrd", nrrd("encoding", "no separator\nencoding")),
            "FILE: header line 'no separator', expected 'field: value'");
  // Only files beside the header are opened.
  for (const std::string name : {"/etc/passwd", "../other.raw", "none.raw", "."}) {
    const std::string message = error("a.nhdr", nrrd("encoding", "data file: " + name + "\nencoding"));
    EXPECT_EQ(message, "FILE: its data are in '" + name +
                           "', expected a regular file in the folder of the header or below");
  }
}

TEST_F(LabelErrors, MetaImage) {
  EXPECT_EQ(error("a.mha", meta()), "");
  EXPECT_EQ(error("a.mha", meta("NDims = 3", "NDims = 4")), "FILE: header field NDims=4, expected 3");
  EXPECT_EQ(error("a.mha", meta("MET_UCHAR", "MET_OTHER")),
            "FILE: header field ElementType=MET_OTHER, expected whole or real numbers, such as MET_UCHAR");
  EXPECT_EQ(error("a.mha", meta("ElementSpacing = ", "ElementSpacing = -")),
            "");  // a negative size only turns an axis round
  EXPECT_EQ(error("a.mha", meta("ElementSpacing", "Nothing")),
            "FILE: the header lacks ElementSpacing, so its voxels have no size");
  EXPECT_EQ(
      error("a.mhd", meta("LOCAL", "/dev/zero")),
      "FILE: its data are in '/dev/zero', expected a regular file in the folder of the header or below");
  EXPECT_EQ(error("a.mhd", meta("LOCAL", "LIST")),
            "FILE: header field ElementDataFile=LIST, expected one file, or LOCAL");
}

TEST_F(LabelErrors, OtherFiles) {
  const std::string expected =
      "FILE: no label volume, expected NIfTI (.nii, .nii.gz), NRRD (.nrrd), MetaImage (.mha, .mhd) or "
      "INRIMAGE-4 "
      "(.inr, .inr.gz)";
  EXPECT_EQ(error("a.nii", ""), "FILE: the file is empty");
  EXPECT_EQ(error("a.tif", "II*"), expected);
  EXPECT_EQ(error("a.dcm", std::string(128, '\0') + "DICM and more"),
            "FILE: a DICOM file, which is not read; a segmentation becomes NIfTI by 'segimage2itkimage "
            "--outputType nii' "
            "(dcmqi) or in 3D Slicer, a series of images by 'dcm2niix'");
  std::filesystem::create_symlink("/dev/zero", folder_.path + "/zero.nii");
  EXPECT_EQ(message_of([&] { read_label_volume(folder_.path + "/zero.nii"); }),
            "can't read '" + folder_.path + "/zero.nii': not a regular file");
}

}  // namespace
}  // namespace tactus
