#include "tactus/xr/headset_run.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "tactus/base/timing.h"
#include "tactus/io/scene_file.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_source.h"

namespace tactus {
namespace {

/// A run that is later than this doesn't catch up.
constexpr double kLatest_s = 0.2;
/// A quick hand's. Faster, a tool would go through a body that it should push.
constexpr double kToolSpeed_m_s = 1.5;

}  // namespace

/// Keeps the pace of time, moves tools, hands frames over.
class HeadsetRun::Sink final : public FrameSink {
 public:
  Sink(HeadsetRun& run, World& world)
      : run_(run),
        world_(world),
        keeps_pace_(run.scene_.source.kind != SourceKind::live),
        frame_s_(run.scene_.frame.dt_s.value_or(1 / run.scene_.source.fps.value_or(30))) {
    for (const ObstacleSetting& o : run.scene_.obstacles)
      if (o.held) tools_.push_back(o.name);
    for (const BladeDescription& b : run.scene_.blades)
      if (b.held) tools_.push_back(b.name);
  }

  /// Waits for the turn of the next frame; false: the loop ends.
  bool may_go_on() {
    std::map<std::string, Rigidd> wanted;
    {
      std::unique_lock lock(run_.mutex_);
      if (keeps_pace_ && has_begun_) {
        if (now_s() - due_s_ > kLatest_s) due_s_ = now_s();
        run_.changed_.wait_for(lock, std::chrono::duration<double>(std::max(0., due_s_ - now_s())),
                               [this] { return run_.stops_; });
      }
      if (run_.stops_) return false;
      wanted = run_.wanted_;
    }
    for (const auto& [name, T] : wanted) move(name, T);
    return true;
  }

  void frame(RunFrame& frame) override {
    const double time_s = frame.images.time_s;
    due_s_ = has_begun_ ? due_s_ + (time_s - last_time_s_) : now_s();
    if (!has_begun_) due_s_ += frame_s_;
    has_begun_ = true;
    last_time_s_ = time_s;
    if (frame.report.dt_s > 0) frame_s_ = frame.report.dt_s;
    if (run_.scene_.view.photographs > 0) photos_ = frame.images.colors;
    {
      const std::lock_guard lock(run_.mutex_);
      is_unseen_ = run_.frame_ != nullptr;
    }
    if (is_unseen_) return;
    hand_over();
  }

  /// The last frame of a source is seen.
  void end(RunNotices& /*notices*/) override {
    if (is_unseen_) hand_over();
  }

 private:
  void move(const std::string& name, Rigidd T_wanted) {
    const Vec3d from_m = world_.pose(name).t, step_m = T_wanted.t - from_m;
    const double most_m = kToolSpeed_m_s * frame_s_, wanted_m = length(step_m);
    if (wanted_m > most_m) T_wanted.t = from_m + (most_m / wanted_m) * step_m;
    world_.set_pose(name, T_wanted);
  }

  void hand_over() {
    auto shown = std::make_unique<HeadsetFrame>();
    shown->snapshot = std::make_shared<const FrameSnapshot>(world_.snapshot());
    shown->photos = photos_;
    for (const std::string& tool : tools_) shown->tools[tool] = world_.pose(tool);
    const std::lock_guard lock(run_.mutex_);
    run_.frame_ = std::move(shown);
  }

  HeadsetRun& run_;
  World& world_;
  std::vector<std::string> tools_;
  std::vector<ColorImage> photos_;
  const bool keeps_pace_;
  double frame_s_;                      ///< simulated per frame
  double due_s_ = 0, last_time_s_ = 0;  ///< due: when the next frame begins, on the clock of now_s()
  bool has_begun_ = false, is_unseen_ = false;
};

HeadsetRun::HeadsetRun(Scene scene, std::string named, std::string devices)
    : scene_(std::move(scene)), named_(std::move(named)), devices_(std::move(devices)) {}

HeadsetRun::~HeadsetRun() {
  {
    const std::lock_guard lock(mutex_);
    stops_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void HeadsetRun::start() {
  thread_ = std::thread([this] { work(); });
}

void HeadsetRun::work() noexcept {
  try {
    run_scene();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
}

void HeadsetRun::run_scene() {
  DeviceSet devices(devices_);
  const std::unique_ptr<FrameSource> source = open_scene_source(scene_, named_);
  const BodyAssets assets = load_body_assets(scene_);
  const auto perception = make_perception(devices, scene_, source->rig(), assets);
  World world(devices, scene_, assets, perception.get());
  auto view = std::make_unique<SceneView>(scene_, source->rig(), assets, world);
  if (scene_.view.show_models) view->show_models(element_triangles(world));
  {
    const std::lock_guard lock(mutex_);
    view_ = std::move(view);
  }
  Sink sink(*this, world);
  FrameLoop loop(*source, world, {.should_stop = [&sink] { return !sink.may_go_on(); }});
  loop.add(sink);
  loop.run();
}

std::unique_ptr<SceneView> HeadsetRun::take_view() {
  const std::lock_guard lock(mutex_);
  return std::exchange(view_, nullptr);
}

std::unique_ptr<HeadsetFrame> HeadsetRun::take_frame() {
  const std::lock_guard lock(mutex_);
  return std::exchange(frame_, nullptr);
}

void HeadsetRun::move_tool(const std::string& name, const Rigidd& T_world_tool) {
  const std::lock_guard lock(mutex_);
  wanted_[name] = T_world_tool;
}

void HeadsetRun::rethrow_failure() const {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

}  // namespace tactus
