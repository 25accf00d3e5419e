#include "tactus/window/panels.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "tactus/view/image_files.h"
#include "tactus/window/panel_look.h"

namespace tactus {
namespace {

/// Shorter arrows, of the longest, would be all head.
constexpr float kLeastArrow = 0.15F;
constexpr const char* kFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";

void text(const std::string& line) { ImGui::TextUnformatted(line.c_str()); }

void text_at_right(const std::string& line) {
  const float width = ImGui::CalcTextSize(line.c_str()).x;
  ImGui::SameLine(ImGui::GetWindowWidth() - ImGui::GetStyle().WindowPadding.x - width);
  text(line);
}

/// p50 as a bar, from there to p99 as a thinner one. Both have another colour beyond the budget's mark.
void draw_stage(const PanelModel::Stage& stage, float budget_at, float scale) {
  text(stage.name);
  text_at_right(stage.text);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x, height = 0.4F * ImGui::GetFontSize();
  ImDrawList* list = ImGui::GetWindowDrawList();
  const auto bar = [&](float from, float to, float thickness, ImU32 color) {
    const float y = at.y + 0.5F * height * (1 - thickness);
    list->AddRectFilled({at.x + from * width, y}, {at.x + to * width, y + thickness * height}, color);
  };
  bar(0, 1, 1, kFaint);
  bar(stage.p50, stage.p99, 0.5F, kOrange);
  bar(0, std::max(stage.p50, 2 / width), 1, kBlue);
  if (budget_at >= 0) {
    if (stage.p99 > budget_at) bar(std::max(budget_at, stage.p50), stage.p99, 0.5F, kVermilion);
    if (stage.p50 > budget_at) bar(budget_at, stage.p50, 1, kVermilion);
    const float x = at.x + std::min(budget_at * width, width - scale);
    list->AddRectFilled({x - scale, at.y - scale}, {x + scale, at.y + height + scale}, IM_COL32_WHITE);
  }
  ImGui::Dummy({width, height});
}

void draw_curve(const PanelModel::Curve& curve, float scale) {
  text(curve.name + "  " + curve.now);
  text_at_right(curve.range);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x, height = 2 * ImGui::GetFontSize();
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(at, {at.x + width, at.y + height}, kFaint);
  std::vector<ImVec2> points;
  const auto steps = static_cast<float>(std::max<std::size_t>(curve.heights.size(), 2) - 1);
  for (std::size_t i = 0; i < curve.heights.size(); ++i) {
    const float along = static_cast<float>(i) / steps;
    points.emplace_back(at.x + along * width, at.y + height * (0.95F - 0.9F * curve.heights[i]));
  }
  list->AddPolyline(points.data(), static_cast<int>(points.size()), kBlue, 0, 1.5F * scale);
  ImGui::Dummy({width, height});
}

ImU32 color_of(Vec3f c, float alpha) { return ImGui::ColorConvertFloat4ToU32({c.x, c.y, c.z, alpha}); }

}  // namespace

Panels::Panels(GLFWwindow* window) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // leaves no file behind
  ImGui_ImplGlfw_InitForOpenGL(window, true);
  ImGui_ImplOpenGL3_Init("#version 450 core");
}

Panels::~Panels() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

void Panels::load_font(float scale) {
  ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
  fonts.Clear();
  if (std::filesystem::exists(kFont)) {
    fonts.AddFontFromFileTTF(kFont, std::round(kText_px * scale));
  } else {
    ImFontConfig config;
    config.SizePixels = 13 * std::round(scale);  // a font of pixels
    fonts.AddFontDefault(&config);
  }
  // The backend makes the texture with its shaders, once; another font takes another one.
  ImGui_ImplOpenGL3_DestroyFontsTexture();
  if (scale_ > 0) ImGui_ImplOpenGL3_CreateFontsTexture();
  ImGui::GetStyle() = ImGuiStyle();
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 4;
  style.WindowBorderSize = 0;
  style.FrameRounding = 3;
  style.Colors[ImGuiCol_WindowBg] = {0.10F, 0.11F, 0.13F, 0.86F};
  style.ScaleAllSizes(scale);
}

void Panels::begin(float scale) {
  if (scale != scale_) load_font(scale);
  scale_ = scale;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

void Panels::end() {
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

bool Panels::wants_mouse() const { return ImGui::GetIO().WantCaptureMouse; }
bool Panels::wants_text() const { return ImGui::GetIO().WantTextInput; }

PanelRequests Panels::draw(const PanelModel& model, bool is_paused) {
  PanelRequests requests;
  const float margin = kMargin_px * scale_, width = kPanel_px * scale_;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const ImVec2 low{width, 0}, high{width, size.y - 2 * margin};
  ImGui::SetNextWindowPos({margin, margin});
  ImGui::SetNextWindowSizeConstraints(low, high);
  if (ImGui::Begin("run", nullptr, kFixed)) {
    text(model.state);
    text(model.clock);
    if (!model.kept.empty()) text(model.kept);
    requests.toggle_pause = ImGui::Button(is_paused ? "Go on" : "Pause");
    ImGui::SameLine();
    requests.step = ImGui::Button("One step");
    ImGui::SameLine();
    requests.restart = ImGui::Button("Restart");
    text_at_right("h: help");
    draw_past(model.past, requests);
    if (!model.stages.empty()) {
      ImGui::Separator();
      ImGui::TextDisabled("stages");
      text_at_right("p50 / p99 ms");
      for (const PanelModel::Stage& stage : model.stages)
        draw_stage(stage, stage.is_age ? -1 : model.budget_at, scale_);
      if (!model.budget.empty()) text(model.budget);
    }
  }
  ImGui::End();
  ImGui::SetNextWindowPos({size.x - margin, margin}, 0, {1, 0});
  ImGui::SetNextWindowSizeConstraints(low, high);
  if (!model.curves.empty() && ImGui::Begin("curves", nullptr, kFixed)) {
    for (const PanelModel::Curve& curve : model.curves) draw_curve(curve, scale_);
    if (!model.tool.empty()) text(model.tool);
    if (!model.pull.empty()) text(model.pull);
    if (!model.arrows.empty()) text(model.arrows);
    for (const std::string& notice : model.notices) {
      ImGui::Separator();
      ImGui::PushTextWrapPos(width - ImGui::GetStyle().WindowPadding.x);
      text(notice);
      ImGui::PopTextWrapPos();
    }
  }
  float top_px = margin;
  if (!model.curves.empty()) {
    top_px += ImGui::GetWindowHeight() + margin;
    ImGui::End();
  }
  draw_sliders(model, top_px, requests);
  return requests;
}

void Panels::draw_past(const PanelModel::Past& past, PanelRequests& requests) {
  if (past.text.empty()) return;
  ImGui::Separator();
  text(past.text);
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
  int shown = past.shown;
  if (ImGui::SliderInt("##past", &shown, past.first, past.last, "frame %d")) requests.past_frame = shown;
  if (past.can_go_on_from) requests.again = ImGui::Button("Simulate again");
}

void Panels::draw_sliders(const PanelModel& model, float top_px, PanelRequests& requests) {
  const float margin = kMargin_px * scale_, width = kPanel_px * scale_;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float left_px = size.y - top_px - margin;
  if (model.sliders.empty() || left_px < 6 * ImGui::GetFontSize()) return;
  ImGui::SetNextWindowPos({size.x - margin, top_px}, 0, {1, 0});
  ImGui::SetNextWindowSizeConstraints({width, 0}, {width, left_px});
  if (ImGui::Begin("parameters", nullptr, kFixed & ~ImGuiWindowFlags_NoScrollbar)) {
    for (const PanelModel::Slider& slider : model.sliders) {
      text(slider.label);
      if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", slider.meaning.c_str());
      ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
      double value = slider.value;
      // A percent sign of a unit would be read as a format.
      const std::string format = "%.5g " + (slider.unit == "%" ? "%%" : slider.unit);
      const ImGuiSliderFlags flags =
          slider.is_logarithmic ? ImGuiSliderFlags_Logarithmic : ImGuiSliderFlags_None;
      if (ImGui::SliderScalar(("##" + slider.name).c_str(), ImGuiDataType_Double, &value, &slider.low,
                              &slider.high, format.c_str(), flags)) {
        requests.parameter = slider.name;
        requests.value = value;
      }
    }
  }
  ImGui::End();
}

void Panels::draw_help(const MouseHolds& holds) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5F * size.x, 0.5F * size.y}, 0, {0.5F, 0.5F});
  ImGui::SetNextWindowBgAlpha(0.98F);  // panels are below it in a small window
  if (ImGui::Begin("help", nullptr, kFixed)) {
    for (const HelpLine& line : help_lines(holds)) {
      ImGui::TextUnformatted(line.key);
      ImGui::SameLine(12 * ImGui::GetFontSize());
      ImGui::TextUnformatted(line.action);
    }
  }
  ImGui::End();
}

void Panels::draw_message(const std::string& line) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5F * size.x, 0.5F * size.y}, 0, {0.5F, 0.5F});
  if (ImGui::Begin("message", nullptr, kFixed)) text(line);
  ImGui::End();
}

void Panels::draw_labels(const std::vector<PlacedLabel>& labels) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  for (const PlacedLabel& label : labels) {
    // The same middle as in files, where text is smaller.
    const float middle = static_cast<float>(label.x_px) +
                         0.5F * static_cast<float>(text_width_px(label.text, label.height_px));
    const ImVec2 size = ImGui::CalcTextSize(label.text.c_str());
    list->AddText({middle - 0.5F * size.x, static_cast<float>(label.y_px)}, color_of(label.color, 1),
                  label.text.c_str());
  }
}

void Panels::draw_arrows(const std::vector<ContactArrow>& contacts, const ViewCamera& camera,
                         float longest_m) {
  float longest_N = 0;
  for (const ContactArrow& c : contacts) longest_N = std::max(longest_N, length(c.force_N));
  if (longest_N <= 0) return;
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  for (const ContactArrow& c : contacts) {
    if (length(c.force_N) < kLeastArrow * longest_N) continue;
    // It ends where it pushes: an arrow into the body would be out of sight.
    const auto from = project(camera, c.at_m - (longest_m / longest_N) * c.force_N, {display.x, display.y});
    const auto to = project(camera, c.at_m, {display.x, display.y});
    if (!from || !to) continue;
    const Vec3f way = normalized(Vec3f{to->x - from->x, to->y - from->y, 0}, {0, 1, 0});
    const float head = 5 * scale_;
    const ImVec2 tip{to->x, to->y}, base{to->x - head * way.x, to->y - head * way.y};
    list->AddLine({from->x, from->y}, base, kVermilion, scale_);
    list->AddTriangleFilled(tip, {base.x - 0.5F * head * way.y, base.y + 0.5F * head * way.x},
                            {base.x + 0.5F * head * way.y, base.y - 0.5F * head * way.x}, kVermilion);
  }
}

void Panels::draw_spring(Vec3f from_m, Vec3f to_m, const ViewCamera& camera) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const auto from = project(camera, from_m, {display.x, display.y}),
             to = project(camera, to_m, {display.x, display.y});
  if (!from || !to) return;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  list->AddLine({from->x, from->y}, {to->x, to->y}, kBlue, 2 * scale_);
  list->AddCircleFilled({from->x, from->y}, 4 * scale_, kBlue);
  list->AddCircle({to->x, to->y}, 6 * scale_, kBlue, 0, 2 * scale_);
}

}  // namespace tactus
