#include "tactus/window/camera_model.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace tactus {
namespace {

constexpr Rgb8 kOutside{38, 42, 48}, kInside{190, 196, 204}, kOutline{230, 159, 0};
/// A photograph is darkened outside of the silhouette.
constexpr int kDarker = 3;

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, share < 0.00995 ? "%.1f %%" : "%.0f %%", 100 * share);
  return text;
}

std::string seconds(double value_s) {
  char text[32];
  std::snprintf(text, sizeof text, value_s < 9.95 ? "%.1f s" : "%.0f s", value_s);
  return text;
}

/// @param skew_ms of the capture, after the first of its set
std::string late(double skew_ms) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f ms late", skew_ms);
  return skew_ms < 0.5 ? "in time" : text;
}

/// The entry of a live camera. @param links FrameSource::links_json, parsed
const nlohmann::json* link_of(const nlohmann::json& links, const std::string& name) {
  const auto cameras = links.find("cameras");
  if (cameras == links.end()) return nullptr;
  for (const nlohmann::json& camera : *cameras)
    if (camera.value("name", "") == name) return &camera;
  return nullptr;
}

void set_state(CameraModel::Camera& camera, double late_s, double share, const nlohmann::json* link) {
  camera.is_missing = true;
  if (late_s < 0)
    camera.state = "no image yet";
  else if (late_s > 0)
    camera.state = "missed " + seconds(late_s);
  else if (share == 0)
    camera.state = "all black";
  else if (share == 1)
    camera.state = "all white";
  else {
    camera.is_missing = false;
    camera.state = link != nullptr ? late(link->value("skew_ms", 0.0)) : "covers " + percent(share);
  }
  if (camera.is_missing && link != nullptr && !link->value("present", true)) camera.state = "no link";
}

std::string cameras_of(const CameraModel& model, const DoctorFinding& finding) {
  if (finding.camera < 0) return "all cameras";
  const auto name = [&](int c) { return model.cameras.at(static_cast<std::size_t>(c)).name; };
  return name(finding.camera) + (finding.other >= 0 ? ", " + name(finding.other) : "");
}

void add_findings(CameraModel& model, const Diagnosis& diagnosis) {
  for (const DoctorFinding& f : diagnosis.findings) {
    model.findings.push_back({cameras_of(model, f) + ": " + f.fault, f.cure, f.is_fault});
    if (!f.is_fault) continue;
    for (const int c : {f.camera, f.other})
      if (c >= 0) model.cameras.at(static_cast<std::size_t>(c)).fault = f.fault;
  }
  if (!model.findings.empty()) return;
  if (diagnosis.verdict == Verdict::well)
    model.findings.push_back({"the doctor finds nothing wrong", diagnosis.why, false});
  else
    model.findings.push_back({"the doctor isn't sure: " + diagnosis.why, diagnosis.help, false});
}

}  // namespace

CameraModel camera_model(const CameraLook& look, const std::vector<double>& shares, RigCheckup::State state,
                         const RigCheckup::Result* checkup) {
  CameraModel model;
  model.title = "cameras, frame " + std::to_string(look.number);
  const nlohmann::json links = nlohmann::json::parse(look.links_json, nullptr, false);
  for (std::size_t c = 0; c < look.rig->cameras.size(); ++c) {
    const Camera& from = look.rig->cameras[c];
    CameraModel::Camera& camera = model.cameras.emplace_back();
    camera.name = from.name;
    camera.at_m = vec_cast<float>(from.center_world());
    set_state(camera, c < look.late_s.size() ? look.late_s[c] : -1, c < shares.size() ? shares[c] : -1,
              links.is_object() ? link_of(links, from.name) : nullptr);
  }
  if (state == RigCheckup::State::waiting)
    model.findings.push_back(
        {"the doctor waits for " + std::to_string(RigCheckup::kSets) + " sets of images", "", false});
  if (state == RigCheckup::State::looking)
    model.findings.push_back({"the doctor looks at the rig ...", "", false});
  if (checkup == nullptr) return model;
  if (checkup->error.empty())
    add_findings(model, checkup->diagnosis);
  else
    model.findings.push_back({"the doctor can't look: " + checkup->error, "", false});
  return model;
}

double covered_share(const BitMask& mask) {
  if (mask.words.empty()) return -1;
  return static_cast<double>(mask.area_px()) / (static_cast<double>(mask.width_px) * mask.height_px);
}

ColorImage thumbnail(const BitMask& mask, const ColorImage& photo, Vec2i size_px, Index width_px) {
  const Index height_px = std::max<Index>(1, width_px * size_px.y / std::max(size_px.x, 1));
  // The place of a sample: two by two in each pixel.
  const auto place = [](Index sample, Index pixels, Index image) {
    return static_cast<Index>((2 * std::int64_t{sample} + 1) * image / (4 * std::int64_t{pixels}));
  };
  Image<std::uint8_t> inside(width_px, height_px);
  if (!mask.words.empty())
    for (Index v = 0; v < 2 * height_px; ++v)
      for (Index u = 0; u < 2 * width_px; ++u)
        if (mask(place(u, width_px, mask.width_px), place(v, height_px, mask.height_px)))
          inside(u / 2, v / 2) = 1;
  ColorImage thumb(width_px, height_px, kOutside);
  for (Index y = 0; y < height_px; ++y) {
    for (Index x = 0; x < width_px; ++x) {
      const bool is_in = inside(x, y) != 0;
      if (!photo.empty()) {
        const Rgb8 p =
            photo(place(2 * x, width_px, photo.width_px), place(2 * y, height_px, photo.height_px));
        const auto shade = [is_in](std::uint8_t value) {
          return static_cast<std::uint8_t>(is_in ? value : value / kDarker);
        };
        thumb(x, y) = {shade(p.r), shade(p.g), shade(p.b)};
      } else if (is_in) {
        thumb(x, y) = kInside;
      }
      const bool at_edge =
          is_in && ((x > 0 && inside(x - 1, y) == 0) || (x + 1 < width_px && inside(x + 1, y) == 0) ||
                    (y > 0 && inside(x, y - 1) == 0) || (y + 1 < height_px && inside(x, y + 1) == 0));
      if (at_edge) thumb(x, y) = kOutline;
    }
  }
  return thumb;
}

}  // namespace tactus
