#pragma once
/// The sinks of `tactus run` that browsers look at.
#include <memory>

#include "tactus/cli/run_flags.h"
#include "tactus/web/replay_sink.h"
#include "tactus/web/web_sink.h"

namespace tactus {

/// The sink of --web, which listens and says where; nullptr without the flag.
/// @throws Error naming the flag, when it can't listen or the program was built without it.
std::unique_ptr<WebSink> open_web_sink(const RunOptions& options, const Scene& scene, const Rig& rig,
                                       const BodyAssets& assets, World& world, const std::string& devices);

/// The sink of --report; nullptr without the flag. @throws Error naming the flag.
std::unique_ptr<ReplaySink> open_replay_sink(const RunOptions& options, const Scene& scene, const Rig& rig,
                                             const BodyAssets& assets, const std::string& devices);

}  // namespace tactus
