#pragma once
/// Meshes of obstacles that come from no file.
namespace tactus {

/// ObstacleSetting::path of a hook whose bend has a radius of `unit_m`; hook_surface(). No file has this
/// name.
inline constexpr const char* kHookPath = "<hook>";
/// Radius of its rod, of the bend's.
inline constexpr float kHookRod = 0.3F;

}  // namespace tactus
