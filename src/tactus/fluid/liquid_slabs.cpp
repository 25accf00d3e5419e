#include "tactus/fluid/liquid_slabs.h"

#include <algorithm>
#include <numeric>

namespace tactus {
namespace {

std::span<const Index> of_axis(std::span<const Index> counts, Index axis) {
  return counts.subspan(static_cast<std::size_t>(axis) * LiquidLayers::kLayers, LiquidLayers::kLayers);
}

}  // namespace

LiquidBalance::LiquidBalance(const Box3f& box_m, int parts)
    : layers_{box_m}, speed_(static_cast<std::size_t>(parts), 1) {
  slabs_.parts = parts;
  begin(std::vector<Index>(LiquidLayers::kCounts));
}

/// The axis along which the liquid is longest, from the first to the last layer that holds something; an
/// empty liquid is as long as its box.
Index LiquidBalance::longest_axis(std::span<const Index> counts) const {
  const auto length_m = [&](Index axis) {
    const std::span<const Index> layers = of_axis(counts, axis);
    const auto holds = [](Index n) { return n > 0; };
    const auto first = std::find_if(layers.begin(), layers.end(), holds);
    const float edge_m = layers_.box_m.max[axis] - layers_.box_m.min[axis];
    if (first == layers.end()) return edge_m;
    const auto last = std::find_if(layers.rbegin(), layers.rend(), holds);
    return static_cast<float>(last.base() - first) / LiquidLayers::kLayers * edge_m;
  };
  Index longest = slabs_.axis;
  for (Index axis = 0; axis < 3; ++axis)
    if (length_m(axis) > kLonger * length_m(longest)) longest = axis;
  return longest;
}

/// begin_m of all parts but the first: between layers, so that shares of the particles are as near as
/// possible to the parts' shares of the speed.
std::vector<float> LiquidBalance::cuts_for(std::span<const Index> counts, Index axis) const {
  const std::span<const Index> layers = of_axis(counts, axis);
  const double all = std::accumulate(layers.begin(), layers.end(), 0.0),
               speeds = std::accumulate(speed_.begin(), speed_.end(), 0.0);
  std::vector<float> cuts;
  Index layer = 0;
  double before = 0, speed = 0;
  for (std::size_t part = 0; part + 1 < speed_.size(); ++part) {
    speed += speed_[part];
    const double share = speed / speeds, wanted = share * all;
    const auto here = [&] { return static_cast<double>(layers[static_cast<std::size_t>(layer)]); };
    if (all == 0) layer = static_cast<Index>(share * LiquidLayers::kLayers);
    for (; all > 0 && layer < LiquidLayers::kLayers && before + 0.5 * here() < wanted; ++layer)
      before += here();
    cuts.push_back(layers_.begin_m(axis, layer));
  }
  return cuts;
}

void LiquidBalance::begin(std::span<const Index> counts) {
  slabs_.axis = longest_axis(counts);
  const std::vector<float> cuts = cuts_for(counts, slabs_.axis);
  std::copy(cuts.begin(), cuts.end(), slabs_.begin_m + 1);
}

void LiquidBalance::measure(std::span<const Index> particles_of_part, std::span<const double> seconds) {
  std::vector<double> now;
  for (std::size_t part = 0; part < seconds.size(); ++part)
    if (seconds[part] > 0 && particles_of_part[part] > 0)
      now.push_back(particles_of_part[part] / seconds[part]);
  if (now.size() < speed_.size()) return;
  const double mean = std::accumulate(now.begin(), now.end(), 0.0) / static_cast<double>(now.size());
  for (std::size_t part = 0; part < now.size(); ++part)
    speed_[part] += kNewest * (std::clamp(now[part] / mean, 0.25, 4.0) - speed_[part]);
}

bool LiquidBalance::move(std::span<const Index> counts, std::span<const Index> particles_of_part,
                         std::span<const double> seconds) {
  measure(particles_of_part, seconds);
  const Index axis = longest_axis(counts);
  if (axis != slabs_.axis) {
    begin(counts);
    return true;
  }
  double most_s = 0, sum_s = 0;
  for (std::size_t part = 0; part < speed_.size(); ++part) {
    const double s = particles_of_part[part] / speed_[part];
    most_s = std::max(most_s, s);
    sum_s += s;
  }
  if (!(most_s * static_cast<double>(speed_.size()) > kUneven * sum_s)) return false;
  const std::vector<float> cuts = cuts_for(counts, axis);
  for (std::size_t k = 0; k < cuts.size(); ++k)
    slabs_.begin_m[k + 1] += 0.5F * (cuts[k] - slabs_.begin_m[k + 1]);
  return true;
}

}  // namespace tactus
