#include "tactus/multi_device/device_set.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/compute/virtual_scheduler.h"
#include "tactus/multi_device/peer_trial_kernels.h"

namespace tactus {

DeviceSet::DeviceSet(std::string_view devices, std::uint64_t seed, PeerAccess access) : name_(devices) {
  const std::vector<DeviceSpec> specs = parse_devices(devices);
  std::shared_ptr<VirtualScheduler> scheduler;
  if (specs.front().kind == DeviceKind::virtual_cpu) scheduler = std::make_shared<VirtualScheduler>(seed);
  for (const DeviceSpec& spec : specs) {
    devices_.push_back(open_device(spec, scheduler));
    contexts_.push_back(std::make_unique<ExecContext>(*devices_.back()));
  }
  if (count() > 1) {
    const std::string failing = access == PeerAccess::staged ? "" : find_failing_pair();
    reads_peers_ = access != PeerAccess::staged && failing.empty();
    if (!failing.empty()) {
      if (access == PeerAccess::direct) throw Error(failing + ": expected GPUs that are peers (tactus info)");
      log_warning(failing + ": data between devices is copied instead, which is slower");
    }
  }
  if (devices == "auto") name_ = devices_.front()->name();
}

std::string DeviceSet::find_failing_pair() {
  constexpr Index kWords = 1024;
  std::vector<Buffer<std::uint32_t>> pattern, seen;
  for (int part = 0; part < count(); ++part) {
    pattern.push_back(to_device(
        context(part), std::vector<std::uint32_t>(kWords, 0xC0FFEE00U + static_cast<unsigned>(part))));
    seen.emplace_back(device(part), kWords);
  }
  for (int reader = 0; reader < count(); ++reader) {
    for (int owner = 0; owner < count(); ++owner) {
      if (reader == owner) continue;
      const auto r = static_cast<std::size_t>(reader), o = static_cast<std::size_t>(owner);
      bool good = enable_peer_access(device(reader), device(owner));
      if (good) {
        ExecContext& ctx = context(reader);
        ctx.fill_bytes(seen[r].view(), 0);
        ctx.parallel_for("peer_trial", kWords, ReadPeer{pattern[o].const_view(), seen[r].view()});
        const std::vector<std::uint32_t> words = to_host(ctx, seen[r].const_view());
        good = std::all_of(words.begin(), words.end(),
                           [&](std::uint32_t w) { return w == 0xC0FFEE00U + static_cast<unsigned>(owner); });
      }
      if (!good) return device(reader).name() + " can't read the memory of " + device(owner).name();
    }
  }
  return "";
}

void DeviceSet::synchronize() {
  for (const auto& context : contexts_) context->synchronize();
}

std::vector<Slab> split_by_cost(std::span<const double> cost_of_layer, int parts, Index align, Index least) {
  const auto layers = static_cast<Index>(cost_of_layer.size());
  parts = std::max(1, std::min(parts, layers / least));
  const double total = std::accumulate(cost_of_layer.begin(), cost_of_layer.end(), 0.0);
  std::vector<Slab> slabs;
  Index begin = 0;
  for (int part = 1; part < parts; ++part) {
    const double wanted = total * part / parts;
    // Behind the best cut the cost only grows.
    Index best = begin + least;
    double below = std::accumulate(cost_of_layer.begin(), cost_of_layer.begin() + best, 0.0);
    double nearest = std::abs(below - wanted);
    for (Index cut = best; cut + align <= layers - least * (parts - part);) {
      for (Index k = 0; k < align; ++k) below += cost_of_layer[static_cast<std::size_t>(cut++)];
      if (std::abs(below - wanted) < nearest) nearest = std::abs(below - wanted), best = cut;
    }
    slabs.push_back({begin, best});
    begin = best;
  }
  slabs.push_back({begin, layers});
  return slabs;
}

}  // namespace tactus
