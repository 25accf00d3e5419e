/// COLMAP's cameras.bin and images.bin: little endian.
#include <cstring>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/calibration_files/colmap.h"

namespace tactus::calibration {
namespace {

bool recognise_colmap_binary(const Input& input) {
  return colmap_folder(input, ".txt").empty() && !colmap_folder(input, ".bin").empty();
}

/// Takes values off a file's bytes.
class Bytes {
 public:
  explicit Bytes(const std::string& file)
      : file_(file), bytes_(read_file(file, kMaxMeshBytes / 4, ReadFrom::regular_file)) {}
  template <class T>
  T take() {
    T value;
    need(sizeof value);
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  /// A count of things of which each takes at least `least` bytes.
  std::uint64_t count(std::uint64_t least, const char* what) {
    const auto n = take<std::uint64_t>();
    if (n > (bytes_.size() - at_) / least)
      throw Error(file_ + ": " + std::to_string(n) + " " + what + " are announced, the file has room for " +
                  std::to_string((bytes_.size() - at_) / least) + "; it is cut short or no COLMAP file");
    return n;
  }
  std::string name() {
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string::npos || end - at_ > 4096) throw Error(file_ + ": a name without an end");
    std::string text = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    return text;
  }
  void skip(std::uint64_t n) {
    need(n);
    at_ += n;
  }
  const std::string& file() const { return file_; }

 private:
  void need(std::uint64_t n) const {
    if (n > bytes_.size() - at_) throw Error(file_ + ": the file is cut short");
  }
  std::string file_, bytes_;
  std::size_t at_ = 0;
};

std::map<std::uint32_t, CalibratedCamera> read_binary_lenses(const std::string& file) {
  Bytes in(file);
  std::map<std::uint32_t, CalibratedCamera> lenses;
  const std::uint64_t count = in.count(24 + 3 * 8, "cameras");
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto id = in.take<std::uint32_t>();
    const auto model_id = in.take<std::int32_t>();
    const auto w = in.take<std::uint64_t>(), h = in.take<std::uint64_t>();
    const std::string where = file + ": camera " + std::to_string(id);
    const ColmapModel* model = colmap_model(model_id);
    if (model == nullptr)
      throw Error(where + ": the camera model " + std::to_string(model_id) + " is not known");
    if (w < 1 || h < 1 || w > 32768 || h > 32768)
      throw Error(where + ": an image of " + std::to_string(w) + "x" + std::to_string(h) + " pixels");
    std::vector<double> p(model->parameters);
    for (double& v : p) v = in.take<double>();
    lenses[id] = colmap_camera(*model, {static_cast<Index>(w), static_cast<Index>(h)}, p, where);
  }
  return lenses;
}

std::vector<ColmapImage> read_binary_images(const std::string& file) {
  Bytes in(file);
  std::vector<ColmapImage> images;
  const std::uint64_t count = in.count(64 + 1 + 8, "images");
  for (std::uint64_t i = 0; i < count; ++i) {
    ColmapImage image{};
    in.take<std::uint32_t>();
    for (double& q : image.q_wxyz) q = in.take<double>();
    for (int k = 0; k < 3; ++k) image.t[k] = in.take<double>();
    image.camera_id = in.take<std::uint32_t>();
    image.name = in.name();
    in.skip(24 * in.count(24, "points"));
    images.push_back(std::move(image));
  }
  return images;
}

std::vector<FileCamera> read_colmap_binary(const Input& input, const CalibrationAnswers& answers) {
  const std::string folder = colmap_folder(input, ".bin");
  return colmap_rig(read_binary_lenses(folder + "/cameras.bin"), read_binary_images(folder + "/images.bin"),
                    input.path, answers);
}

}  // namespace

const Format kColmapBinary{"colmap-binary",
                           "COLMAP cameras.bin and images.bin in a folder",
                           "unit",
                           recognise_colmap_binary,
                           read_colmap_binary,
                           nullptr};

}  // namespace tactus::calibration
