#include "tactus/base/timing.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "tactus/base/safe_file.h"

namespace tactus {

double percentile(std::vector<double> samples, double p) {
  if (samples.empty()) return 0;
  std::sort(samples.begin(), samples.end());
  const double at = p / 100.0 * static_cast<double>(samples.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, samples.size() - 1);
  return samples[low] + (at - static_cast<double>(low)) * (samples[high] - samples[low]);
}

void Timings::begin_frame() {
  const std::lock_guard lock(mutex_);
  ++frame_;
}

void Timings::add(const std::string& stage, double begin_s, double end_s, int track) {
  const std::lock_guard lock(mutex_);
  auto [it, fresh] = samples_.try_emplace(stage);
  Samples& samples = it->second;
  if (fresh) {
    order_.push_back(stage);
    samples.ms.resize(kMostSamples);  // all of its memory now: a run of an hour takes no more
    samples.ms.clear();
  }
  const double ms = (end_s - begin_s) * 1e3;
  const bool is_same_frame = frame_ > 0 && std::exchange(samples.frame, frame_) == frame_;
  if (is_same_frame) {
    samples.ms[samples.newest] += ms;
  } else if (samples.ms.size() < kMostSamples) {
    samples.newest = samples.ms.size();
    samples.ms.push_back(ms);
  } else {
    samples.newest = (samples.newest + 1) % kMostSamples;
    samples.ms[samples.newest] = ms;
  }
  if (keep_trace_ && events_.size() < kMostEvents) events_.push_back({stage, begin_s, end_s, track});
}

double Timings::last_ms(const std::string& stage) const {
  const std::lock_guard lock(mutex_);
  const auto it = samples_.find(stage);
  return it == samples_.end() ? 0 : it->second.ms[it->second.newest];
}

double Timings::percentile_ms(const std::string& stage, double p) const {
  const std::lock_guard lock(mutex_);
  const auto it = samples_.find(stage);
  return it == samples_.end() ? 0 : percentile(it->second.ms, p);
}

std::size_t Timings::count(const std::string& stage) const {
  const std::lock_guard lock(mutex_);
  const auto at = samples_.find(stage);
  return at == samples_.end() ? 0 : at->second.ms.size();
}

std::vector<std::string> Timings::stages() const {
  const std::lock_guard lock(mutex_);
  return order_;
}

void Timings::write_trace(const std::string& path) const {
  const std::lock_guard lock(mutex_);
  std::ostringstream out;
  out << "[";
  const double start_s = events_.empty() ? 0 : events_.front().begin_s;
  for (std::size_t i = 0; i < events_.size(); ++i) {
    const Event& e = events_[i];
    out << (i == 0 ? "\n" : ",\n") << R"({"name":")" << e.stage << R"(","ph":"X","pid":0,"tid":)" << e.track
        << R"(,"ts":)" << (e.begin_s - start_s) * 1e6 << R"(,"dur":)" << (e.end_s - e.begin_s) * 1e6 << "}";
  }
  out << "\n]\n";
  write_file(path, out.str());
}

void Timings::clear() {
  const std::lock_guard lock(mutex_);
  order_.clear();
  samples_.clear();
  events_.clear();
}

}  // namespace tactus
