#include <cmath>
#include <nlohmann/json.hpp>

#include "tactus/rig/live.h"

namespace tactus {

namespace {
/// JSON has no NaN and no infinity, and readers of the status expect numbers.
double number(double v) { return std::isfinite(v) ? v : 0; }
}  // namespace

std::string live_status_json(const LiveStatus& status) {
  nlohmann::json json{
      {"sets", status.sets},
      {"complete_sets", status.complete_sets},
      {"unseen_sets", status.unseen_sets},
      {"socket_restarts", status.socket_restarts},
      {"refused_keys", status.refused_keys},
      {"refused_strangers", status.refused_strangers},
      {"release_ms", {{"p50", number(status.release_ms_p50)}, {"p99", number(status.release_ms_p99)}}},
      {"cameras", nlohmann::json::array()}};
  for (const LiveCameraStatus& c : status.cameras) {
    nlohmann::json refused = nlohmann::json::object();
    for (std::size_t r = 0; r < c.refused.size(); ++r) {
      if (c.refused[r] > 0) refused[refusal_text(static_cast<Refusal>(r))] = c.refused[r];
    }
    json["cameras"].push_back({{"name", c.name},
                               {"present", c.is_present},
                               {"packets_per_s", number(c.packets_per_s)},
                               {"bytes_per_s", number(c.bytes_per_s)},
                               {"skew_ms", number(c.skew_ms)},
                               {"drift_ppm", number(c.drift_ppm)},
                               {"coverage", number(c.coverage)},
                               {"packets", c.packets},
                               {"in_sets", c.in_sets},
                               {"lost", c.lost},
                               {"copies", c.copies},
                               {"replaced", c.replaced},
                               {"refused", std::move(refused)}});
  }
  return json.dump();
}

}  // namespace tactus
