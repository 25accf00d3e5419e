#pragma once
/// A client's camera: its images are grabbed, classified and undistorted, ready to be sent.
#include <memory>
#include <optional>
#include <string>

#include "tactus/rig/rig_file.h"
#include "tactus/rig/wire/packet.h"

namespace tactus {

class ClientCamera {
 public:
  struct Options {
    std::string device = {};  ///< instead of the rig file's
    bool photos = false;      ///< send photographs, too
    int photo_quality = 85;
    bool alpha = false;  ///< send how much of each pixel the subject covers, too: of devices and films
  };
  virtual ~ClientCamera() = default;
  /// The images of tick `number`, captured now. Devices wait for their next image; recordings give the one of
  /// that number, over and over. @returns why there are none, or "".
  virtual std::string grab(std::int64_t number, CameraImages& images) = 0;
  /// Whether `grab` waits for the camera; otherwise its caller waits for the tick.
  virtual bool has_own_pace() const = 0;
  /// Number of the trigger of the images, of a camera that counts them.
  virtual std::optional<std::int64_t> number() const { return {}; }
};

/// The rig's camera of that name: its `device`, or its recording by the rig file (masks, a film with its
/// empty room, depth images), at most 300 frames of masks or depth images.
/// @throws Error naming rig file and camera; usage Error for a name that is not in the rig.
std::unique_ptr<ClientCamera> open_client_camera(const RigFile& file, const std::string& rig_path,
                                                 const std::string& name,
                                                 const ClientCamera::Options& options);

}  // namespace tactus
