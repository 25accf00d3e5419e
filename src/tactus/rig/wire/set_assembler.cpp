#include "tactus/rig/wire/set_assembler.h"

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

/// Part of a capture's distance from its beat that the beat follows in a period.
constexpr double kPhaseGain = 0.01;
/// A camera keeps its beats up to so many periods off.
constexpr double kStays = 0.75;
/// A camera's clock, right or not, takes at most this part of the deadline from the others.
constexpr double kMostAge = 0.5;
/// A trigger's number is ahead when it is so much more than another camera's last one and the time since: one
/// that counts one too many is found though captures are 0.3 ticks off.
constexpr double kAhead = 0.7;
/// Triggers are steady when so many times in a row the time to the next one was like the last, and no shorter
/// than this, in periods: more packets a second are refused.
constexpr int kSteady = 15;
constexpr double kLike = 0.4, kShortestStep = 0.125;
/// Ticks beyond are none: sums of two of them neither overflow nor lose one.
constexpr std::int64_t kMostTick = std::int64_t{1} << 53;

std::int64_t clamped_tick(std::int64_t tick) { return std::clamp(tick, -kMostTick, kMostTick); }
/// The nearest whole number of periods.
std::int64_t ticks(double periods) {
  const auto most = static_cast<double>(kMostTick);
  return std::isnan(periods) ? 0 : std::llround(std::clamp(periods, -most, most));
}

}  // namespace

SetAssembler::SetAssembler(const Options& options) : options_(options), slots_(kSlots) {
  const auto cameras = static_cast<std::size_t>(options.cameras);
  for (Slot& slot : slots_) {
    slot.is_reserved.resize(cameras);
    slot.is_in.resize(cameras);
  }
  heard_.resize(cameras);
}

double SetAssembler::beat_s(std::int64_t tick) const {
  return phase_s_ + static_cast<double>(tick) * options_.period_s;
}

std::int64_t SetAssembler::nearest_beat(double captured_s) const {
  return ticks((captured_s - phase_s_) / options_.period_s);
}

std::int64_t SetAssembler::tick_of(const Arrival& arrival) {
  if (options_.by_trigger) return clamped_tick(arrival.trigger);
  const double period_s = options_.period_s;
  if (!has_phase_) {
    has_phase_ = true;
    phase_s_ = arrival.captured_s;
  }
  std::int64_t tick = nearest_beat(arrival.captured_s);
  const Heard& heard = heard_[static_cast<std::size_t>(arrival.camera)];
  if (heard.ever) {
    const std::int64_t next =
        clamped_tick(heard.tick + ticks((arrival.captured_s - heard.captured_s) / period_s));
    if (std::abs(arrival.captured_s - beat_s(next)) <= kStays * period_s) tick = next;
  }
  // By the server's clock: a camera's own may say anything.
  const double weight =
      heard.ever ? std::clamp((arrival.arrived_s - heard.arrived_s) / period_s, 0.0, 1.0) : 1;
  phase_s_ += kPhaseGain * weight * (arrival.captured_s - beat_s(tick));
  return tick;
}

bool SetAssembler::is_present(int camera, double now_s) const {
  const Heard& heard = heard_[static_cast<std::size_t>(camera)];
  return heard.ever && now_s - heard.arrived_s <= options_.absent_s;
}

bool SetAssembler::most_agree(const Arrival& arrival, std::int64_t tick) const {
  int present = 0, agree = 0;
  for (int c = 0; c < options_.cameras; ++c) {
    if (!is_present(c, arrival.arrived_s)) continue;
    ++present;
    if (std::abs(heard_[static_cast<std::size_t>(c)].tick - tick) < kOpen) ++agree;
  }
  return 2 * agree > present;
}

/// Cameras whose triggers are steady say when the next is due, which is not the rig's period everywhere.
/// Where triggers come when they like, nobody can tell.
bool SetAssembler::is_ahead(const Arrival& arrival, std::int64_t tick) const {
  if (!options_.by_trigger) return false;
  int present = 1, ahead = 0;
  for (int c = 0; c < options_.cameras; ++c) {
    if (c == arrival.camera || !is_present(c, arrival.arrived_s)) continue;
    ++present;
    const Heard& heard = heard_[static_cast<std::size_t>(c)];
    if (heard.steady < kSteady) continue;
    const double passed = (arrival.captured_s - heard.captured_s) / heard.step_s;
    if (static_cast<double>(tick - heard.tick) > passed + kAhead) ++ahead;
  }
  return 2 * ahead > present;
}

void SetAssembler::hear(const Arrival& arrival, std::int64_t tick) {
  Heard& heard = heard_[static_cast<std::size_t>(arrival.camera)];
  if (heard.ever && tick > heard.tick) {
    const double step_s = (arrival.captured_s - heard.captured_s) / static_cast<double>(tick - heard.tick);
    const bool is_like = step_s >= kShortestStep * options_.period_s &&
                         std::abs(step_s - heard.step_s) <= kLike * heard.step_s;
    heard.steady = is_like ? std::min(heard.steady + 1, kSteady) : 0;
    heard.step_s = step_s;
  }
  heard.ever = true;
  heard.tick = tick;
  heard.captured_s = arrival.captured_s;
  heard.arrived_s = arrival.arrived_s;
}

SetAssembler::Slot* SetAssembler::oldest() {
  Slot* first = nullptr;
  for (Slot& slot : slots_) {
    if (slot.state == State::open && (first == nullptr || slot.tick < first->tick)) first = &slot;
  }
  return first;
}
const SetAssembler::Slot* SetAssembler::oldest() const { return const_cast<SetAssembler*>(this)->oldest(); }

SetAssembler::Slot* SetAssembler::open_slot(std::int64_t tick) {
  Slot* free = nullptr;
  int open = 0;
  for (Slot& slot : slots_) {
    if (slot.state == State::open && slot.tick == tick) return &slot;
    if (slot.state == State::open) ++open;
    if (slot.state == State::free) free = &slot;
  }
  if (free == nullptr || open == kOpen) return nullptr;
  free->state = State::open;
  free->tick = tick;
  free->in = 0;
  free->captured_s = 0;
  free->is_reserved.assign(free->is_reserved.size(), false);
  free->is_in.assign(free->is_in.size(), false);
  return free;
}

SetAssembler::Place SetAssembler::admit(const Arrival& arrival) {
  Place place;
  place.camera = arrival.camera;
  const auto camera = static_cast<std::size_t>(arrival.camera);
  const std::int64_t tick = tick_of(arrival);
  hear(arrival, tick);
  const bool is_far = is_anchored_ && (tick > newest_ + kOpen || tick < newest_ - kOpen);
  if (!is_anchored_ || (is_far && most_agree(arrival, tick))) {
    for (Slot& slot : slots_) {
      if (slot.state == State::open) slot.state = State::free;
    }
    is_anchored_ = true;
    newest_ = tick;
    released_ = tick - 1;
  } else if (tick > newest_ + kOpen || is_ahead(arrival, tick)) {
    place.refusal = Refusal::ahead;
    return place;
  }
  if (tick <= released_) {
    place.refusal = Refusal::late;
    return place;
  }
  Slot* slot = open_slot(tick);
  if (slot == nullptr) {
    place.refusal = Refusal::ahead;
    return place;
  }
  newest_ = std::max(newest_, tick);
  if (slot->is_reserved[camera]) {
    place.refusal = Refusal::repeated;
    return place;
  }
  const bool is_first =
      std::find(slot->is_reserved.begin(), slot->is_reserved.end(), true) == slot->is_reserved.end();
  slot->is_reserved[camera] = true;
  if (is_first) {
    slot->captured_s =
        std::clamp(arrival.captured_s, arrival.arrived_s - kMostAge * options_.deadline_s, arrival.arrived_s);
    slot->deadline_s = slot->captured_s + options_.deadline_s;
  }
  place.slot = static_cast<int>(slot - slots_.data());
  return place;
}

void SetAssembler::fill(const Place& place) {
  Slot& slot = slots_[static_cast<std::size_t>(place.slot)];
  slot.is_in[static_cast<std::size_t>(place.camera)] = true;
  ++slot.in;
  trust(place.camera);
}

std::optional<double> SetAssembler::next_deadline_s() const {
  const Slot* slot = oldest();
  return slot == nullptr ? std::nullopt : std::optional<double>(slot->deadline_s);
}

std::optional<SetAssembler::Released> SetAssembler::release(double now_s, Until until) {
  Slot* slot = oldest();
  if (slot == nullptr) return {};
  bool has_all_present = slot->in > 0;
  for (int c = 0; c < options_.cameras; ++c)
    has_all_present = has_all_present &&
                      (slot->is_in[static_cast<std::size_t>(c)] || is_doubted(c) || !is_present(c, now_s));
  if (!has_all_present && (until == Until::whole || now_s < slot->deadline_s)) return {};
  for (int c = 0; c < options_.cameras; ++c) {
    Heard& heard = heard_[static_cast<std::size_t>(c)];
    if (!slot->is_in[static_cast<std::size_t>(c)] && heard.failures < kFailures) ++heard.failures;
  }
  released_ = slot->tick;
  slot->state = State::released;
  ++counts_.released;
  const bool is_complete = slot->in == options_.cameras;
  counts_.complete += is_complete ? 1 : 0;
  return Released{slot->tick, slot->captured_s, static_cast<int>(slot - slots_.data()), is_complete};
}

}  // namespace tactus
