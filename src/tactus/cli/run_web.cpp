#include "tactus/cli/run_web.h"

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/read_file.h"
#include "tactus/cli/version.h"
#include "tactus/rig/live_address.h"
#include "tactus/web/web_files.h"

namespace tactus {
namespace {

constexpr std::size_t kShortestToken = 16, kLongestToken = 100;

/// The word in a file: letters and digits alone, as it stands in an address.
std::string read_token(const std::string& path) {
  std::string token = read_text(path, 4096);
  while (!token.empty() && (token.back() == '\n' || token.back() == '\r')) token.pop_back();
  const bool is_plain = token.find_first_not_of(
                            "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_") == token.npos;
  if (!is_plain || token.size() < kShortestToken || token.size() > kLongestToken)
    throw Error("--web-token '" + path + "': expected one word of " + std::to_string(kShortestToken) +
                " to " + std::to_string(kLongestToken) +
                " letters, digits, - or _ (openssl rand -hex 16 makes one)");
  return token;
}

/// Files of a run hold each frame once, and a budget follows the clock.
std::string why_not_again(const RunOptions& options, const Scene& scene) {
  if (scene.source.kind == SourceKind::live) return "live cameras can't give their frames again";
  for (const auto& [flag, value] :
       {std::pair{"--json", &options.json_path}, std::pair{"--report", &options.report_path},
        std::pair{"--record", &options.record_path}, std::pair{"--checkpoint", &options.checkpoint_path},
        std::pair{"--budget", &options.budget}})
    if (!value->empty()) return std::string("a run with ") + flag + " goes forward only";
  return writes_into_folder(options, scene)
             ? "a run that writes pictures or meshes goes forward only: use --view none"
             : "";
}

RunFacts run_facts(const RunOptions& options, const std::string& devices) {
  return {version_number(), commit_text(), machine_text(), devices, parse_budget_s(options.budget)};
}

}  // namespace

std::unique_ptr<WebSink> open_web_sink(const RunOptions& options, const Scene& scene, const Rig& rig,
                                       const BodyAssets& assets, World& world, const std::string& devices) {
  if (!options.shows_web) return nullptr;
  const bool is_live = scene.source.kind == SourceKind::live;
  WebSink::Options made{.server = parse_web_address(options.web),
                        .allows_control = options.web_control,
                        .keeps_pace = !is_live,
                        .waits_for_viewer = !is_live,
                        .past_bytes = options.web_past_MB * 1'000'000,
                        .why_not_again = why_not_again(options, scene)};
  if (options.web_control) {
    const auto parameters = world.parameters().of(ParameterEffect::next_frame);
    made.parameters.assign(parameters.begin(), parameters.end());
  }
  if (!options.web_token.empty()) made.server.token = read_token(options.web_token);
  if (!options.web_name.empty()) made.server.name = parse_web_name(options.web_name);
  if (made.server.needs_token() && made.server.token.empty()) made.server.token = make_web_token();
  if (!made.server.is_loopback())
    log_warning("--web " + made.server.address +
                " is not encrypted: who listens on the network sees the run and the token; rather keep to "
                "127.0.0.1 and forward it (ssh -L 8090:127.0.0.1:8090 HOST)");
  auto sink = std::make_unique<WebSink>(StreamScene(scene, rig, assets, run_facts(options, devices)), made);
  if (const std::string missing = web_page_missing(); !missing.empty())
    log_warning("--web: only the stream is served, without " + missing);
  if (!made.server.name.empty())
    log_info("your TLS server at " + made.server.name + " should pass viewers on to " + made.server.address +
             ":" + std::to_string(sink->port()));
  log_info("open " + sink->url() + (is_live ? "" : "   (the run begins then; Ctrl-C ends it)"));
  return sink;
}

std::unique_ptr<ReplaySink> open_replay_sink(const RunOptions& options, const Scene& scene, const Rig& rig,
                                             const BodyAssets& assets, const std::string& devices) {
  if (options.report_path.empty()) return nullptr;
  return std::make_unique<ReplaySink>(StreamScene(scene, rig, assets, run_facts(options, devices)),
                                      options.report_path);
}

}  // namespace tactus
