#include "tactus/window/camera_strip.h"

#include <algorithm>
#include <bit>

#include "tactus/window/panel_look.h"

namespace tactus {
namespace {

/// Thumbnails have this many pixels, on large screens, too: they are small there, as well.
constexpr Index kThumb_px = 160;
constexpr float kMost_px = 120, kLeast_px = 68, kGap_px = 4;  ///< at scale 1
constexpr std::size_t kMostRows = 2;
constexpr float kText = 0.8F;  ///< of the panels' height: "missed 0.4 s" is as wide as the least thumbnail

void upload(GlTexture& texture, Vec2i& size_px, const ColorImage& image) {
  if (size_px.x != image.width_px || size_px.y != image.height_px) {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &name);
    texture = GlTexture(name);
    glTextureStorage2D(name, 1, GL_RGB8, image.width_px, image.height_px);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    size_px = {image.width_px, image.height_px};
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(texture.get(), 0, 0, 0, image.width_px, image.height_px, GL_RGB, GL_UNSIGNED_BYTE,
                      image.pixels.data());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
}

/// Ends with dots where it is wider.
std::string fitted(std::string text, float width) {
  if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
  while (!text.empty() && ImGui::CalcTextSize((text + "..").c_str()).x > width) text.pop_back();
  return text + "..";
}

void wrapped(const std::string& text, ImU32 color, float width) {
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

void tooltip(const std::string& text, float width) {
  if (text.empty() || !ImGui::IsItemHovered()) return;
  ImGui::BeginTooltip();
  wrapped(text, IM_COL32_WHITE, width);
  ImGui::EndTooltip();
}

}  // namespace

void CameraStrip::take(std::shared_ptr<const CameraLook> look, const std::vector<ColorImage>& photos) {
  look_ = std::move(look);
  const std::vector<BitMask>& masks = look_->silhouettes;
  if (masks.empty()) return;
  shares_.clear();
  thumbs_.resize(look_->rig->cameras.size());
  for (std::size_t c = 0; c < thumbs_.size() && c < masks.size(); ++c) {
    const Camera& camera = look_->rig->cameras[c];
    shares_.push_back(covered_share(masks[c]));
    upload(thumbs_[c].texture, thumbs_[c].size_px,
           thumbnail(masks[c], c < photos.size() ? photos[c] : ColorImage(),
                     {camera.width_px, camera.height_px}, kThumb_px));
  }
}

void CameraStrip::clear() {
  look_.reset();
  shares_.clear();
  thumbs_.clear();
}

CameraModel CameraStrip::model(const RigCheckup& checkup) const {
  return camera_model(*look_, shares_, checkup.state(), checkup.result().get());
}

void CameraStrip::draw_camera(const CameraModel::Camera& camera, const Thumb& thumb, float width,
                              float scale) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float height =
      width * static_cast<float>(thumb.size_px.y) / static_cast<float>(std::max(thumb.size_px.x, 1));
  ImGui::BeginGroup();
  ImGui::Image(std::bit_cast<ImTextureID>(std::uintptr_t{thumb.texture.get()}), {width, height});
  const bool is_marked = camera.is_missing || !camera.fault.empty();
  if (is_marked)
    ImGui::GetWindowDrawList()->AddRect(at, {at.x + width, at.y + height}, kVermilion, 0, 0, 2 * scale);
  ImGui::TextUnformatted(fitted((camera.fault.empty() ? "" : "! ") + camera.name, width).c_str());
  ImGui::PushStyleColor(ImGuiCol_Text, camera.is_missing ? kWarning : IM_COL32(190, 196, 204, 255));
  ImGui::TextUnformatted(fitted(camera.state, width).c_str());
  ImGui::PopStyleColor();
  ImGui::Dummy({width, 0});
  ImGui::EndGroup();
  tooltip(camera.name + ": " + camera.state + (camera.fault.empty() ? "" : "; " + camera.fault),
          kPanel_px * scale);
}

void CameraStrip::draw(const CameraModel& model, float scale) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const ImGuiStyle& style = ImGui::GetStyle();
  const float margin = kMargin_px * scale, gap = kGap_px * scale;
  const float space = display.x - 2 * (kPanel_px * scale + 2 * margin) - 2 * style.WindowPadding.x;
  const std::size_t count = std::min(model.cameras.size(), thumbs_.size());
  const auto most = static_cast<std::size_t>(std::max(0.F, (space + gap) / (kLeast_px * scale + gap)));
  if (count == 0 || most == 0) return;
  const std::size_t rows = std::min(kMostRows, (count + most - 1) / most),
                    columns = std::min(most, (count + rows - 1) / rows),
                    shown = std::min(count, rows * columns);
  const auto across = static_cast<float>(columns);
  const float width = std::min(kMost_px * scale, (space + gap) / across - gap);
  ImGui::SetNextWindowPos({0.5F * display.x, display.y - margin}, 0, {0.5F, 1});
  if (ImGui::Begin("cameras", nullptr, kFixed)) {
    ImGui::SetWindowFontScale(kText);
    ImGui::TextDisabled("%s", model.title.c_str());
    // Where not all have a place, those that need a look stand first.
    std::vector<std::size_t> order(count);
    for (std::size_t c = 0; c < count; ++c) order[c] = c;
    if (shown < count)
      std::stable_partition(order.begin(), order.end(), [&](std::size_t c) {
        return model.cameras[c].is_missing || !model.cameras[c].fault.empty();
      });
    for (std::size_t i = 0; i < shown; ++i) {
      if (i % columns != 0) ImGui::SameLine(0, gap);
      draw_camera(model.cameras[order[i]], thumbs_[order[i]], width, scale);
    }
    if (shown < count) ImGui::TextDisabled("and %zu more", count - shown);
    for (const CameraModel::Finding& finding : model.findings) {
      wrapped((finding.is_fault ? "! " : "") + finding.text,
              finding.is_fault ? kWarning : IM_COL32(190, 196, 204, 255),
              std::max(across * (width + gap) - gap, 0.6F * space));
      tooltip(finding.remedy, kPanel_px * scale);
    }
  }
  ImGui::End();
}

void CameraStrip::draw_faults(const CameraModel& model, const ViewCamera& camera, float scale) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  for (const CameraModel::Camera& of : model.cameras) {
    const auto at = of.fault.empty() ? std::nullopt : project(camera, of.at_m, {display.x, display.y});
    if (!at) continue;
    const std::string text = "! " + of.name + ": " + of.fault;
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    const float pad = 3 * scale, half = 0.5F * size.x + pad;
    // Between the panels; one behind them is told in the list alone.
    const float panels = (kPanel_px + 2 * kMargin_px) * scale, low = panels + half, high = display.x - low;
    if (at->x < panels || at->x > display.x - panels || low > high) continue;
    const float x = std::clamp(at->x, low, high) - 0.5F * size.x, y = at->y + 2 * size.y;
    list->AddRectFilled({x - pad, y - pad}, {x + size.x + pad, y + size.y + pad}, IM_COL32(26, 28, 33, 220),
                        3 * scale);
    list->AddText({x, y}, kWarning, text.c_str());
  }
}

}  // namespace tactus
