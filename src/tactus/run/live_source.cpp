#include "tactus/run/live_source.h"
#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live_address.h"

#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"

namespace tactus {
namespace {

/// Longest that `next` waits for the first set before it looks whether it is still wanted.
constexpr double kFirst_s = 0.1;

RigFile read_live_rig(const std::string& path) {
  RigFile file = read_rig_file(path);
  for (const DepthRecording& depth : file.depths) file.rig.depth_cameras.push_back(depth.calibrated.camera);
  return file;
}

std::optional<RigServer::Keys> keys_of(const LiveSettings& settings, bool plain) {
  if (plain) return {};
  return live_keys(settings);
}

/// A camera that was added to the rig file after its keys were made.
void warn_of_cameras_without_keys(const std::vector<LiveCamera>& cameras, const RigServer::Keys& keys,
                                  const std::string& list) {
  for (const LiveCamera& camera : cameras) {
    const bool has_key = std::any_of(keys.clients.begin(), keys.clients.end(),
                                     [&](const LiveClient& c) { return c.name == camera.name; });
    if (!has_key)
      log_warning("camera '" + camera.name + "' has no key in '" + list +
                  "', so its client is refused: 'tactus keys RIG' makes one");
  }
}

}  // namespace

std::vector<LiveCamera> live_cameras(const RigFile& file) {
  std::vector<LiveCamera> cameras;
  for (std::size_t c = 0; c < file.calibrated.size(); ++c) {
    const CalibratedCamera& of = file.calibrated[c];
    const Camera& pinhole = file.rig.cameras[c];
    cameras.push_back(
        {pinhole.name, {pinhole.width_px, pinhole.height_px}, calibration_hash(of.camera, of.lens), false});
  }
  for (const DepthRecording& depth : file.depths) {
    const Camera& camera = depth.calibrated.camera;
    cameras.push_back({camera.name,
                       {camera.width_px, camera.height_px},
                       calibration_hash(camera, depth.calibrated.lens),
                       true});
  }
  return cameras;
}

RigServer::Keys live_keys(const LiveSettings& settings) {
  return {read_live_key(live_key_path(settings.keys_folder, kServerName)),
          read_live_clients(live_clients_path(settings.keys_folder))};
}

LiveSource::LiveSource(const std::string& rig_file, const LiveOptions& options)
    : file_(read_live_rig(rig_file)), options_(options) {
  const std::vector<LiveCamera> cameras = live_cameras(file_);
  const std::optional<RigServer::Keys> keys = keys_of(file_.live, options.plain);
  if (keys) warn_of_cameras_without_keys(cameras, *keys, live_clients_path(file_.live.keys_folder));
  server_ = std::make_unique<RigServer>(cameras, file_.live, keys);
  log_info("cameras of '" + rig_file + "' are expected on " + server_->address() +
           (options.plain ? ", without keys" : ""));
  if (is_every_interface(file_.live.address))
    log_info("every network of this computer leads there: 'live.address' may name one of its addresses");
  if (!options.depth) file_.rig.depth_cameras.clear();
  if (options.colors) photos_.resize(file_.rig.cameras.size());
}

NextFrame LiveSource::next(FrameSet& frame) {
  const double period_s = 1 / file_.live.fps, now = now_s();
  const double wait_s = !first_tick_ ? kFirst_s : (last_was_set_ ? 1.5 : 1.0) * period_s;
  const bool is_new = server_->wait(set_, std::max(now, (first_tick_ ? last_return_s_ : now) + wait_s));
  last_return_s_ = now_s();
  last_was_set_ = is_new;
  status_.clear();
  if (const std::int64_t restarts = server_->socket_restarts(); restarts != reported_restarts_) {
    reported_restarts_ = restarts;
    status_ = "the process of the live sockets was started again; cameras connect again by themselves";
  }
  if (!is_new) {
    if (first_tick_) ++reported_tick_;
    frame.time_s = static_cast<double>(reported_tick_) * period_s;
    return NextFrame::nothing_new;
  }
  if (!first_tick_) first_tick_ = set_.tick;
  take(frame);
  frame.tick = set_.tick - *first_tick_;
  reported_tick_ = std::max(reported_tick_, frame.tick);
  frame.time_s = static_cast<double>(reported_tick_) * period_s;
  frame.captured_s = set_.captured_s;
  frame.released_s = set_.released_s;
  const bool any = std::any_of(set_.is_in.begin(),
                               set_.is_in.begin() + static_cast<std::ptrdiff_t>(frame.silhouettes.size()),
                               [](bool in) { return in; });
  return any ? NextFrame::success : NextFrame::nothing_new;
}

/// A camera that missed the tick has an empty image.
void LiveSource::take(FrameSet& frame) {
  const std::vector<Camera>& cameras = file_.rig.cameras;
  frame.silhouettes.resize(cameras.size());
  frame.alphas.resize(options_.alphas ? cameras.size() : 0);
  frame.colors.resize(options_.colors ? cameras.size() : 0);
  frame.depths_m.resize(file_.rig.depth_cameras.size());
  std::string missed;
  for (std::size_t c = 0; c < set_.images.size(); ++c) {
    CameraImages& images = set_.images[c];
    const bool in = set_.is_in[c];
    const std::size_t d = c - cameras.size();
    if (c >= cameras.size()) {
      if (d >= frame.depths_m.size()) break;
      std::swap(frame.depths_m[d], images.depth_m);
      if (!in) frame.depths_m[d] = {};
      continue;
    }
    std::swap(frame.silhouettes[c], images.mask);
    if (!in) frame.silhouettes[c] = {};
    if (options_.alphas) std::swap(frame.alphas[c], images.alpha);
    if (options_.alphas && !in) frame.alphas[c] = {};
    if (options_.colors) {
      const Vec2i size_px{cameras[c].width_px, cameras[c].height_px};
      if (!in || images.photo_jpeg.empty() || !photos_[c].unpack(images, size_px, frame.colors[c]))
        frame.colors[c] = {};
    }
    if (!in) missed += (missed.empty() ? "camera '" : ", '") + cameras[c].name + "'";
  }
  if (!missed.empty()) status_ += (status_.empty() ? "" : "; ") + missed + " missed a tick";
}

}  // namespace tactus
