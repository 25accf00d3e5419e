#include "fuzz/readers.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/io/labels/label_file.h"
#include "tactus/io/mesh/mesh_file.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/calibration_files/calibration_file.h"
#include "tactus/rig/images/camera_file.h"
#include "tactus/rig/images/image_reading.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/sources/kinect.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/rig/wire/photo_coder.h"
#include "tactus/rig/wire/recording_file.h"
#include "tactus/rig/wire/rig_bytes.h"
#include "tactus/web/client_message.h"

namespace tactus::fuzz {
namespace {

namespace fs = std::filesystem;

/// A file in memory for readers that want a path.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& bytes) : fd_(::memfd_create("input", MFD_CLOEXEC)) {
    if (fd_ < 0 || ::write(fd_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
      std::abort();
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(fd_); }
  std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

/// An empty folder with one good calibration, that the rig files of the inputs can name.
const std::string& rig_folder() {
  static const std::string folder = [] {
    std::string name = (fs::temp_directory_path() / "tactus-fuzz-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    write_file(
        name + "/camera.yaml",
        "%YAML:1.0\n---\nCameraMatrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
        "   data: [ 60., 0., 32., 0., 60., 32., 0., 0., 1. ]\n"
        "DistortionCoeffs: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n   data: [ 0., 0., 0., 0. ]\n"
        "RotationValues: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 0., 0. ]\n"
        "TranslationValues: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 0., 4. ]\n");
    static const std::string kept = name;
    std::atexit([] { fs::remove_all(kept); });
    return name;
  }();
  return folder;
}

/// Two small cameras, and one that measures depth.
Rig small_rig() {
  SyntheticRigOptions options;
  options.camera_count = 2;
  options.width_px = 70;
  options.height_px = 20;
  options.depth_width_px = options.depth_height_px = 12;
  return make_synthetic_rig(options);
}

/// A file whose cameras, or whose one set, are these bytes.
std::string recording_of(RecordingChunk kind, const std::string& bytes) {
  if (kind == RecordingChunk::rig) return recording_start() + recording_chunk(kind, bytes);
  std::string rig;
  put_bytes(rig, 30.0);
  put_rig(small_rig(), rig);
  return recording_start() + recording_chunk(RecordingChunk::rig, rig) + recording_chunk(kind, bytes);
}

void read_recording(const std::string& path) {
  RecordingReader reader(path);
  FrameSet frame;
  std::string status;
  for (int i = 0; i < reader.count(); ++i) reader.read(i, {}, frame, status);
}

/// As a server does, whose cameras have images of 70x20 pixels.
void read_packet(const std::string& bytes) {
  constexpr Vec2i kSize{70, 20};
  PacketHead head;
  if (bytes.size() > packet_limit(kSize) || parse_packet_head(bytes, head) != Refusal::none) return;
  if (head.size_px.x != kSize.x || head.size_px.y != kSize.y) return;
  CameraImages images;
  ColorImage photo;
  if (PacketCoder().unpack(bytes, head, images) && !images.photo_jpeg.empty())
    PhotoCoder().unpack(images, kSize, photo);
}

/// A pose that is taken is finite and rigid, and a pull is near, whatever stood in the message.
void read_viewer(const std::string& bytes) {
  if (const int got = frames_got(bytes); got < 0 || got > 100) std::abort();
  const ClientMessage message = parse_client_message(bytes);
  for (int i = 0; i < 3; ++i) {
    const Vec3d row = message.T_world_obstacle.R.row[i];
    if (!(std::abs(dot(row, row) - 1) < 1e-9) || !(std::abs(message.T_world_obstacle.t[i]) <= 100))
      std::abort();
    if (!(std::abs(message.point_m[i]) <= 100) || !(std::abs(message.target_m[i]) <= 100)) std::abort();
  }
  if (!(message.most_m_s > 0)) std::abort();
}

template <class F>
void expect_answer(F&& read) {
  try {
    read();
  } catch (const Error&) {
  }
}

}  // namespace

Family family_of(std::string_view name) {
  if (name == "mesh") return Family::mesh;
  if (name == "volume") return Family::volume;
  if (name == "scene") return Family::scene;
  if (name == "calibration") return Family::calibration;
  if (name == "checkpoint") return Family::checkpoint;
  if (name == "recording") return Family::recording;
  if (name == "packet") return Family::packet;
  if (name == "viewer") return Family::viewer;
  return Family::image;
}

void read_input(Family family, const std::string& bytes) {
  switch (family) {
    case Family::mesh:
      for (const char* path : {"a.ply", "a.obj", "a.off", "a.stl", "a.gltf", "a.glb"})
        expect_answer([&] { parse_mesh(path, bytes); });
      return;
    case Family::volume: {
      const MemoryFile file(bytes);
      expect_answer([&] { read_label_volume(file.path()); });
      return;
    }
    case Family::scene: {
      expect_answer([&] { parse_scene(bytes, "scenes/a.yaml"); });
      const std::string rig = rig_folder() + "/rig.yaml";
      std::ofstream(rig, std::ios::binary) << bytes;  // write_file would wait for the disk
      expect_answer([&] { read_rig_file(rig); });
      return;
    }
    case Family::calibration: {
      const MemoryFile file(bytes);
      CalibrationAnswers answers;
      answers.unit_m = 1;
      answers.image_size_px = Vec2i{64, 64};
      expect_answer([&] { read_calibration_file(file.path(), answers); });
      expect_answer([&] { read_kinect_calibration(file.path(), 1280, 720); });
      return;
    }
    case Family::checkpoint:
      expect_answer([&] { read_checkpoint(bytes); });
      return;
    case Family::packet:
      read_packet(bytes);
      return;
    case Family::viewer:
      expect_answer([&] { read_viewer(bytes); });
      return;
    case Family::recording: {
      // No fuzzer finds the hashes of what it made: what is no file is taken for a chunk.
      const bool is_file = bytes.starts_with(kRecordingMagic);
      for (const RecordingChunk kind : {RecordingChunk::rig, RecordingChunk::set}) {
        const MemoryFile file(is_file ? bytes : recording_of(kind, bytes));
        expect_answer([&] { read_recording(file.path()); });
      }
      return;
    }
    case Family::image: {
      const MemoryFile file(bytes);
      expect_answer([&] { read_image(file.path(), ReadAs::as_is); });
      expect_answer([&] { read_mask(file.path(), 8, 8); });
      return;
    }
  }
}

}  // namespace tactus::fuzz
