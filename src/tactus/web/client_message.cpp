#include "tactus/web/client_message.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/geom/maths/rotation.h"

namespace tactus {
namespace {

using Json = nlohmann::json;

/// Farther than any workspace: a pose that is not meant.
constexpr double kFar_m = 100;
/// A year of frames.
constexpr double kMostFrame = 1e9;

template <std::size_t n>
std::array<double, n> numbers(const Json& message, const char* key, double most) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_array() || found->size() != n)
    throw Error(std::string("'") + key + "': expected " + std::to_string(n) + " numbers");
  std::array<double, n> all{};
  for (std::size_t i = 0; i < n; ++i) {
    if (!(*found)[i].is_number())
      throw Error(std::string("'") + key + "': expected " + std::to_string(n) + " numbers");
    all[i] = (*found)[i].get<double>();
    if (!(std::abs(all[i]) <= most))
      throw Error(std::string("'") + key + "': " + number_text(all[i]) + ", expected -" + number_text(most) +
                  " to " + number_text(most));
  }
  return all;
}

std::string text_of(const Json& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_string() || found->get_ref<const std::string&>().empty())
    throw Error(std::string("'") + key + "': expected a name");
  return found->get<std::string>();
}

/// @returns `otherwise` where the key is absent.
bool flag_of(const Json& message, const char* key, bool otherwise) {
  const auto found = message.find(key);
  if (found == message.end()) return otherwise;
  if (!found->is_boolean()) throw Error(std::string("'") + key + "': expected true or false");
  return found->get<bool>();
}

double speed_of(const Json& message, const char* key, double otherwise) {
  const auto found = message.find(key);
  if (found == message.end()) return otherwise;
  if (!found->is_number() || !(found->get<double>() > 0))
    throw Error(std::string("'") + key + "': expected a speed > 0");
  return found->get<double>();
}

/// A whole number, from -most or from 0; none where the key is absent.
std::optional<int> whole_of(const Json& message, const char* key, bool is_signed) {
  const auto found = message.find(key);
  if (found == message.end()) return std::nullopt;
  const double least = is_signed ? -kMostFrame : 0;
  const double value = found->is_number() ? found->get<double>() : std::nan("");
  if (!(value >= least && value <= kMostFrame) || value != std::floor(value))
    throw Error(std::string("'") + key + "': expected a whole number, " + number_text(least) + " to " +
                number_text(kMostFrame));
  return static_cast<int>(value);
}

Rigidd pose_of(const Json& message) {
  const auto p = numbers<3>(message, "position_m", kFar_m);
  const auto q = numbers<4>(message, "quaternion", 1.001);
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(norm - 1) <= 1e-3))
    throw Error("'quaternion': its length is " + number_text(norm) + ", expected 1 (x, y, z, w)");
  Rigidd T;
  T.R = rotation_from_quaternion(q[3], q[0], q[1], q[2]);
  T.t = {p[0], p[1], p[2]};
  return T;
}

}  // namespace

ClientMessage parse_client_message(std::string_view text) {
  if (text.size() > kMostClientBytes)
    throw Error("a message of " + std::to_string(text.size()) + " bytes, at most " +
                std::to_string(kMostClientBytes));
  const Json message = Json::parse(text, nullptr, false);
  if (message.is_discarded() || !message.is_object()) throw Error("a message that is no JSON object");
  static const std::vector<std::string> kKnown{"pause", "run",     "step", "pose",  "set",
                                               "grab",  "release", "see",  "again", "got"};
  const std::string asked = text_of(message, "do");
  const auto found = std::find(kKnown.begin(), kKnown.end(), asked);
  if (found == kKnown.end())
    throw Error("'do': '" + printable(asked.substr(0, 16)) + "'" + suggestion(asked, kKnown));
  if (asked == "got")
    throw Error("'frames': expected a whole number from 1 on");  // frames_got takes the others
  ClientMessage read;
  read.kind = static_cast<ClientMessage::Kind>(found - kKnown.begin());
  if (read.kind == ClientMessage::Kind::pose) {
    read.name = text_of(message, "obstacle");
    read.T_world_obstacle = pose_of(message);
    read.is_put = flag_of(message, "put", read.is_put);
    read.most_m_s = speed_of(message, "most_m_s", read.most_m_s);
  }
  if (read.kind == ClientMessage::Kind::grab) {
    read.name = text_of(message, "body");
    const auto point = numbers<3>(message, "point_m", kFar_m),
               target = numbers<3>(message, "target_m", kFar_m);
    read.point_m = {point[0], point[1], point[2]};
    read.target_m = {target[0], target[1], target[2]};
  }
  if (read.kind == ClientMessage::Kind::set) {
    read.name = text_of(message, "parameter");
    const auto value = message.find("value");
    if (value == message.end() || !value->is_number()) throw Error("'value': expected a number");
    read.value = value->get<double>();
    if (!std::isfinite(read.value)) throw Error("'value': expected a finite number");
  }
  if (read.kind == ClientMessage::Kind::see) {
    read.frame = whole_of(message, "frame", false);
    read.steps = whole_of(message, "steps", true);
    if (read.frame.has_value() == read.steps.has_value())
      throw Error("'see': expected either 'frame' or 'steps'");
  }
  return read;
}

int frames_got(std::string_view text) {
  constexpr std::size_t kLongest = 64;
  if (text.size() > kLongest || text.find("\"got\"") == text.npos)
    return 0;  // most messages aren't read twice
  const Json message = Json::parse(text, nullptr, false);
  if (!message.is_object() || message.value("do", Json()) != "got") return 0;
  const auto frames = message.find("frames");
  if (frames == message.end()) return 1;
  return frames->is_number_integer()
             ? static_cast<int>(std::clamp<std::int64_t>(frames->get<std::int64_t>(), 0, 100))
             : 0;
}

}  // namespace tactus
