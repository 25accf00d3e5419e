#pragma once
/// One body on many devices.
#include <array>
#include <memory>

#include "tactus/tissue/hybrid/hybrid.h"
#include "tactus/tissue/hybrid/hybrid_kernels.h"

namespace tactus {

/// A body cut into slabs of layers along z, one for each device, each with a few layers of its neighbours'
/// nodes. A substep begins with pulling those. The same bits as Hybrid on one device.
///
/// Elements alone: nodes at the cuts move first, and are pulled for the next substep while the others move.
class HybridSlabs {
 public:
  /// Parameters as Hybrid's. A body too small for all devices is on the first few, small ones on the first.
  /// @param least_elements as many as these, or matched nodes that cost as much, are in each slab, or there
  /// are fewer; absent: kLeastElements or kLeastOfBoth on GPUs, none elsewhere
  HybridSlabs(DeviceSet& devices, const CubeLattice& lattice, const ElementMask& elements,
              std::span<const ElasticMaterial> materials, std::span<const std::uint8_t> material_of_cube,
              const TledOptions& tled, const FlsmMaterial& flsm,
              std::optional<double> least_elements = std::nullopt);
  /// With fewer, a second H200 costs more in waiting than it saves: of elements alone, and where shape
  /// matching takes part, whose substep has more to hide it behind. Between rows of bench/results: n million
  /// elements take 4 + 49 n us on one and 13 + 24 n us on two, equal at 0.36.
  static constexpr double kLeastElements = 170000, kLeastOfBoth = 75000;

  /// So many substeps, all without the host. Asynchronous; may be captured (DeviceReplay).
  void step(const HybridStep& step, int count = 1);

  int slab_count() const { return static_cast<int>(parts_.size()); }
  float stable_step_s() const { return parts_.front()->tissue.stable_step_s(); }
  int substeps_for(float dt_frame_s) const { return parts_.front()->tissue.substeps_for(dt_frame_s); }
  /// @param x_m,v_m_s per node of the body. Synchronizes.
  void set_state(std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s);
  /// Of all nodes of the body, to the first device, in its order of work. Asynchronous, as step.
  void store(BodyState& body);
  /// Of all nodes of the body, on the host. Synchronizes.
  std::vector<Vec3f> positions_m();
  std::vector<Vec3f> velocities_m_s();

 private:
  /// Nodes of a neighbour beside a body's own, where its elements find them.
  struct Ghosts {
    std::size_t of = 0;       ///< which part
    Index first_cell = 0;     ///< there
    Buffer<Index> from_cell;  ///< per node: there, counted from the first
    View<const Index> cell;   ///< here
    Buffer<float> copy_m;     ///< 3 fields of the cells there, where kernels can't read them
  };
  struct Part {
    Part(ExecContext& ctx, Hybrid tissue, const CubeLattice& lattice);
    ExecContext& ctx;
    ExecContext beside;  ///< for the interior
    Hybrid tissue;
    BodyState state;               ///< of the window
    std::array<Ghosts, 2> ghosts;  ///< below and above; none without nodes
    Event pulled, moved, interior_moved;
  };
  template <class F>
  void for_neighbours(std::size_t part, F&& body);
  Ghosts find_ghosts(std::size_t part, std::size_t neighbour, Slab nodes);
  void pull(std::size_t part);
  void pull_positions(std::size_t part, int k);
  hybrid::PullNodes::Neighbour nodes_of(std::size_t neighbour, Slab nodes) const;
  void step_elements(const HybridStep& step, int count);
  void step_both(const HybridStep& step, int count);
  std::vector<Vec3f> gather(Buffer<Vec3f> BodyState::*field);

  DeviceSet& devices_;
  std::vector<std::unique_ptr<Part>> parts_;
  Event stored_;
};

}  // namespace tactus
