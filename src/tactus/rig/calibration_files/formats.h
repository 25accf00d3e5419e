#pragma once
/// The rows of the table of calibration formats, and the functions that their readers share. For the files of
/// this folder.
#include <functional>

#include "tactus/rig/calibration_files/calibration_file.h"
#include "tactus/rig/calibration_files/data_node.h"

namespace tactus::calibration {

/// A file as it was found: its text once, and its tree where it has one.
struct Input {
  std::string path;  ///< as asked for: a file or a folder
  std::string text;  ///< of the file; "" for folders
  bool is_folder = false;
  std::optional<DataNode> yaml, json, toml, xml;  ///< the one that the text is, none for other texts
  const DataNode* tree() const {
    for (const auto* node : {&yaml, &json, &toml, &xml}) {
      if (*node) return &**node;
    }
    return nullptr;
  }
};

struct Format {
  const char* name;
  const char* of;    ///< one line for people
  const char* asks;  ///< questions that the file leaves open
  bool (*recognise)(const Input&);
  std::vector<FileCamera> (*read)(const Input&, const CalibrationAnswers&);
  void (*write)(const std::string& path, std::span<const FileCamera>);  ///< nullptr: only read
  /// The file holds the cameras' centres, so they stay where a rounded rotation is made one.
  bool has_centers = false;
};

// One per file of this folder.
extern const Format kAnipose, kAzureKinect, kCaliscope, kColmapBinary, kColmapText, kEasyMocap, kKalibr,
    kMatlab, kMcCalib, kMiddlebury, kMultical, kNerfstudio, kOpenCv, kProjections, kQualisys, kRosCameraInfo,
    kSplatting, kVicon;

/// Metres per unit: the answer. @throws usage Error that asks for it when there is none.
double asked_unit_m(const std::string& file, const char* format, const CalibrationAnswers& answers);
/// Metres per unit that the format itself fixes. @throws usage Error when the answer says otherwise.
double known_unit_m(const std::string& file, const char* format, double unit_m,
                    const CalibrationAnswers& answers);
/// Image size: the file's own, or the answer. @throws usage Error when there is none or they differ.
Vec2i image_size(const std::string& file, const char* format, std::optional<Vec2i> own,
                 const CalibrationAnswers& answers);
void set_size(Camera& camera, Vec2i size_px);

/// Sets fx, fy, cx, cy and skew. @throws Error at `node`: not [fx s cx; 0 fy cy; 0 0 1] with fx, fy > 0.
void set_intrinsics(Camera& camera, const Mat3d& K, const DataNode& node);
/// @throws Error at `node` as make_lens.
Lens read_lens(LensModel model, const DataNode& node);
/// Coefficients whose meaning the file doesn't say: as the answer has it, else brown.
Lens read_unnamed_lens(const DataNode& node, const CalibrationAnswers& answers);
/// A rotation as a 3x3 matrix or as a vector of Rodrigues. @throws Error at `node`.
Mat3d read_rotation(const DataNode& node);
Vec3d read_vector(const DataNode& node);
/// A 4x4 or 3x4 matrix, row by row. @throws Error at `node` when its last row is not 0 0 0 1.
Rigidd read_rigid(const DataNode& node);
/// Inverse of a pose with a rotation of rounded numbers: the centre keeps the digits of the file.
Rigidd inverse_pose(const Rigidd& pose);

/// A camera-to-world pose whose camera looks along -z with +y up (OpenGL, Blender, Qualisys), as
/// world-to-camera.
Rigidd from_opengl_camera_to_world(const Rigidd& T_world_glcam);

/// Whole file or none. @throws Error naming the path.
void write_text(const std::string& path, const std::string& text);
void make_folder(const std::string& path);
/// Text of the OpenCV YAML of one camera.
std::string opencv_text(const FileCamera& camera);
/// Number as text that reads back to the same bits.
std::string exact(double value);
/// "[a, b, c]"
std::string exact_list(std::span<const double> values);
std::vector<double> row_major(const Mat3d& M);
/// @throws usage Error when the camera has a skew, which the format can not say.
void refuse_skew(const char* format, std::span<const FileCamera> cameras);
/// @throws usage Error when the camera's lens is neither brown nor fisheye, which the format can not say.
void refuse_sphere_lens(const char* format, std::span<const FileCamera> cameras);

}  // namespace tactus::calibration
