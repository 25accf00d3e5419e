#include "tactus/window/live_run.h"

#include "tactus/base/error.h"
#include "tactus/base/log.h"
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
    : scene_(std::move(scene)), options_(std::move(options)), control_(control_options(scene_)) {}

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
  return ended_.wait_for(lock, std::chrono::duration<double>(wait_s), [this] { return has_ended_; });
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

int LiveRun::kept_frame() const {
  const std::lock_guard lock(mutex_);
  return kept_.number;
}

void LiveRun::keep(World& world, const RunProgress& progress, int number) {
  if (scene_.source.kind == SourceKind::live) return;  // what it gave is gone
  StateArchive a;
  try {
    world.impl().archive(a, nullptr);
  } catch (const Error& error) {  // a tool that is tracked, say: the run goes on
    log_warning(error.what());
    return;
  }
  const std::lock_guard lock(mutex_);
  kept_ = {a.bytes(), progress, number};
}

RunProgress LiveRun::go_back(FrameSource& source, World& world) const {
  const std::optional<FrameSet> last = take_again(source, kept_.progress.taken, options_.named);
  StateArchive a(kept_.bytes, "the kept frame");
  world.impl().archive(a, last ? &*last : nullptr);
  return kept_.progress;
}

RunControl::Turn LiveRun::run_once(DeviceSet& devices) {
  set_state(State::building);
  const bool goes_back = control_.begin() && kept_.number > 0;
  const std::unique_ptr<FrameSource> source = open_scene_source(scene_, options_.named);
  const BodyAssets assets = load_body_assets(scene_);
  const auto perception = make_perception(devices, scene_, source->rig(), assets);
  World world(devices, scene_, assets, perception.get());
  auto view = std::make_unique<SceneView>(scene_, source->rig(), assets, world);
  if (scene_.view.show_models) view->show_models(element_triangles(world));
  frame_.take();
  view_.put(std::move(view));
  RunProgress progress;
  if (goes_back) progress = go_back(*source, world);
  set_state(State::running);
  ViewSink sink(scene_, world, control_, frame_, on_news_,
                {.tools = options_.tools,
                 .wears_photographs = scene_.view.photographs > 0,
                 .frames_before = goes_back ? kept_.number : 0});
  FrameLoop* at = nullptr;
  const auto should_stop = [&] {
    while (!sink.may_go_on()) {
      if (sink.turn() != RunControl::Turn::keep) return true;
      keep(world, at->progress(), sink.number());
    }
    return false;
  };
  FrameLoop loop(*source, world, {.should_stop = should_stop});
  at = &loop;
  loop.go_on_from(progress);
  loop.add(sink);
  loop.run();
  if (sink.turn() != RunControl::Turn::go) return sink.turn();
  set_state(State::ended);
  RunControl::Turn turn = control_.wait_for_restart();
  for (; turn == RunControl::Turn::keep; turn = control_.wait_for_restart())
    keep(world, loop.progress(), sink.number());
  return turn;
}

}  // namespace tactus
