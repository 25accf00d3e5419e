#pragma once
/// The devices a program runs on, each with its stream. Solvers loop over the parts of a set; one device is a
/// set of one.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/compute/exec_context.h"

namespace tactus {

/// How data of other devices is read: by kernels in place, or from copies made first.
enum class PeerAccess : std::uint8_t {
  automatic,  ///< in place when a trial, written and verified between all pairs, succeeds
  direct,
  staged,
};

class DeviceSet {
 public:
  /// Opens the devices that `parse_devices` finds in the text. `seed`: order of the queues of virtual devices
  /// (0: fixed order). @throws Error for `direct` access that fails its trial, naming the devices.
  explicit DeviceSet(std::string_view devices = "auto", std::uint64_t seed = 0,
                     PeerAccess access = PeerAccess::automatic);

  /// Whether kernels may read the memory of every other device of the set.
  bool reads_peers() const { return reads_peers_; }

  int count() const { return static_cast<int>(contexts_.size()); }
  ExecContext& context(int part) { return *contexts_[static_cast<std::size_t>(part)]; }
  Device& device(int part) { return *devices_[static_cast<std::size_t>(part)]; }
  /// As the user wrote it: "cpu:3".
  const std::string& name() const { return name_; }
  bool is_cuda() const { return devices_.front()->is_cuda(); }

  /// body(ctx, part) for every part, in order; the work it submits runs concurrently on real devices.
  template <class F>
  void for_each_part(F&& body) {
    for (int part = 0; part < count(); ++part) body(context(part), part);
  }
  void synchronize();

 private:
  /// The trial. @returns the first pair that fails it; "" when all succeed.
  std::string find_failing_pair();

  std::string name_;
  bool reads_peers_ = true;
  std::vector<std::unique_ptr<Device>> devices_;
  std::vector<std::unique_ptr<ExecContext>> contexts_;
};

/// One T for each part of a device set.
template <class T>
using Parts = std::vector<T>;

/// A range of layers [begin, end) of a grid.
struct Slab {
  Index begin = 0, end = 0;
  Index count() const { return end - begin; }
};
/// Cuts layers into slabs of nearly equal cost at multiples of `align`, none thinner than `least` layers (a
/// multiple of `align`): `parts` of them, or as many as there is capacity for, at least one.
std::vector<Slab> split_by_cost(std::span<const double> cost_of_layer, int parts, Index align, Index least);

}  // namespace tactus
