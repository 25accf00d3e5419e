#pragma once
/// Colours and sizes of the window's panels. Internal to window/.
#include <imgui.h>

namespace tactus {

/// Okabe and Ito's: told apart without red and green.
inline constexpr ImU32 kBlue = IM_COL32(86, 180, 233, 255), kOrange = IM_COL32(230, 159, 0, 255);
inline constexpr ImU32 kVermilion = IM_COL32(213, 94, 0, 255), kFaint = IM_COL32(255, 255, 255, 40);
/// Text on a dark panel is lighter than a bar.
inline constexpr ImU32 kWarning = IM_COL32(255, 150, 70, 255);
inline constexpr float kText_px = 15, kPanel_px = 320, kMargin_px = 10;
inline constexpr ImGuiWindowFlags kFixed =
    ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
    ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

}  // namespace tactus
