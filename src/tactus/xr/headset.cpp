#include "tactus/xr/headset.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <thread>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"
#include "tactus/view/renderer.h"
#include "tactus/xr/eye_images.h"
#include "tactus/xr/headset_run.h"
#include "tactus/xr/xr_hands.h"

namespace tactus {
namespace {

constexpr std::size_t kEyes = 2;
/// A runtime that doesn't end the session when it is asked to is left all the same.
constexpr double kMostWait_s = 2;
constexpr double kIdle_s = 0.01;
/// Where a runtime doesn't know the floor, the eyes of one who stands are so high above it [m].
constexpr double kEyeHeight_m = 1.5;

Vec2i recommended_px(const XrSystem& system) {
  const auto views = xr_list<XrViewConfigurationView>(
      "xrEnumerateViewConfigurationViews",
      xr_struct<XrViewConfigurationView>(XR_TYPE_VIEW_CONFIGURATION_VIEW),
      [&](std::uint32_t capacity, std::uint32_t* count, XrViewConfigurationView* list) {
        return xrEnumerateViewConfigurationViews(
            system.instance(), system.id(), XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO, capacity, count, list);
      });
  if (views.size() != kEyes)
    throw Error("the OpenXR runtime has " + std::to_string(views.size()) + " views, expected 2");
  Vec2i size_px{16, 16};
  for (const XrViewConfigurationView& v : views) {
    size_px.x = std::max(size_px.x, static_cast<int>(std::min(v.recommendedImageRectWidth, 8192U)));
    size_px.y = std::max(size_px.y, static_cast<int>(std::min(v.recommendedImageRectHeight, 8192U)));
  }
  return size_px;
}

ViewEye eye_of(const XrView& view, const Rigidd& T_room_world) {
  const Rigidd T = inverse(T_room_world) * to_rigid(view.pose);
  ViewEye eye;
  eye.T_world_eye = {mat_cast<float>(T.R), vec_cast<float>(T.t)};
  eye.left = std::tan(view.fov.angleLeft);
  eye.right = std::tan(view.fov.angleRight);
  eye.down = std::tan(view.fov.angleDown);
  eye.up = std::tan(view.fov.angleUp);
  return eye;
}

class HeadsetView {
 public:
  HeadsetView(Scene scene, const HeadsetOptions& options)
      : options_(options),
        current_(context_),
        session_(system_, context_),
        hands_(system_, session_),
        size_px_(recommended_px(system_)),
        eyes_{EyeImages(session_, system_.takes_depth(), size_px_),
              EyeImages(session_, system_.takes_depth(), size_px_)},
        renderer_({.width_px = size_px_.x, .height_px = size_px_.y, .in_current_context = true}),
        run_(std::move(scene), options.named, options.devices) {}

  void show() {
    log_info("headset: " + system_.description() + ", " + std::to_string(size_px_.x) + "x" +
             std::to_string(size_px_.y) + " px an eye" +
             (eyes_[0].has_depth() ? ", with depth" : ", without depth"));
    if (!session_.knows_floor())
      log_warning("the headset doesn't know where the floor is: the scene lies as for one who stands");
    run_.start();
    while (!session_.is_over() && !leaves()) {
      run_.rethrow_failure();
      session_.poll();
      take_news();
      if (session_.is_running())
        show_frame();
      else
        std::this_thread::sleep_for(std::chrono::duration<double>(kIdle_s));
    }
  }

 private:
  bool leaves() {
    if (!options_.should_close || !options_.should_close()) return false;
    if (asked_at_s_ > 0) return now_s() - asked_at_s_ > kMostWait_s;
    asked_at_s_ = now_s();
    return !session_.request_exit();
  }

  void take_news() {
    if (auto view = run_.take_view()) {
      view_ = std::move(view);
      T_room_world_.t = options_.at_m - vec_cast<double>(view_->camera().target_m);
      if (!session_.knows_floor()) T_room_world_.t.y -= kEyeHeight_m;
    }
    if (auto frame = run_.take_frame(); frame != nullptr && view_ != nullptr) {
      view_->show(*frame->snapshot, frame->photos);
      tools_ = std::move(frame->tools);
      has_picture_ = true;
      is_uploaded_ = false;
    }
  }

  void show_frame() {
    auto state = xr_struct<XrFrameState>(XR_TYPE_FRAME_STATE);
    check_xr(xrWaitFrame(session_.get(), nullptr, &state), "xrWaitFrame");
    check_xr(xrBeginFrame(session_.get(), nullptr), "xrBeginFrame");
    follow_hands(state.predictedDisplayTime);
    auto layer = xr_struct<XrCompositionLayerProjection>(XR_TYPE_COMPOSITION_LAYER_PROJECTION);
    std::array<XrCompositionLayerProjectionView, kEyes> views{};
    std::array<XrCompositionLayerDepthInfoKHR, kEyes> depths{};
    const bool draws = state.shouldRender == XR_TRUE && has_picture_;
    const bool has_layer = draws && draw(state.predictedDisplayTime, views, depths);
    layer.space = session_.room();
    layer.viewCount = kEyes;
    layer.views = views.data();
    const auto* const layers = reinterpret_cast<const XrCompositionLayerBaseHeader*>(&layer);
    auto shown = xr_struct<XrFrameEndInfo>(XR_TYPE_FRAME_END_INFO);
    shown.displayTime = state.predictedDisplayTime;
    shown.environmentBlendMode = session_.blend_mode();
    shown.layerCount = has_layer ? 1 : 0;
    shown.layers = has_layer ? &layers : nullptr;
    check_xr(xrEndFrame(session_.get(), &shown), "xrEndFrame");
  }

  /// @returns false where the head's pose isn't known: there is no picture then
  bool draw(XrTime seen_at, std::array<XrCompositionLayerProjectionView, kEyes>& layer_views,
            std::array<XrCompositionLayerDepthInfoKHR, kEyes>& depths) {
    auto asked = xr_struct<XrViewLocateInfo>(XR_TYPE_VIEW_LOCATE_INFO);
    asked.viewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
    asked.displayTime = seen_at;
    asked.space = session_.room();
    auto state = xr_struct<XrViewState>(XR_TYPE_VIEW_STATE);
    std::array<XrView, kEyes> views{};
    for (XrView& view : views) view.type = XR_TYPE_VIEW;
    std::uint32_t count = 0;
    check_xr(xrLocateViews(session_.get(), &asked, &state, kEyes, &count, views.data()), "xrLocateViews");
    watch(head_, is_tracked(state.viewStateFlags), "the headset", "its picture may stand still");
    constexpr XrViewStateFlags kValid =
        XR_VIEW_STATE_POSITION_VALID_BIT | XR_VIEW_STATE_ORIENTATION_VALID_BIT;
    if ((state.viewStateFlags & kValid) != kValid) return false;
    for (std::size_t i = 0; i < kEyes; ++i) {
      const ViewEye eye = eye_of(views.at(i), T_room_world_);
      draw_eye(eyes_.at(i), eye);
      XrCompositionLayerProjectionView& shown = layer_views.at(i);
      shown.type = XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW;
      shown.pose = views.at(i).pose;
      shown.fov = views.at(i).fov;
      shown.subImage = eyes_.at(i).color();
      if (!eyes_.at(i).has_depth()) continue;
      depths.at(i) = {.type = XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR,
                      .next = nullptr,
                      .subImage = eyes_.at(i).depth(),
                      .minDepth = 0,
                      .maxDepth = 1,
                      .nearZ = eye.near_m,
                      .farZ = eye.far_m};
      shown.next = &depths.at(i);
    }
    return true;
  }

  void draw_eye(EyeImages& images, const ViewEye& eye) {
    images.begin();
    renderer_.draw_eye(view_->scene(), view_->camera(), eye, is_uploaded_);
    if (images.has_depth()) renderer_.copy_depth();
    images.end();
    is_uploaded_ = true;
  }

  void follow_hands(XrTime seen_at) {
    XrHands::Poses hands = hands_.look(seen_at);
    for (std::size_t i = 0; i < hands.size(); ++i) {
      HandPose& hand = hands.at(i);
      const std::string& tool = held_.held(i);
      watch(watches_.at(i), hand.is_tracked, i == 0 ? "the left controller" : "the right controller",
            tool.empty() ? "it holds nothing" : "'" + tool + "' stays where it is");
      hand.T_world_grip = inverse(T_room_world_) * hand.T_world_grip;
      if (const auto moved = held_.follow(i, hand, tools_)) run_.move_tool(moved->tool, moved->T_world_tool);
    }
  }

  static void watch(PoseWatch& watch, bool is_tracked, const std::string& name,
                    const std::string& meanwhile) {
    const PoseWatch::News news = watch.look(is_tracked, now_s());
    if (news == PoseWatch::News::lost) log_warning(name + " is no longer tracked: " + meanwhile);
    if (news == PoseWatch::News::back) log_info(name + " is tracked again");
  }

  const HeadsetOptions& options_;
  XrSystem system_;
  GlContext context_;
  GlContext::Current current_;
  XrViewSession session_;
  XrHands hands_;
  Vec2i size_px_;
  std::array<EyeImages, kEyes> eyes_;
  Renderer renderer_;
  HeadsetRun run_;
  std::unique_ptr<SceneView> view_;
  std::map<std::string, Rigidd> tools_;  ///< as in the frame that is shown
  HeldTools held_;
  PoseWatch head_;
  std::array<PoseWatch, HeldTools::kHands> watches_;
  Rigidd T_room_world_;
  bool has_picture_ = false;
  bool is_uploaded_ = false;  ///< the renderer has the newest frame
  double asked_at_s_ = 0;     ///< when the runtime was asked to end the session; 0: it wasn't
};

}  // namespace

std::string headset_missing() { return ""; }

void show_in_headset(Scene scene, const HeadsetOptions& options) {
  HeadsetView(std::move(scene), options).show();
}

}  // namespace tactus
