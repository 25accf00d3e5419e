#include "tactus/rig/synthetic/synthetic_source.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "tactus/base/error.h"

namespace tactus {
namespace {

std::string text(double x) {
  std::ostringstream out;
  out << x;
  return out.str();
}

/// @throws usage_error unless low <= value <= high.
void check_range(const std::string& what, double value, double low, double high) {
  if (value >= low && value <= high) return;  // false for NaN
  throw usage_error("synthetic rig: " + what + " is " + text(value) + ", expected " + text(low) + " to " +
                    text(high));
}

/// Splits "hand-moving", and checks the options that the figure itself doesn't.
SyntheticOptions checked(SyntheticOptions options) {
  for (const auto& [suffix, moving] :
       {std::pair{std::string("-still"), false}, {std::string("-moving"), true}}) {
    if (options.figure.ends_with(suffix)) {
      options.figure.resize(options.figure.size() - suffix.size());
      options.shape.moving = moving;
    }
  }
  check_range("fps", options.fps, 1e-3, 1e4);
  check_range("first_frame", options.first_frame, 0, 2e9);
  if (options.frames) check_range("frames", *options.frames, 1, 1e9);
  return options;
}

void resize(BitMask& mask, const Camera& camera) {
  if (mask.width_px != camera.width_px || mask.height_px != camera.height_px) {
    mask = BitMask(camera.width_px, camera.height_px);
  } else {
    std::fill(mask.words.begin(), mask.words.end(), 0U);
  }
}
template <class T>
void resize(Image<T>& image, const Camera& camera) {
  if (image.width_px != camera.width_px || image.height_px != camera.height_px) {
    image = Image<T>(camera.width_px, camera.height_px);
  } else {
    std::fill(image.pixels.begin(), image.pixels.end(), T{});
  }
}

/// Skin under a soft light from above and a weaker one from the side.
Rgb8 skin(Vec3f normal, Vec3f to_eye) {
  const float key = std::max(dot(normal, Vec3f{0.36F, 0.80F, 0.48F}), 0.F);
  const float fill = std::max(dot(normal, Vec3f{-0.7F, 0.1F, 0.7F}), 0.F);
  const float rim = 1 - std::max(dot(normal, to_eye), 0.F);
  const float light = 0.28F + 0.62F * key + 0.16F * fill + 0.10F * rim * rim * rim;
  const auto byte = [](float x) { return static_cast<std::uint8_t>(clamp(x, 0.F, 1.F) * 255.F + 0.5F); };
  return {byte(0.92F * light), byte(0.70F * light), byte(0.58F * light)};
}

}  // namespace

Rig make_synthetic_rig(const SyntheticRigOptions& o) {
  check_range("camera_count", o.camera_count, 1, 64);
  check_range("depth_cameras", o.depth_cameras, 0, 32);
  for (const auto& [name, size] : {std::pair{"width_px", o.width_px},
                                   {"height_px", o.height_px},
                                   {"depth_width_px", o.depth_width_px},
                                   {"depth_height_px", o.depth_height_px}})
    check_range(name, size, 1, 8192);
  for (const auto& [name, focal] : {std::pair{"focal_px", o.focal_px}, {"depth_focal_px", o.depth_focal_px}})
    check_range(name, focal, 1, 1e5);
  for (const auto& [name, distance] :
       {std::pair{"ring_radius_m", o.ring_radius_m}, {"depth_distance_m", o.depth_distance_m}})
    check_range(name, distance, 0.8, 20);  // outside the cube
  for (const auto& [name, height] :
       {std::pair{"low_m", o.low_m}, {"high_m", o.high_m}, {"depth_height_m", o.depth_height_m}})
    check_range(name, height, -20, 20);

  Rig rig;
  rig.workspace_m = {{-0.5F, 0, -0.5F}, {0.5F, 1, 0.5F}};
  const Vec3d center{0, 0.5, 0}, up{0, 1, 0};
  for (int i = 0; i < o.camera_count; ++i) {
    const double angle = 2 * std::acos(-1.0) * (i + 0.5) / o.camera_count;
    const Vec3d eye{o.ring_radius_m * std::sin(angle), (i % 2) ? o.high_m : o.low_m,
                    o.ring_radius_m * std::cos(angle)};
    Camera camera = look_at(eye, center, up, o.width_px, o.height_px, o.focal_px);
    camera.name = "cam" + std::to_string(i);
    rig.cameras.push_back(camera);
  }
  for (int i = 0; i < o.depth_cameras; ++i) {
    const double angle = 2 * std::acos(-1.0) * i / o.depth_cameras;
    const Vec3d eye{o.depth_distance_m * std::sin(angle), o.depth_height_m,
                    o.depth_distance_m * std::cos(angle)};
    Camera camera = look_at(eye, center, up, o.depth_width_px, o.depth_height_px, o.depth_focal_px);
    camera.name = i == 0 ? "tof" : "tof" + std::to_string(i + 1);
    rig.depth_cameras.push_back(camera);
  }
  return rig;
}

SyntheticSource::SyntheticSource(const SyntheticOptions& options)
    : options_(checked(options)),
      rig_(make_synthetic_rig(options_.rig)),
      figure_(make_figure(options_.figure, options_.shape)),
      tick_(options_.first_frame) {
  if (!options_.depth) rig_.depth_cameras.clear();
  for (const Camera& camera : rig_.cameras) tracers_.emplace_back(camera);
  for (const Camera& camera : rig_.depth_cameras) tracers_.emplace_back(camera);
  const Box3f box = figure_.bounds_m();
  for (const FigureTracer& tracer : tracers_) {  // a camera inside the figure has no silhouette to show
    const Vec3f eye = tracer.eye_m();
    if (max(min(eye, box.max), box.min) == eye) {
      throw usage_error("synthetic rig: figure '" + figure_.name() + "' with scale " +
                        text(static_cast<double>(options_.shape.scale)) +
                        " reaches a camera; make it smaller, or the ring larger");
    }
  }
}

NextFrame SyntheticSource::next(FrameSet& frame) {
  if (options_.frames && tick_ - options_.first_frame >= *options_.frames) return NextFrame::no_more_data;
  frame.tick = tick_;
  frame.time_s = static_cast<double>(tick_) / options_.fps;
  figure_.at(frame.time_s, shape_);
  trace(frame);
  frame.truth_volume_m3.reset();
  if (options_.truth) {
    if (figure_.moving()) {
      frame.truth_volume_m3 = figure_volume(shape_).volume_m3;
    } else {
      if (!still_volume_m3_) still_volume_m3_ = figure_volume(shape_).volume_m3;
      frame.truth_volume_m3 = still_volume_m3_;
    }
  }
  status_.clear();
  for (std::size_t i = 0; i < frame.silhouettes.size() && status_.empty(); ++i) {
    if (frame.silhouettes[i].area_px() == 0) {
      status_ = "camera '" + rig_.cameras[i].name + "' sees nothing of figure '" + figure_.name() + "'";
    }
  }
  ++tick_;
  return NextFrame::success;
}

void SyntheticSource::trace(FrameSet& frame) {
  const std::size_t cameras = rig_.cameras.size();
  frame.silhouettes.resize(cameras);
  for (std::size_t i = 0; i < cameras; ++i) resize(frame.silhouettes[i], rig_.cameras[i]);
  const std::size_t depths = rig_.depth_cameras.size();
  frame.depths_m.resize(depths);
  for (std::size_t d = 0; d < depths; ++d) resize(frame.depths_m[d], rig_.depth_cameras[d]);
  if (options_.colors) {
    distances_m_.resize(cameras);
    for (std::size_t i = 0; i < cameras; ++i) resize(distances_m_[i], rig_.cameras[i]);
  }
  const auto strips = static_cast<std::size_t>(tracers_.front().strip_count());
  const auto depth_strips = static_cast<std::size_t>(tracers_.back().strip_count());
  tbb::parallel_for(std::size_t{0}, cameras * strips + depths * depth_strips, [&](std::size_t job) {
    if (job < cameras * strips) {
      const std::size_t i = job / strips;
      tracers_[i].trace_strip(shape_, static_cast<Index>(job % strips), &frame.silhouettes[i],
                              options_.colors ? &distances_m_[i] : nullptr);
    } else {
      const std::size_t d = (job - cameras * strips) / depth_strips;
      tracers_[cameras + d].trace_strip(shape_, static_cast<Index>((job - cameras * strips) % depth_strips),
                                        nullptr, &frame.depths_m[d]);
    }
  });
  if (options_.colors) {
    shade(frame);
  } else {
    frame.colors.clear();
  }
}

void SyntheticSource::shade(FrameSet& frame) {
  frame.colors.resize(rig_.cameras.size());
  for (std::size_t i = 0; i < rig_.cameras.size(); ++i) {
    const FigureTracer& tracer = tracers_[i];
    ColorImage& image = frame.colors[i];
    resize(image, rig_.cameras[i]);
    tbb::parallel_for(Index{0}, image.height_px, [&](Index y) {
      // An even grey wall, a little darker to the bottom.
      const auto wall = static_cast<std::uint8_t>(226 - 60 * y / image.height_px);
      for (Index x = 0; x < image.width_px; ++x) {
        const float z_m = distances_m_[i](x, y);
        if (z_m <= 0) {
          image(x, y) = {wall, wall, static_cast<std::uint8_t>(wall + 6)};
          continue;
        }
        const Vec3f d = tracer.direction(static_cast<float>(x), static_cast<float>(y));
        const Vec3f p = tracer.eye_m() + z_m * d;
        constexpr float kStep_m = 1e-3F;
        const auto slope = [&](Vec3f e) { return shape_.distance_m(p + e) - shape_.distance_m(p - e); };
        const Vec3f normal =
            normalized(Vec3f{slope({kStep_m, 0, 0}), slope({0, kStep_m, 0}), slope({0, 0, kStep_m})}, -d);
        image(x, y) = skin(normal, -d);
      }
    });
  }
}

}  // namespace tactus
