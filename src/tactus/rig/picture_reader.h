#pragma once
/// Pictures of devices, streams and films, one after the other.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace cv {
class Mat;
}

namespace tactus {

/// Source of the trigger at which a camera takes a picture.
enum class PictureTrigger : std::uint8_t {
  none,      ///< itself, so many times a second
  hardware,  ///< a line
  software   ///< `read`
};

struct PictureSettings {
  int width_px = 0, height_px = 0;
  double fps = 30;
  PictureTrigger trigger = PictureTrigger::none;
  bool is_depth = false;  ///< distances, 16 bits each
};

class PictureReader {
 public:
  virtual ~PictureReader() = default;
  /// Waits for the next picture: blue, green, red, 8 bits each; of a depth camera 16 bits a pixel.
  /// @returns false when there is none.
  virtual bool read(cv::Mat& picture) = 0;
  /// Number of the last picture, of a camera that counts its triggers.
  virtual std::optional<std::int64_t> number() const { return {}; }
  /// Whether `read` waits for a camera, and not for a file.
  virtual bool is_device() const = 0;
};

/// /dev/videoN, the URL of a stream, "aravis:ID" (GenICam: serial number, name or address of the camera;
/// none: the first), or a film. @throws Error naming it; also for a trigger that it does not have.
std::unique_ptr<PictureReader> open_pictures(const std::string& what, const PictureSettings& settings);

/// A GenICam camera (GigE Vision, USB3 Vision). @param id without "aravis:"
std::unique_ptr<PictureReader> open_genicam(const std::string& id, const PictureSettings& settings);
/// "", or the missing library and its purpose: "Aravis (libaravis-dev): no GenICam cameras".
std::string genicam_missing();

}  // namespace tactus
