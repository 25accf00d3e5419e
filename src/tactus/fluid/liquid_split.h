#pragma once
/// A liquid on several devices: moves particles between them and copies those that neighbours need.
#include <vector>

#include "tactus/fluid/liquid_part.h"
#include "tactus/multi_device/device_barrier.h"
#include "tactus/multi_device/upload_ring.h"

namespace tactus {

/// Works on the parts of one liquid. In every step: migrate, add_ghosts, then each part sorts its particles
/// and copies alike, then link_ghosts; after each pass that writes a field that neighbours read, update. All
/// is asynchronous and of fixed launches, so it may be recorded; counts are known to the devices alone. With
/// one part, nothing is to be done. docs/concepts/liquid.md explains the order.
class LiquidSplit {
 public:
  /// Parts are on the first devices, one each. They must outlive this. Synchronizes.
  LiquidSplit(DeviceSet& devices, std::vector<LiquidPart>& parts);

  bool is_split() const { return parts_.size() > 1; }
  void send_slabs(const LiquidSlabs& slabs);
  /// Particles go to the part that owns where they are.
  void migrate();
  /// Copies of all that is nearer than that to a part's slab come behind its particles.
  void add_ghosts(float reach_m);
  /// Copies get the slots of their originals, once all parts have sorted.
  void link_ghosts();
  /// In all parts, copies get the values of their originals.
  template <class T>
  void update(const char* name, Buffer<T> LiquidPart::*field);
  DeviceBarrier& barrier() { return barrier_; }

 private:
  void take_over(const char* name, bool are_ghosts);
  template <class F>
  void each(F&& body) {
    for (std::size_t p = 0; p < parts_.size(); ++p) body(devices_.context(static_cast<int>(p)), parts_[p]);
  }

  DeviceSet& devices_;
  std::vector<LiquidPart>& parts_;
  DeviceBarrier barrier_;
  UploadRing<LiquidSlabs> ring_;
};

template <class T>
void LiquidSplit::update(const char* name, Buffer<T> LiquidPart::*field) {
  if (!is_split()) return;
  each([&](ExecContext& ctx, LiquidPart& part) {
    if (ctx.device().kind() == DeviceKind::virtual_cpu)
      ctx.parallel_for(name, part.ghosts(),
                       PoisonGhosts<T>{part.ghost_slot.const_view(), (part.*field).view()});
  });
  barrier_.meet();
  each([&](ExecContext& ctx, LiquidPart& part) {
    PullGhosts<T> pull{part.originals.const_view(), part.ghost_slot.const_view(), {}, (part.*field).view()};
    for (std::size_t p = 0; p < parts_.size(); ++p) pull.from[p] = (parts_[p].*field).const_view();
    ctx.parallel_for(name, part.ghosts(), pull);
  });
}

}  // namespace tactus
