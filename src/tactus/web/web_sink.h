#pragma once
/// Shows a run to browsers and other programs while it runs.
#include <condition_variable>
#include <optional>
#include <thread>

#include "tactus/run/frame_loop.h"
#include "tactus/web/client_control.h"
#include "tactus/web/run_status.h"
#include "tactus/web/stream_scene.h"
#include "tactus/web/web_server.h"

namespace tactus {

/// Copies frames while somebody looks, and makes messages of them on a thread of its own; the newest frame
/// replaces one that waits. A run without viewers pays nothing.
///
///   WebSink web(StreamScene(scene, rig, assets, facts), {.server = parse_web_address("8090")});
///   do {
///     ... source and world, anew ...
///     FrameLoop loop(source, world, {.should_stop = [&] { return web.wait_for_turn(interrupted); }});
///     loop.go_on_from(web.begins_at(source, world, "scene.yaml"));
///     web.join(loop, world);
///     loop.run();
///   } while (web.stay(interrupted));
class WebSink final : public FrameSink {
 public:
  struct Options {
    WebSettings server;
    bool allows_control = false;
    bool keeps_pace = true;                       ///< off for live cameras
    bool waits_for_viewer = true;                 ///< before the first frame
    std::vector<SceneParameter> parameters = {};  ///< that viewers may set
    /// Memory for frames that were seen, where viewers have control.
    std::size_t past_bytes = 256'000'000;
    std::string why_not_again = {};  ///< "": viewers may simulate again from there
  };
  /// @throws Error as WebServer.
  WebSink(StreamScene scene, const Options& options);
  ~WebSink() override;

  std::string url() const { return server_->url(); }
  int port() const { return server_->port(); }
  int viewers() const { return server_->viewers(); }
  /// Where a run begins: where `progress` says, or after the frame that a viewer chose. Then the state is
  /// taken over. @param named before messages: the scene's file
  RunProgress begins_at(FrameSource& source, World& world, const std::string& named,
                        const RunProgress& progress = {});
  /// Before it: adds itself. Keeps references until the next call.
  void join(FrameLoop& loop, World& world);
  /// Frames of this run that were before its beginning.
  int frames_before() const { return frames_before_; }
  /// For FrameLoop::Options::should_stop: waits as RunControl does, and carries out requests.
  bool wait_for_turn(const std::function<bool()>& should_stop);
  void begin(const World& world, std::optional<int> frame_count) override;
  void frame(RunFrame& frame) override;
  void end(RunNotices& notices) override;
  /// After a run: until no viewer is left. @returns whether a viewer wants it again from a frame of the past
  bool stay(const std::function<bool()>& should_stop) const;

 private:
  void encode();
  void publish_state(const std::string& error = "");
  void take_state_change();
  static RunControl::Options control_options(const Options& options, WebSink& self);
  static WebPast::Options past_options(const Options& options, WebSink& self);
  static ClientControl::Options client_options(const Options& options, WebSink& self);

  StreamScene scene_;
  CreaseMemory creases_;  ///< of the encoder
  RunStatus status_;
  RunControl control_;
  StateSaver saver_;
  const bool has_past_;
  WebPast past_;
  ClientControl client_;
  std::unique_ptr<WebServer> server_;
  World* world_ = nullptr;
  FrameLoop* loop_ = nullptr;
  int frames_before_ = 0;
  std::mutex state_mutex_;  ///< texts of the state go out in the order in which they were made
  std::mutex mutex_;
  std::condition_variable changed_;
  struct Waiting {
    StreamFrame frame;
    int run = 0;  ///< WebPast::run
    std::shared_ptr<const PastState> state;
  };
  std::optional<Waiting> waiting_;
  bool closes_ = false;
  std::thread encoder_;  ///< last: it uses the others
};

}  // namespace tactus
