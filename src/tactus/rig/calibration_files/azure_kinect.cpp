/// Azure Kinect's factory calibration: the depth camera (NFOV unbinned) and the colour camera in a 16:9 mode.
#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/formats.h"
#include "tactus/rig/sources/kinect.h"

namespace tactus::calibration {
namespace {

bool recognise_azure_kinect(const Input& input) {
  return input.json && input.json->has("CalibrationInformation");
}

std::vector<FileCamera> read_azure_kinect(const Input& input, const CalibrationAnswers& answers) {
  known_unit_m(input.path, "Azure Kinect", 1, answers);
  const Vec2i size = image_size(input.path, "Azure Kinect", {}, answers);
  const KinectCalibration k = read_kinect_calibration(input.path, size.x, size.y);
  return {{k.color}, {k.depth}};
}

}  // namespace

const Format kAzureKinect{"azure-kinect",
                          "Azure Kinect factory calibration JSON (color, depth)",
                          "size of the colour images",
                          recognise_azure_kinect,
                          read_azure_kinect,
                          nullptr};

}  // namespace tactus::calibration
