#pragma once
/// Shows a run to browsers and other programs while it runs.
#include <condition_variable>
#include <optional>
#include <thread>

#include "tactus/web/client_control.h"
#include "tactus/web/run_status.h"
#include "tactus/web/stream_scene.h"
#include "tactus/web/web_server.h"

namespace tactus {

/// Copies frames while somebody looks, and makes messages of them on a thread of its own; the newest frame
/// replaces one that waits. A run without viewers pays nothing.
///
///   WebSink web(StreamScene(scene, rig, assets, facts), {.server = parse_web_address("8090")});
///   FrameLoop loop(source, world, {.should_stop = [&] { return web.wait_for_turn(interrupted); }});
///   loop.add(web);
///   loop.run();
///   web.stay(interrupted);
class WebSink final : public FrameSink {
 public:
  struct Options {
    WebSettings server;
    bool allows_control = false;
    bool keeps_pace = true;                       ///< off for live cameras
    bool waits_for_viewer = true;                 ///< before the first frame
    std::vector<SceneParameter> parameters = {};  ///< that viewers may set
  };
  /// @throws Error as WebServer.
  WebSink(StreamScene scene, const Options& options);
  ~WebSink() override;

  std::string url() const { return server_->url(); }
  int viewers() const { return server_->viewers(); }
  /// For FrameLoop::Options::should_stop: waits as RunControl does.
  bool wait_for_turn(const std::function<bool()>& should_stop) {
    return control_.wait_for_turn(false, should_stop) == RunControl::Turn::stop;
  }
  void begin(const World& world, std::optional<int> frame_count) override;
  void frame(RunFrame& frame) override;
  void end(RunNotices& notices) override;
  /// After a run: until no viewer is left.
  void stay(const std::function<bool()>& should_stop) const;

 private:
  void encode();
  void publish_state(const std::string& error = "");
  static RunControl::Options control_options(const Options& options, WebSink& self);

  StreamScene scene_;
  CreaseMemory creases_;  ///< of the encoder
  RunStatus status_;
  RunControl control_;
  ClientControl client_;
  std::unique_ptr<WebServer> server_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<StreamFrame> waiting_;
  bool closes_ = false;
  std::thread encoder_;  ///< last: it uses the others
};

}  // namespace tactus
