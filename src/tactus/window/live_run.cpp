#include "tactus/window/live_run.h"

#include "tactus/io/scene_file.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_source.h"
#include "tactus/world/world_impl.h"

namespace tactus {

namespace {

RunControl::Options control_options(const Scene& scene) {
  return {.keeps_pace = scene.source.kind != SourceKind::live,
          .shows_first_frame = true,
          .has_viewers = {},
          .state_changed = {},
          .tool_speed_m_s = 0.5,  // a hand's; faster, a tool would go through bodies
          .frame_s = scene.frame.dt_s.value_or(1 / scene.source.fps.value_or(30))};
}

}  // namespace

LiveRun::LiveRun(Scene scene, Options options)
    : scene_(std::move(scene)),
      options_(std::move(options)),
      control_(control_options(scene_)),
      saver_(scene_.source.kind == SourceKind::live ? "live cameras can't give their frames again" : ""),
      past_(options_.past_bytes),
      checkup_(scene_.source, [this] {
        if (on_news_) on_news_();
      }) {}

LiveRun::~LiveRun() {
  control_.stop();
  if (thread_.joinable()) thread_.join();
}

void LiveRun::start(std::function<void()> on_news) {
  on_news_ = std::move(on_news);
  thread_ = std::thread([this] { work(); });
}

bool LiveRun::stop(double wait_s) {
  control_.stop();
  if (!thread_.joinable()) return true;
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, std::chrono::duration<double>(wait_s), [this] { return has_ended_; }) &&
         checkup_.state() != RigCheckup::State::looking;
}

LiveRun::State LiveRun::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void LiveRun::set_state(State state) {
  {
    const std::lock_guard lock(mutex_);
    state_ = state;
  }
  if (on_news_) on_news_();
}

void LiveRun::rethrow_failure() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

void LiveRun::work() noexcept {
  try {
    DeviceSet devices(options_.devices);
    while (run_once(devices) == RunControl::Turn::restart) {
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    state_ = State::failed;
  }
  const std::lock_guard lock(mutex_);
  has_ended_ = true;
  ended_.notify_all();
  if (on_news_) on_news_();
}

std::shared_ptr<const PastState> LiveRun::kept() const {
  const std::lock_guard lock(mutex_);
  return kept_;
}

void LiveRun::keep(std::shared_ptr<const PastState> state) {
  if (state == nullptr) return;
  const std::lock_guard lock(mutex_);
  kept_ = std::move(state);
}

void LiveRun::simulate_again(std::shared_ptr<const PastState> state) {
  if (state == nullptr) return;
  {
    const std::lock_guard lock(mutex_);
    again_ = std::move(state);
  }
  control_.go_back();
}

void LiveRun::remember(const std::shared_ptr<const ViewedFrame>& frame, World& world,
                       const RunProgress& progress) {
  if (past_.is_kept()) past_.add({frame, saver_.save(world, progress, frame->number, control_.is_paused())});
}

double LiveRun::budget_ms(const FrameSource& source) const {
  if (options_.budget_s > 0) return 1e3 * options_.budget_s;
  const std::optional<double> fps = source.fps();
  return fps && *fps > 0 ? 1e3 / *fps : 0;
}

RunControl::Turn LiveRun::run_once(DeviceSet& devices) {
  set_state(State::building);
  std::shared_ptr<const PastState> again;
  if (control_.begin()) {
    const std::lock_guard lock(mutex_);
    again.swap(again_);
  }
  again ? past_.forget_after(again->number) : past_.clear();
  const std::unique_ptr<FrameSource> source = open_scene_source(scene_, options_.named);
  const BodyAssets assets = load_body_assets(scene_);
  const auto perception = make_perception(devices, scene_, source->rig(), assets);
  World world(devices, scene_, assets, perception.get());
  auto view = std::make_unique<SceneView>(scene_, source->rig(), assets, world);
  if (scene_.view.show_models) view->show_models(element_triangles(world));
  frame_.take();
  cameras_.take();
  view_.put(std::move(view));
  RunProgress progress;
  if (again) {
    progress = take_up(*again, *source, world, options_.named);
    control_.set_grab(std::nullopt);  // nobody holds that tissue now
  }
  set_state(State::running);
  FrameLoop* at = nullptr;
  ViewSink sink(scene_, world, control_, frame_, on_news_,
                {.tools = options_.tools,
                 .wears_photographs = scene_.view.photographs > 0,
                 .budget_ms = budget_ms(*source),
                 .frames_before = again ? again->number : 0,
                 .seen = [&](const auto& frame) { remember(frame, world, at->progress()); }});
  CameraSink cameras(*source, control_, {cameras_, shows_cameras_, checkup_}, again ? again->number : 0);
  const auto should_stop = [&] {
    while (!sink.may_go_on()) {
      if (sink.turn() != RunControl::Turn::keep) return true;
      keep(saver_.save(world, at->progress(), sink.number(), true));
    }
    return false;
  };
  FrameLoop loop(*source, world, {.should_stop = should_stop});
  at = &loop;
  loop.go_on_from(progress);
  if (!source->rig().cameras.empty()) loop.add(cameras);
  loop.add(sink);
  loop.run();
  if (sink.turn() != RunControl::Turn::go) return sink.turn();
  set_state(State::ended);
  RunControl::Turn turn = control_.wait_for_restart();
  for (; turn == RunControl::Turn::keep; turn = control_.wait_for_restart())
    keep(saver_.save(world, loop.progress(), sink.number(), true));
  return turn;
}

}  // namespace tactus
