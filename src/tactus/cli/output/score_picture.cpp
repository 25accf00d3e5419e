#include "tactus/cli/output/score_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tactus/base/safe_file.h"
#include "tactus/cli/output/sheet_colors.h"
#include "tactus/geom/mesh/mesh_creases.h"
#include "tactus/view/image_files.h"
#include "tactus/view/renderer.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

constexpr Index kHeight_px = 900, kScene_px = 1080, kTable_px = 520, kMargin_px = 28;
constexpr std::size_t kColumns = 3;  // strokes in the table

using Strokes = std::vector<StrokeResult>;

/// Green, yellow at the tolerance, red from twice of it on.
Vec3f deviation_color(double off_m, double tolerance_m) {
  constexpr Vec3f kGood{0.10F, 0.55F, 0.22F}, kFair{0.95F, 0.72F, 0.10F}, kBad{0.80F, 0.08F, 0.10F};
  const auto t = static_cast<float>(std::clamp(off_m / tolerance_m, 0.0, 2.0));
  return t < 1 ? (1 - t) * kGood + t * kFair : (2 - t) * kFair + (t - 1) * kBad;
}

Rgb8 rgb8_of(Vec3f c) {
  const auto byte = [](float x) { return static_cast<std::uint8_t>(std::clamp(255 * x + 0.5F, 0.F, 255.F)); };
  return {byte(c.x), byte(c.y), byte(c.z)};
}

std::string text(const char* format, double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

/// Bounds, way into the body (weighted with lengths), direction and length of the lines that the picture
/// shows.
struct Lines {
  Vec3d low_m{1e30, 1e30, 1e30}, high_m{-1e30, -1e30, -1e30}, inward{};
  double cos_twice = 0, sin_twice = 0;  ///< of the lines' direction in the horizontal plane
  double length_m = 0;
  void add(Vec3d p) { low_m = min(low_m, p), high_m = max(high_m, p); }
};

Lines lines_of(const Strokes& strokes, const std::vector<const PlannedLine*>& plans) {
  Lines lines;
  for (const StrokeResult& stroke : strokes) {
    for (const SkinSegment& s : stroke.skin) {
      if (stroke.deviation && s.place == SkinSegment::Place::elsewhere) continue;
      lines.add(s.from_m);
      lines.add(s.to_m);
      const Vec3d way = s.to_m - s.from_m;
      lines.inward += length(way) * s.inward;
      lines.cos_twice += (way.x * way.x - way.z * way.z) / std::max(length(way), 1e-12);
      lines.sin_twice += 2 * way.x * way.z / std::max(length(way), 1e-12);
      lines.length_m += length(way);
    }
  }
  for (const PlannedLine* plan : plans)
    for (const Vec3d& p : plan->points_m()) lines.add(p);
  return lines;
}

/// Looks along the way into the cut; where cuts go in everywhere, from a corner.
ViewCamera camera_of(const Lines& lines, const Box3f& body_m) {
  // The whole body, unless the lines would be small on it.
  constexpr double kSmall = 5;
  const double long_m = length(lines.high_m - lines.low_m);
  const bool shows_all = static_cast<double>(length(body_m.extent())) < kSmall * long_m;
  const Vec3d grow = (shows_all ? kSmall : 0.8) * long_m * Vec3d{1, 1, 1};
  Box3f box{max(body_m.min, vec_cast<float>(lines.low_m - grow)),
            min(body_m.max, vec_cast<float>(lines.high_m + grow))};
  box = {min(box.min, vec_cast<float>(lines.low_m)), max(box.max, vec_cast<float>(lines.high_m))};
  const bool goes_round = length(lines.inward) < 0.5 * lines.length_m;
  const Vec3d out = goes_round ? normalized(Vec3d{0.5, 0.6, 0.9}) : normalized(-1.0 * lines.inward);
  const double steep = std::asin(std::clamp(out.y, -1.0, 1.0));
  const bool from_above = std::abs(out.y) > 0.95;
  const bool has_direction = std::hypot(lines.sin_twice, lines.cos_twice) > 0.3 * lines.length_m;
  const double azimuth = !from_above     ? std::atan2(out.x, out.z)
                         : has_direction ? -0.5 * std::atan2(lines.sin_twice, lines.cos_twice)
                                         : 0.0;
  ViewCamera camera =
      frame_box(box, static_cast<float>(azimuth), static_cast<float>(std::clamp(steep, -1.54, 1.54)),
                static_cast<float>(kScene_px) / kHeight_px);
  camera.distance_m *= 1.2F;  // scales are below
  return camera;
}

/// Every second part of a line that is cut into parts of this length, independent of its points.
std::vector<std::pair<Vec3d, Vec3d>> dashes(const std::vector<Vec3d>& line_m, double dash_m) {
  std::vector<std::pair<Vec3d, Vec3d>> all;
  double left_m = dash_m;  // of the component
  bool is_drawn = true;
  for (std::size_t k = 1; k < line_m.size(); ++k) {
    Vec3d at_m = line_m[k - 1];
    for (double displacement_m = length(line_m[k] - at_m); displacement_m > 0;) {
      const double step_m = std::min(displacement_m, left_m);
      const Vec3d next_m = at_m + (step_m / displacement_m) * (line_m[k] - at_m);
      if (is_drawn) all.emplace_back(at_m, next_m);
      at_m = next_m;
      displacement_m -= step_m;
      left_m -= step_m;
      if (left_m > 0) continue;
      is_drawn = !is_drawn;
      left_m = dash_m;
    }
  }
  return all;
}

ColorImage draw_body(const SoftBody& body, Vec3f color, const Strokes& strokes,
                     const std::vector<const PlannedLine*>& plans, const ViewCamera& camera) {
  ViewScene scene;
  scene.ground = false;
  scene.background = kPaper;
  scene.sun = camera.eye_m() - camera.target_m + camera.distance_m * Vec3f{-0.5F, 0.35F, 0.3F};
  Material material = soft_material();
  material.color = 0.45F * color + 0.55F * Vec3f{0.93F, 0.90F, 0.87F};
  material.roughness = 0.6F;
  TriangleMesh mesh = body.shape().surface_m;
  if (body.shape().has_creases) split_creases(mesh);
  scene.meshes.push_back({.name = body.name(), .mesh = std::move(mesh), .material = material});
  // Towards the eye, a point stays where it is in the picture.
  const Vec3f eye_m = camera.eye_m();
  const auto add = [&](Vec3d from, Vec3d to, Vec3f line_color, float width_px, float nearer) {
    const auto shown = [&](Vec3d p) { return vec_cast<float>(p) + nearer * (eye_m - vec_cast<float>(p)); };
    scene.lines.push_back({shown(from), shown(to), line_color, width_px});
  };
  for (const StrokeResult& stroke : strokes) {
    double tolerance_m = 1;
    for (const PlannedLine* plan : plans)
      if (plan->name() == stroke.plan) tolerance_m = plan->tolerance_m();
    for (const SkinSegment& s : stroke.skin) {
      const bool is_on_side = s.place != SkinSegment::Place::elsewhere;
      const Vec3f shade = is_on_side         ? deviation_color(s.off_m, tolerance_m)
                          : stroke.deviation ? Vec3f{0.55F, 0.57F, 0.60F}
                                             : Vec3f{0.12F, 0.22F, 0.45F};
      add(s.from_m, s.to_m, shade, is_on_side || !stroke.deviation ? 6.F : 2.F, 0.004F);
    }
  }
  for (const PlannedLine* plan : plans) {
    const double dash_m = 0.012 * static_cast<double>(camera.distance_m);
    for (const auto& [from_m, to_m] : dashes(plan->points_m(), dash_m))
      add(from_m, to_m, {0.05F, 0.05F, 0.08F}, 3.F, 0.008F);
  }
  Renderer renderer({.width_px = kScene_px, .height_px = kHeight_px, .samples = 4, .shadow_map_px = 2048});
  return renderer.render(scene, camera);
}

/// "0 mm ... 2 x tolerance", and how long a centimetre is.
void draw_scales(ColorImage& image, double tolerance_m, const ViewCamera& camera) {
  const Index x0 = kMargin_px, y0 = kHeight_px - 60, wide = 260;
  if (tolerance_m > 0) {
    for (Index x = 0; x < wide; ++x)
      for (Index y = 0; y < 16; ++y)
        image(x0 + x, y0 + y) = rgb8_of(deviation_color(2 * tolerance_m * x / wide, tolerance_m));
    draw_text(image, "off the planned line", x0, y0 - 10, 16, kInk);
    draw_text(image, "0", x0, y0 + 38, 16, kInk);
    draw_text(image, text("%.1f mm or more", 2e3 * tolerance_m), x0 + wide - 40, y0 + 38, 16, kInk);
  }
  const double px_per_m = kHeight_px / (2 * std::tan(0.5 * static_cast<double>(camera.fov_rad)) *
                                        static_cast<double>(camera.distance_m));
  double bar_m = 0.01;
  if (px_per_m * bar_m > 300) bar_m = 0.002;
  if (px_per_m * bar_m < 40) bar_m = 0.05;
  const auto bar = static_cast<Index>(px_per_m * bar_m), x1 = kScene_px - kMargin_px - bar;
  for (Index x = 0; x < bar; ++x)
    for (Index y = 0; y < 4; ++y) image(x1 + x, kHeight_px - 44 + y) = kInk;
  draw_text(image, text("%.0f mm", 1e3 * bar_m), x1, kHeight_px - 22, 16, kInk);
}

using Column = std::vector<std::string>;

Column names_of_rows() {
  return {"blade",        "path [mm]",     "depth [mm]",     "area [cm2]",    "on skin [mm]",
          "planned line", "mean off [mm]", "most off [mm]",  "followed [mm]", "beyond [mm]",
          "blood [ml]",   "waiting [ml]",  "peak force [N]", "time [s]"};
}

Column column_of(const StrokeResult& stroke) {
  const CutScore& c = stroke.score;
  const auto& d = stroke.deviation;
  return {c.blade,
          text("%.1f", 1e3 * c.path_m),
          text("%.1f", 1e3 * c.depth_m),
          text("%.2f", 1e4 * c.area_m2),
          text("%.1f", 1e3 * stroke.skin_length_m),
          d ? stroke.plan : "-",
          d ? text("%.2f", 1e3 * d->mean_m) : "-",
          d ? text("%.2f", 1e3 * d->max_m) : "-",
          d ? text("%.1f", 1e3 * d->followed_m) : "-",
          d ? text("%.1f", 1e3 * d->beyond_m) : "-",
          text("%.2f", 1e6 * c.bled_m3),
          text("%.2f", 1e6 * (c.due_m3 - c.bled_m3)),
          stroke.peak_force_N ? text("%.2f", *stroke.peak_force_N) : "-",
          text("%.2f", c.end_s - c.begin_s)};
}

void draw_table(ColorImage& image, const std::string& body, const Strokes& strokes,
                const std::vector<const PlannedLine*>& plans) {
  const Index x0 = kScene_px + kMargin_px;
  constexpr Index kInner_px = kTable_px - 2 * kMargin_px;
  draw_text_within(image, "Cuts of '" + body + "'", x0, 64, 26, kInner_px, kInk);
  const Column names = names_of_rows();
  const std::size_t shown = std::min(strokes.size(), kColumns);
  const Index first_column = 205, column = (kInner_px - first_column) / static_cast<Index>(shown);
  constexpr Index kTop_px = 128, kRow_px = 42;
  const auto rule = [&](Index y) {
    for (Index x = x0; x < kScene_px + kTable_px - kMargin_px; ++x) image(x, y) = {205, 208, 212};
  };
  for (std::size_t r = 0; r < names.size(); ++r) {
    const Index y = kTop_px + kRow_px * static_cast<Index>(r);
    draw_text_within(image, names[r], x0, y, 16, first_column - 12, kFaint);
    rule(y + 14);
    for (std::size_t k = 0; k < shown; ++k) {
      draw_text_within(image, column_of(strokes[k])[r], x0 + first_column + static_cast<Index>(k) * column, y,
                       16, column - 8, kInk);
    }
  }
  Index y = kTop_px + kRow_px * static_cast<Index>(names.size()) + 20;
  const auto note = [&](const std::string& line) {
    draw_text_within(image, line, x0, y, 15, kInner_px, kFaint);
    y += 28;
  };
  if (strokes.size() > shown) note(std::to_string(strokes.size() - shown) + " more strokes are in the JSON");
  for (const PlannedLine* plan : plans)
    note("'" + plan->name() + "', dashed: " + text("%.1f mm long", 1e3 * plan->length_m()));
  note("The body is shown at rest.");
  if (std::any_of(strokes.begin(), strokes.end(),
                  [](const StrokeResult& s) { return s.deviation.has_value(); }))
    note("Grey: on other sides than planned");
}

ColorImage score_picture(const SoftBody& body, Vec3f color, const Strokes& strokes,
                         const std::vector<const PlannedLine*>& plans) {
  const ViewCamera camera = camera_of(lines_of(strokes, plans), bounds(body.shape().surface_m));
  const ColorImage scene = draw_body(body, color, strokes, plans, camera);
  ColorImage image(kScene_px + kTable_px, kHeight_px);
  for (Index y = 0; y < kHeight_px; ++y)
    for (Index x = 0; x < image.width_px; ++x) image(x, y) = x < kScene_px ? scene(x, y) : rgb8_of(kPaper);
  double tolerance_m = 0;
  for (const PlannedLine* plan : plans) tolerance_m = std::max(tolerance_m, plan->tolerance_m());
  draw_scales(image, tolerance_m, camera);
  draw_table(image, body.name(), strokes, plans);
  return image;
}

}  // namespace

std::vector<std::string> write_score_pictures(const Scene& scene, const World& world,
                                              const std::string& stem) {
  std::vector<std::string> paths;
  const Strokes all = world.stroke_results();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const SoftBody& body = *world.impl().bodies()[b];
    Strokes strokes;
    std::copy_if(all.begin(), all.end(), std::back_inserter(strokes),
                 [&](const StrokeResult& s) { return s.score.body == body.name(); });
    if (strokes.empty()) continue;
    std::vector<const PlannedLine*> plans;
    for (const PlannedLine& plan : world.impl().plans())
      if (plan.body() == body.name()) plans.push_back(&plan);
    paths.push_back(stem + "-" + body.name() + "-score.png");
    write_png(paths.back(), score_picture(body, vec_cast<float>(scene.bodies[b].colour), strokes, plans));
  }
  return paths;
}

}  // namespace tactus
