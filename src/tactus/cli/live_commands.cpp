// Verbs of live rigs: keys, client, serve, rig status.
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <thread>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"
#include "tactus/io/json_file.h"
#include "tactus/rig/client_camera.h"
#include "tactus/rig/live.h"
#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/wire/recording_file.h"
#include "tactus/run/live_source.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

struct LiveFlags {
  std::string camera, rig, key, address, record;
  bool plain = false;
  double seconds = 0;  ///< 0: until interrupted
  ClientCamera::Options of_camera;
};

void check_live() {
  if (!live_missing().empty())
    throw Error("live rigs need " + live_missing() + "; install it and build again");
}

/// The camera that a program sends for, and where to.
struct ClientSettings {
  RigFile file;
  LiveCamera camera;
  std::string address;
  std::optional<LiveKey> key;
};

ClientSettings client_settings(const LiveFlags& flags) {
  ClientSettings s{read_rig_file(flags.rig), {}, {}, {}};
  std::vector<std::string> names;
  for (const LiveCamera& c : live_cameras(s.file)) {
    names.push_back(c.name);
    if (c.name == flags.camera) s.camera = c;
  }
  if (s.camera.name.empty())
    throw usage_error(flags.rig + ": no camera '" + flags.camera + "'" + suggestion(flags.camera, names));
  s.address = flags.address.empty() ? s.file.live.address : flags.address;
  if (!flags.plain)
    s.key =
        read_live_key(flags.key.empty() ? live_key_path(s.file.live.keys_folder, flags.camera) : flags.key);
  return s;
}

void make_keys(const LiveFlags& flags) {
  check_live();
  const RigFile file = read_rig_file(flags.rig);
  const std::string& folder = file.live.keys_folder;
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error)) throw Error("can't make the folder '" + folder + "'");
  ::chmod(folder.c_str(), 0700);
  // Existing keys stay: a camera that is added later gets its key, and the others keep theirs.
  const auto known = [&](const std::string& path) { return fs::exists(fs::symlink_status(path, error)); };
  const std::string server_path = live_key_path(folder, kServerName);
  if (!known(server_path)) write_live_key(server_path, make_live_key(kServerName, ""));
  const LiveKey server = read_live_key(server_path);
  std::vector<LiveClient> clients;
  std::vector<std::string> names{kStatusName};
  for (const LiveCamera& camera : live_cameras(file)) names.push_back(camera.name);
  for (const std::string& name : names) {
    const std::string path = live_key_path(folder, name);
    if (name.find('/') != std::string::npos || name == kServerName)
      throw usage_error(flags.rig + ": camera '" + name +
                        "' can't have a key file of its name; expected another name");
    const bool is_new = !known(path);
    if (is_new) write_live_key(path, make_live_key(name, server.public_key));
    clients.push_back({name, read_live_key(path).public_key});
    std::printf("%-12s %s%s\n", name.c_str(), path.c_str(), is_new ? "" : "  (as it was)");
  }
  write_live_clients(live_clients_path(folder), clients);
  std::printf("\nGive each computer of a camera its one file; server.key and clients.keys stay here.\n");
}

/// A tick of the computer's own clock: computers whose clocks agree play the same frame.
struct Beat {
  std::int64_t number = 0;
  double at_s = 0;  ///< on the clock of now_s()
};
double system_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}
/// The next, or the newest where the system wakes us later than that. A film's camera was not late then: its
/// images are of the beat. None when the client ends before.
std::optional<Beat> wait_for_beat(double fps, double end_s) {
  constexpr double kMostSleep_s = 0.2;  // between beats of minutes, an interruption is noticed
  const auto next = static_cast<std::int64_t>(system_s() * fps) + 1;
  const double at_s = static_cast<double>(next) / fps;
  double now = system_s();
  for (; now < at_s; now = system_s()) {
    if (interrupted() || now_s() >= end_s) return {};
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(at_s - now, kMostSleep_s)));
  }
  const std::int64_t number = std::max(next, static_cast<std::int64_t>(now * fps));
  return Beat{number, now_s() - std::max(now - static_cast<double>(number) / fps, 0.0)};
}

/// Says once when images are there and nobody takes or refuses them, and once when that is over.
class Hearing {
 public:
  void watch(const RigClient::Status& status, const std::string& address) {
    const std::int64_t answers = std::accumulate(status.refused.begin(), status.refused.end(), status.taken);
    const std::int64_t images = status.sent + status.replaced;
    const double now = now_s();
    if (answers != answers_ || images_ == 0) {
      if (is_alone_) log_info(address + " answers");
      is_alone_ = false;
      answers_ = answers;
      images_ = images;
      since_s_ = now;
    } else if (!is_alone_ && images > images_ + 1 && now - since_s_ > kPatience_s) {
      is_alone_ = true;
      log_warning(
          "nobody answers at " + address +
          ": is 'tactus run' or 'tactus serve' there, with the same keys? This client goes on trying");
    }
  }

 private:
  static constexpr double kPatience_s = 3;
  std::int64_t answers_ = 0, images_ = 0;
  double since_s_ = 0;
  bool is_alone_ = false;
};

/// Reports refusals once a reason.
void report_refusals(const RigClient::Status& status, RefusalCounts& reported) {
  for (std::size_t r = 0; r < reported.size(); ++r) {
    const auto why = static_cast<Refusal>(r);
    if (status.refused[r] > 0 && reported[r] == 0)
      log_warning(std::string("the server refuses packets: ") + refusal_text(why) +
                  " (docs/wire.md says what that means)");
    reported[r] = status.refused[r];
  }
}

void run_client(const LiveFlags& flags) {
  check_live();
  const ClientSettings s = client_settings(flags);
  const std::unique_ptr<ClientCamera> camera =
      open_client_camera(s.file, flags.rig, flags.camera, flags.of_camera);
  RigClient client(s.camera, s.address, s.key);
  log_info("camera '" + s.camera.name + "' sends to " + s.address);
  const LiveSettings& live = s.file.live;
  RefusalCounts reported{};
  Hearing hearing;
  CameraImages images;
  std::string trouble;
  const double end_s = flags.seconds > 0 ? now_s() + flags.seconds : HUGE_VAL;
  while (!interrupted() && now_s() < end_s) {
    std::int64_t number = 0;
    double captured_s = 0;
    if (live.sync == LiveSync::software) {
      const auto trigger = client.wait_trigger(now_s() + 0.2);
      if (!trigger) continue;
      number = *trigger;
      captured_s = now_s();
    } else if (!camera->has_own_pace()) {
      const std::optional<Beat> beat = wait_for_beat(live.fps, end_s);
      if (!beat) break;
      number = beat->number;
      captured_s = beat->at_s;
    }
    const std::string why = camera->grab(number, images);
    number = camera->number().value_or(number);
    if (why.empty())
      client.put(images, live.sync == LiveSync::time ? PacketHead::kNoTrigger : number,
                 camera->has_own_pace() ? now_s() : captured_s);
    else
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    if (why != trouble && !why.empty()) log_warning(why);
    trouble = why;
    report_refusals(client.status(), reported);
    hearing.watch(client.status(), s.address);
  }
  const RigClient::Status status = client.status();
  std::printf("camera '%s': %lld packets sent, %lld taken, %lld replaced by newer ones\n",
              s.camera.name.c_str(), static_cast<long long>(status.sent),
              static_cast<long long>(status.taken), static_cast<long long>(status.replaced));
}

void print_status(const nlohmann::json& status) {
  std::printf(
      "%lld sets, %lld complete, %lld not looked at; capture to release p50 %.1f ms, p99 %.1f ms; refused: "
      "%lld keys, %lld strangers; sockets started again: %lld\n",
      status["sets"].get<long long>(), status["complete_sets"].get<long long>(),
      status["unseen_sets"].get<long long>(), status["release_ms"]["p50"].get<double>(),
      status["release_ms"]["p99"].get<double>(), status["refused_keys"].get<long long>(),
      status["refused_strangers"].get<long long>(), status["socket_restarts"].get<long long>());
  std::printf("%-12s %8s %8s %9s %9s %9s %8s %8s %8s  %s\n", "camera", "per s", "kB/s", "skew ms",
              "drift ppm", "coverage", "lost", "replaced", "copies", "refused");
  for (const nlohmann::json& c : status["cameras"]) {
    std::string refused;
    for (const auto& [reason, count] : c["refused"].items())
      refused += (refused.empty() ? "" : ", ") + reason + " " + std::to_string(count.get<long long>());
    std::printf("%-12s %8.1f %8.1f %9.2f %9.1f %8.1f%% %8lld %8lld %8lld  %s%s\n",
                c["name"].get<std::string>().c_str(), c["packets_per_s"].get<double>(),
                c["bytes_per_s"].get<double>() / 1e3, c["skew_ms"].get<double>(),
                c["drift_ppm"].get<double>(), 100 * c["coverage"].get<double>(), c["lost"].get<long long>(),
                c["replaced"].get<long long>(), c["copies"].get<long long>(), refused.c_str(),
                c["present"].get<bool>() ? "" : "  not here");
  }
}

void serve(const LiveFlags& flags) {
  check_live();
  LiveSource source(flags.rig,
                    {.plain = flags.plain, .colors = !flags.record.empty(), .alphas = !flags.record.empty()});
  std::optional<RecordingWriter> recorder;
  if (!flags.record.empty()) recorder.emplace(flags.record, source.rig(), source.fps());
  const double begin_s = now_s();
  double reported_s = begin_s;
  bool any = false;
  FrameSet frame;
  while (!interrupted() && (flags.seconds <= 0 || now_s() - begin_s < flags.seconds)) {
    const NextFrame next = source.next(frame);
    any = any || next == NextFrame::success;
    if (recorder && any) recorder->add(next, frame, source.status());
    if (now_s() - reported_s < 1) continue;
    reported_s = now_s();
    print_status(nlohmann::json::parse(live_status_json(source.live_status())));
    std::fflush(stdout);
  }
  if (recorder) recorder->finish();
  print_status(nlohmann::json::parse(live_status_json(source.live_status())));
}

void ask_status(const LiveFlags& flags, const std::string& json_path) {
  check_live();
  const RigFile file = read_rig_file(flags.rig);
  std::optional<LiveKey> key;
  if (!flags.plain) key = read_live_key(live_key_path(file.live.keys_folder, kStatusName));
  const std::string address = flags.address.empty() ? file.live.address : flags.address;
  const auto text = ask_live_status(address, key, 3);
  if (!text)
    throw Error("nobody answers at " + address +
                ": is 'tactus run' or 'tactus serve' there, with the same keys?");
  try {
    const nlohmann::json status = nlohmann::json::parse(*text);
    if (json_path.empty()) return print_status(status);
    write_json_file(json_path, status);
  } catch (const nlohmann::json::exception&) {
    throw Error("what answers at " + address +
                " sends no status that this version reads: is the server's another?");
  }
}

void add_plain(CLI::App& command, LiveFlags& flags) {
  command.add_flag("--plain", flags.plain, "without keys, on this computer alone");
}

/// The fault of a number of seconds; "" where there is none.
std::string a_duration(const std::string& text) {
  char* end = nullptr;
  const double seconds = std::strtod(text.c_str(), &end);
  if (end != text.c_str() && *end == 0 && std::isfinite(seconds) && seconds > 0) return "";
  return "'" + text + "', expected seconds above 0";
}

}  // namespace

void add_keys_command(CLI::App& app) {
  auto flags = std::make_shared<LiveFlags>();
  CLI::App* command =
      app.add_subcommand("keys", "Make the keys of a live rig: one for the server, one for each camera");
  command->add_option("rig", flags->rig, "rig file; its 'live.keys' says where they go")->required();
  command->footer("Example:\n  tactus keys film/rig.yaml");
  command->callback([flags] { make_keys(*flags); });
}

void add_client_command(CLI::App& app) {
  auto flags = std::make_shared<LiveFlags>();
  CLI::App* command =
      app.add_subcommand("client", "Send what a camera sees to the computer that reconstructs");
  command->add_option("camera", flags->camera, "its name in the rig file")->required();
  command->add_option("rig", flags->rig, "rig file")->required();
  command->add_option("--key", flags->key, "key file (default: CAMERA.key in the rig's folder of keys)");
  command->add_option("--server", flags->address, "tcp://HOST:PORT (default: the rig file's live.address)");
  command->add_option("--device", flags->of_camera.device,
                      "/dev/videoN, aravis:ID or the URL of a stream, instead of the rig file's");
  command->add_flag("--photos", flags->of_camera.photos, "send photographs of the silhouettes' boxes, too");
  command->add_flag("--alpha", flags->of_camera.alpha,
                    "send how much of each pixel at the contour the subject covers, too (devices and films)");
  command->add_option("--quality", flags->of_camera.photo_quality, "of their JPEG")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_option("--seconds", flags->seconds, "stop after so long")->check(a_duration);
  add_plain(*command, *flags);
  command->footer(
      "A camera without a device plays its recording (mask or video of the rig file), over and over.\n"
      "Examples:\n  tactus client cam0 rig.yaml --key cam0.key --server tcp://192.168.1.2:7447\n"
      "  tactus client cam0 film/rig.yaml --plain");
  command->callback([flags] { run_client(*flags); });
}

void add_serve_command(CLI::App& app) {
  auto flags = std::make_shared<LiveFlags>();
  CLI::App* command = app.add_subcommand("serve", "Receive a live rig without physics: watch it, record it");
  command->add_option("rig", flags->rig, "rig file")->required();
  command->add_option("--record", flags->record, "file to make of all sets");
  command->add_option("--seconds", flags->seconds, "stop after so long")->check(a_duration);
  add_plain(*command, *flags);
  command->footer("Example:\n  tactus serve rig.yaml --record calibration.rec --seconds 60");
  command->callback([flags] { serve(*flags); });
}

void add_rig_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("rig", "A live rig that runs: status");
  command->require_subcommand(1);
  auto flags = std::make_shared<LiveFlags>();
  auto json_path = std::make_shared<std::string>();
  CLI::App* status = command->add_subcommand("status", "Who is there, rate, skew, losses, what was refused");
  status->add_option("rig", flags->rig, "rig file")->required();
  status->add_option("--server", flags->address, "tcp://HOST:PORT (default: the rig file's live.address)");
  add_output(*status, "--json", *json_path, "the same as JSON (-: standard output)");
  add_plain(*status, *flags);
  status->footer("Example:\n  tactus rig status rig.yaml");
  status->callback([flags, json_path] { ask_status(*flags, *json_path); });
}

}  // namespace tactus
