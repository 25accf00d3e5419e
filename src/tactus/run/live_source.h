#pragma once
/// A live rig as a source of frames.
#include "tactus/rig/live.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/rig/wire/photo_coder.h"

namespace tactus {

/// The cameras of a rig file as a server expects them: those of silhouettes, then those of depth.
std::vector<LiveCamera> live_cameras(const RigFile& file);
/// The server's key and the list of clients from the rig's folder of keys. @throws Error naming the file.
RigServer::Keys live_keys(const LiveSettings& settings);

struct LiveOptions {
  bool plain = false;  ///< no keys, on this computer alone
  bool colors = false, depth = true, alphas = false;
};

/// Listens as the rig file says. `next` waits for the first set; after it, a frame without new images follows
/// when nothing came for a period and a half, and then every period. Times are ticks times the period and
/// never go back.
class LiveSource final : public FrameSource {
 public:
  /// @throws Error naming the rig file or key; or when it can't listen.
  LiveSource(const std::string& rig_file, const LiveOptions& options);
  const Rig& rig() const override { return file_.rig; }
  std::optional<int> frame_count() const override { return {}; }
  std::optional<double> fps() const override { return file_.live.fps; }
  NextFrame next(FrameSet& frame) override;
  std::string status() const override { return status_; }
  std::string links_json() const override { return live_status_json(live_status()); }
  /// Replaces the workspace of the rig by the one that a scene asks for.
  void set_workspace(const Box3f& box_m) { file_.rig.workspace_m = box_m; }
  LiveStatus live_status() const { return server_->status(); }
  std::string address() const { return server_->address(); }

 private:
  void take(FrameSet& frame);
  RigFile file_;
  LiveOptions options_;
  std::unique_ptr<RigServer> server_;
  LiveSet set_;
  std::vector<PhotoCoder> photos_;
  std::optional<std::int64_t> first_tick_;
  std::int64_t reported_tick_ = 0;  ///< of the last frame, from the first set's
  double last_return_s_ = 0;
  std::int64_t reported_restarts_ = 0;  ///< of the sockets
  bool last_was_set_ = false;
  std::string status_;
};

}  // namespace tactus
