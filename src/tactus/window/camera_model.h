#pragma once
/// Text and pictures of a rig's cameras, as plain data: tests read it without a window.
#include "tactus/window/camera_look.h"
#include "tactus/window/rig_checkup.h"

namespace tactus {

struct CameraModel {
  struct Camera {
    std::string name;
    std::string state;  ///< "covers 9 %", "12 ms late", "missed 0.4 s"
    bool is_missing = false;
    std::string fault;  ///< the doctor's; "": none
    Vec3f at_m;         ///< its eye
  };
  struct Finding {
    std::string text;    ///< "cam3: the focal length is 8 % too long"
    std::string remedy;  ///< "": none
    bool is_fault = false;
  };
  std::string title;  ///< "cameras, frame 128"
  std::vector<Camera> cameras;
  std::vector<Finding> findings;  ///< the doctor's verdict where it has none
};

/// @param look may be one without new images: shares of the picture are those of `shares`
/// @param shares of each picture that its silhouette covers, < 0: unknown
CameraModel camera_model(const CameraLook& look, const std::vector<double>& shares, RigCheckup::State state,
                         const RigCheckup::Result* checkup);

/// Share of the picture that the silhouette covers; < 0 where the camera missed the tick.
double covered_share(const BitMask& mask);

/// Small picture of a camera, with the silhouette's outline. A pixel is inside where any of its two by two
/// samples is: tools are thin.
/// @param photo the camera's, or an empty one @param size_px of the camera's images
ColorImage thumbnail(const BitMask& mask, const ColorImage& photo, Vec2i size_px, Index width_px);

}  // namespace tactus
