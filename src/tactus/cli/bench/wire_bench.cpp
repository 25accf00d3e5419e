#include "tactus/cli/bench/wire_bench.h"

#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

#include "bench.h"
#include "tactus/base/error.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live.h"
#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/rig/wire/photo_coder.h"

namespace tactus::bench {
namespace {

constexpr int kCameras = 8, kFilm = 30;

struct WireCase {
  const char *name, *what;
  double fps, seconds;
  bool photos = false;
};

double processor_s(int who) {
  rusage usage{};
  ::getrusage(who, &usage);
  const auto seconds = [](timeval t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// A port that nobody listens on: the clients must know it before the server is there.
int free_port() {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool ok = ::bind(fd, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  ::close(fd);
  if (!ok) throw Error("no free port on this computer");
  return ntohs(address.sin_port);
}

/// A second of a moving hand, as eight cameras of 640x480 pixels see it.
std::vector<FrameSet> film(bool colors) {
  SyntheticOptions options;
  options.shape.moving = true;
  options.depth = options.truth = false;
  options.colors = colors;
  SyntheticSource source(options);
  std::vector<FrameSet> frames(kFilm);
  for (FrameSet& frame : frames) source.next(frame);
  return frames;
}

/// One camera's program: at each beat its images are in memory, and go.
void send_film(const WireCase& c, const LiveCamera& camera, const std::string& address, const LiveKey& key,
               const std::vector<FrameSet>& frames, std::size_t number, double begin_s) {
  RigClient client(camera, address, key);
  PhotoCoder photos;
  CameraImages images;
  const auto ticks = static_cast<std::int64_t>(c.seconds * c.fps);
  for (std::int64_t tick = 0; tick < ticks; ++tick) {
    const double wait_s = begin_s + static_cast<double>(tick) / c.fps - now_s();
    if (wait_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
    const FrameSet& frame = frames[static_cast<std::size_t>(tick) % frames.size()];
    images.mask = frame.silhouettes[number];
    if (c.photos) photos.pack(frame.colors[number], images.mask, 85, images);
    client.put(images, tick, now_s());
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // until the last is gone
}

/// Clients are processes, as they are on the computers of cameras. Forked before the server has threads.
class Clients {
 public:
  Clients(const WireCase& c, const std::vector<LiveCamera>& cameras, const std::string& address,
          const std::vector<LiveKey>& keys, const std::vector<FrameSet>& frames, double begin_s) {
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const pid_t child = ::fork();
      if (child < 0) throw Error("no further process can be started");
      if (child > 0) {
        children_.push_back(child);
        continue;
      }
      int code = 0;
      try {
        send_film(c, cameras[i], address, keys[i], frames, i, begin_s);
      } catch (const std::exception&) {
        code = 1;
      }
      ::_exit(code);
    }
  }
  ~Clients() {
    for (const pid_t child : children_) ::waitpid(child, nullptr, 0);
  }
  Clients(const Clients&) = delete;
  Clients& operator=(const Clients&) = delete;

 private:
  std::vector<pid_t> children_;
};

nlohmann::json measure(const WireCase& c) {
  const std::vector<FrameSet> frames = film(c.photos);
  LiveSettings settings;
  settings.address = "tcp://127.0.0.1:" + std::to_string(free_port());
  settings.fps = c.fps;
  settings.sync = LiveSync::trigger;
  settings.deadline_s = 0.1;
  RigServer::Keys keys{make_live_key(kServerName, ""), {}};
  std::vector<LiveCamera> cameras;
  std::vector<LiveKey> client_keys;
  for (std::size_t i = 0; i < kCameras; ++i) {
    const BitMask& mask = frames[0].silhouettes[i];
    cameras.push_back({"cam" + std::to_string(i), {mask.width_px, mask.height_px}, 1, false});
    client_keys.push_back(make_live_key(cameras[i].name, keys.server.public_key));
    keys.clients.push_back({cameras[i].name, client_keys[i].public_key});
  }
  const double begin_s = now_s() + 1, clients_before_s = processor_s(RUSAGE_CHILDREN);
  std::vector<double> ms;
  std::int64_t masks = 0, complete = 0;
  const auto ticks = static_cast<std::int64_t>(c.seconds * c.fps),
             first_tick = static_cast<std::int64_t>(c.fps);
  double server_s = 0;
  {
    const Clients clients(c, cameras, settings.address, client_keys, frames, begin_s);
    RigServer server(cameras, settings, keys);
    LiveSet set;
    PhotoCoder photos;
    ColorImage photo;
    server_s = processor_s(RUSAGE_SELF);
    while (now_s() < begin_s + c.seconds + 0.2) {
      check_stop();
      if (!server.wait(set, now_s() + 0.1)) continue;
      // After the first second: connections are made, programs are loaded.
      if (set.tick >= first_tick) {
        ms.push_back(1e3 * (set.released_s - begin_s - static_cast<double>(set.tick) / c.fps));
        masks += std::count(set.is_in.begin(), set.is_in.end(), true);
        complete += set.is_complete ? 1 : 0;
      }
      for (std::size_t i = 0; c.photos && i < cameras.size(); ++i)
        photos.unpack(set.images[i], cameras[i].size_px, photo);
    }
    server_s = processor_s(RUSAGE_SELF) - server_s;
  }
  return {{"name", c.name},
          {"case", c.what},
          {"size", kCameras},
          {"devices", "cpu"},
          {"ms_p50", p(ms, 50)},
          {"ms_p99", p(ms, 99)},
          {"masks_per_s", static_cast<double>(masks) / (c.seconds - 1)},
          {"lost_masks", (ticks - first_tick) * kCameras - masks},
          {"complete", static_cast<double>(complete) / static_cast<double>(ticks - first_tick)},
          {"clients_cores", (processor_s(RUSAGE_CHILDREN) - clients_before_s) / c.seconds},
          {"server_cores", server_s / c.seconds}};
}

Rows run_wire(const std::string& /*devices*/) {
  if (!live_missing().empty()) throw Error("the benchmark 'wire' needs " + live_missing());
  return collect([](Rows& rows) {
    rows.push_back(measure({"capture to set", "30/s", 30, 10}));
    rows.push_back(measure({"masks per second", "125/s", 125, 10}));
    rows.push_back(measure({"eight cameras", "60/s", 60, 10}));
    if (PhotoCoder::missing().empty()) rows.push_back(measure({"colour crops", "30/s", 30, 10, true}));
  });
}

}  // namespace
}  // namespace tactus::bench

namespace tactus {

void add_wire_benchmark() { bench::add_benchmark({"wire", bench::run_wire}); }

}  // namespace tactus
