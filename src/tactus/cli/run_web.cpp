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

RunFacts run_facts(const std::string& devices) {
  return {version_number(), commit_text(), machine_text(), devices};
}

}  // namespace

std::unique_ptr<WebSink> open_web_sink(const RunOptions& options, const Scene& scene, const Rig& rig,
                                       const BodyAssets& assets, World& world, const std::string& devices) {
  if (!options.shows_web) return nullptr;
  const bool is_live = scene.source.kind == SourceKind::live;
  WebSink::Options made{.server = parse_web_address(options.web),
                        .allows_control = options.web_control,
                        .keeps_pace = !is_live,
                        .waits_for_viewer = !is_live};
  if (options.web_control) {
    const auto parameters = world.parameters().of(ParameterEffect::next_frame);
    made.parameters.assign(parameters.begin(), parameters.end());
  }
  if (!options.web_token.empty()) made.server.token = read_token(options.web_token);
  if (!made.server.is_loopback() && made.server.token.empty()) made.server.token = make_web_token();
  if (!made.server.is_loopback())
    log_warning("--web " + made.server.address +
                " is not encrypted: who listens on the network sees the run and the token; rather keep to "
                "127.0.0.1 and forward it (ssh -L 8090:127.0.0.1:8090 HOST)");
  auto sink = std::make_unique<WebSink>(StreamScene(scene, rig, assets, run_facts(devices)), made);
  if (const std::string missing = web_page_missing(); !missing.empty())
    log_warning("--web: only the stream is served, without " + missing);
  log_info("open " + sink->url() + (is_live ? "" : "   (the run begins then; Ctrl-C ends it)"));
  return sink;
}

std::unique_ptr<ReplaySink> open_replay_sink(const RunOptions& options, const Scene& scene, const Rig& rig,
                                             const BodyAssets& assets, const std::string& devices) {
  if (options.report_path.empty()) return nullptr;
  return std::make_unique<ReplaySink>(StreamScene(scene, rig, assets, run_facts(devices)),
                                      options.report_path);
}

}  // namespace tactus
