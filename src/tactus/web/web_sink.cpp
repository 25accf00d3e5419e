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
  made.state_changed = [&self] { self.publish_state(); };
  return made;
}

WebSink::WebSink(StreamScene scene, const Options& options)
    : scene_(std::move(scene)),
      status_(scene_.held()),
      control_(control_options(options, *this)),
      client_({options.allows_control, scene_.held(), options.parameters, scene_.grabbed()}, control_) {
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
  nlohmann::json json{{"state", RunControl::text(control_.state())}};
  if (!error.empty()) json["error"] = error;
  server_->publish_state(json_text(json));
}

void WebSink::begin(const World& /*world*/, std::optional<int> frame_count) {
  if (frame_count && *frame_count < kEndless) status_.set_frames_in_all(frame_count);
}

void WebSink::frame(RunFrame& frame) {
  control_.note_frame(frame.images.time_s, frame.report.dt_s);
  client_.let_go_of_old_grabs(now_s());
  if (const std::string errors = control_.apply(frame.world).errors; !errors.empty()) publish_state(errors);
  if (server_->viewers() == 0) return;
  const double captured_s = frame.images.captured_s > 0 ? frame.images.captured_s : frame.taken_at_s;
  StreamFrame shown{frame.snapshot(), frame.number, frame.images.time_s,
                    unix_now_s() - (now_s() - captured_s), status_.look(frame)};
  {
    const std::lock_guard lock(mutex_);
    waiting_ = std::move(shown);
  }
  changed_.notify_one();
}

void WebSink::end(RunNotices& /*notices*/) { control_.end(); }

void WebSink::stay(const std::function<bool()>& should_stop) const {
  while (viewers() > 0 && !(should_stop && should_stop()))
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

void WebSink::encode() {
  while (true) {
    std::optional<StreamFrame> next;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return closes_ || waiting_; });
      if (closes_) return;
      next.swap(waiting_);
    }
    server_->publish(std::make_shared<const std::string>(scene_.frame(*next, creases_)));
  }
}

}  // namespace tactus
