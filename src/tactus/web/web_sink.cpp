#include "tactus/web/web_sink.h"

#include <chrono>

#include "tactus/web/json_text.h"

namespace tactus {
namespace {

/// Sources that nothing ends have a year of frames.
constexpr int kEndless = 100'000'000;

double unix_now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

RunControl::Options WebSink::control_options(const Options& options, WebSink& self) {
  RunControl::Options made;
  made.keeps_pace = options.keeps_pace;
  made.waits_for_viewer = options.waits_for_viewer;
  made.has_viewers = [&self] { return self.viewers() > 0; };
  made.state_changed = [&self] { self.take_state_change(); };
  return made;
}

WebPast::Options WebSink::past_options(const Options& options, WebSink& self) {
  return {.most_bytes = options.allows_control ? options.past_bytes : 0,
          .show = [&self](WebPast::Bytes message) { self.server_->publish(std::move(message)); },
          .changed = [&self] { self.publish_state(); }};
}

ClientControl::Options WebSink::client_options(const Options& options, WebSink& self) {
  return {.is_allowed = options.allows_control,
          .held = self.scene_.held(),
          .parameters = options.parameters,
          .grabbed = self.scene_.grabbed(),
          .past = &self.past_,
          .why_not_again = [&self] { return self.saver_.why_not(); }};
}

WebSink::WebSink(StreamScene scene, const Options& options)
    : scene_(std::move(scene)),
      status_(scene_.held(), scene_.facts().budget_s),
      control_(control_options(options, *this)),
      saver_(options.why_not_again),
      has_past_(options.allows_control && options.past_bytes > 0),
      past_(past_options(options, *this)),
      client_(client_options(options, *this), control_) {
  server_ =
      std::make_unique<WebServer>(options.server, scene_.setting(options.allows_control, options.parameters),
                                  [this](std::string_view text) {
                                    const std::string error = client_.handle(text);
                                    return error.empty() ? "" : json_text({{"error", error}});
                                  });
  publish_state();
  server_->listen();
  encoder_ = std::thread([this] { encode(); });
}

WebSink::~WebSink() {
  {
    const std::lock_guard lock(mutex_);
    closes_ = true;
  }
  changed_.notify_one();
  encoder_.join();
}

void WebSink::publish_state(const std::string& error) {
  const std::lock_guard lock(state_mutex_);
  nlohmann::json json{{"state", RunControl::text(control_.state())}};
  if (!error.empty()) json["error"] = error;
  if (const WebPast::Shown shown = past_.shown(); shown.last > 0) {
    nlohmann::json& past = json["past"] = {{"first", shown.first}, {"last", shown.last}};
    if (shown.seen > 0) past["seen"] = shown.seen;
    if (shown.again_from > 0) past["again_from"] = shown.again_from;
    if (const std::string why = saver_.why_not(); !why.empty()) past["why_not_again"] = why;
  }
  server_->publish_state(json_text(json));
}

/// When the run goes on, viewers see it.
void WebSink::take_state_change() {
  if (control_.state() == RunControl::State::running) past_.leave();
  publish_state();
}

RunProgress WebSink::begins_at(FrameSource& source, World& world, const std::string& named,
                               const RunProgress& progress) {
  if (!control_.goes_back()) return progress;
  control_.begin();
  const std::shared_ptr<const PastState> from = past_.go_back();
  {
    const std::lock_guard lock(mutex_);
    waiting_.reset();
  }
  const RunProgress taken = take_up(*from, source, world, named);
  control_.set_grab(std::nullopt);  // nobody holds that tissue now
  frames_before_ = from->number;
  status_.forget();
  publish_state();
  return taken;
}

void WebSink::join(FrameLoop& loop, World& world) {
  loop_ = &loop;
  world_ = &world;
  loop.add(*this);
}

bool WebSink::wait_for_turn(const std::function<bool()>& should_stop) {
  if (control_.wait_for_turn(false, should_stop) != RunControl::Turn::go) return true;
  client_.let_go_of_old_grabs(now_s());
  if (const std::string errors = control_.apply(*world_).errors; !errors.empty()) publish_state(errors);
  return false;
}

void WebSink::begin(const World& /*world*/, std::optional<int> frame_count) {
  if (frame_count && *frame_count < kEndless && frames_before_ == 0) status_.set_frames_in_all(frame_count);
}

void WebSink::frame(RunFrame& frame) {
  control_.note_frame(frame.images.time_s, frame.report.dt_s);
  if (server_->viewers() == 0) return;
  const bool is_paused = control_.is_paused();
  const double captured_s = frame.images.captured_s > 0 ? frame.images.captured_s : frame.taken_at_s;
  const int number = frame.number + frames_before_;
  Waiting shown{{frame.snapshot(), number, frame.images.time_s, unix_now_s() - (now_s() - captured_s),
                 status_.look(frame, is_paused)},
                past_.run(),
                nullptr};
  if (has_past_) shown.state = saver_.save(*world_, loop_->progress(), number, is_paused);
  {
    const std::lock_guard lock(mutex_);
    waiting_ = std::move(shown);
  }
  changed_.notify_one();
}

void WebSink::end(RunNotices& /*notices*/) {
  if (!control_.goes_back()) control_.end();
}

bool WebSink::stay(const std::function<bool()>& should_stop) const {
  while (!(should_stop && should_stop())) {
    if (control_.goes_back()) return true;
    if (viewers() == 0) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

void WebSink::encode() {
  while (true) {
    std::optional<Waiting> next;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return closes_ || waiting_; });
      if (closes_) return;
      next.swap(waiting_);
    }
    past_.add(std::make_shared<const std::string>(scene_.frame(next->frame, creases_)), next->frame.number,
              next->run, std::move(next->state));
    // While it runs, its past needs no telling with each frame.
    if (has_past_ && control_.state() != RunControl::State::running) publish_state();
  }
}

}  // namespace tactus
