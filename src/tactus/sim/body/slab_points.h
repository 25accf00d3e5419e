#pragma once
/// The points of a body's surface that touch, on every device that steps a slab of it.
#include <optional>

#include "tactus/contact/contact_on_devices.h"
#include "tactus/contact/contact_points.h"
#include "tactus/frame/readback.h"
#include "tactus/tissue/embedding.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {

/// Points spread over a body's surface; those that elements move come first.
struct BodyBoundary {
  std::vector<SpreadPoint> points;
  std::vector<embed::Anchor> anchors;  ///< in the cube that holds each
  std::vector<embed::Anchor> bearing;  ///< in the cube that moves it, and that it pushes
  Index first_count = 0;
};
/// @param elements as Hybrid's
BodyBoundary body_boundary(const CubeLattice& lattice, const TriangleMesh& surface,
                           const ElementMask& elements);

/// A slab has every point whose nodes it holds, and finds and applies the correction of each. A point near a
/// cut is on both sides of it, with the same bits, so nothing of contact is exchanged. It is recorded by the
/// slab that owns its node[0].
class SlabPoints {
 public:
  /// Nothing touches.
  SlabPoints() = default;
  /// @param tissue shares its nodes; must outlive this @param capacity for points that cuts add.
  /// Synchronizes.
  SlabPoints(BodySolver& tissue, const CubeLattice& lattice, const BodyBoundary& boundary,
             Index capacity = 0);

  /// Number of the body's points; those that elements move come first.
  Index count() const { return count_; }
  /// Takes a cut over, between frames. Points count as in the boundary; those that a cut adds have the places
  /// behind the first part, so the others are further behind, by the capacity. Synchronizes. @throws Error.
  void apply(const TopologyChange& change, const CubeLattice& lattice, std::span<const PointChange> points);
  /// Once a frame, before its first substep. Asynchronous, as the next two.
  void begin_frame(ContactOnDevices& world);
  /// As Contact::correct.
  void correct(ContactOnDevices& world, int k, int later_steps);
  void end_frame();
  /// Synchronizes. @throws Error.
  void archive(StateArchive& a);
  void add_reports(Readback& readback);
  /// Totals of the frame that was waited for, per collider.
  std::vector<ColliderTotals> totals(const Readback& readback) const;
  /// Reactions on the things that the body touched, over the frame that was waited for.
  ContactReport report(const Readback& readback, float dt_frame_s, int substeps) const;
  /// Contacts of the frame that was waited for, in the body's order of points: the same on any number of
  /// slabs. Synchronizes.
  std::vector<ContactPoint> contacts();
  /// node[0] of the points that touch, as the body counts them. Synchronizes.
  std::vector<Index> touched() const;
  const BodyPoints& points(int slab) const { return parts_[static_cast<std::size_t>(slab)].points; }
  /// @param k as BodySolver::slab
  ContactNodes nodes(int slab, int k = -1) const;

 private:
  struct Part {
    Buffer<float> mass_kg;
    BodyPoints points;
    std::vector<Index> reference_node;  ///< per point: node[0], as the body counts it
    std::vector<Index> place;           ///< per point of the body: here; -1: elsewhere
    Index next = 0;                     ///< place for a new one
    Buffer<NodeMasses::Change> masses;
    Readback::Place report;
  };
  void add_part(int slab, const CubeLattice& lattice, std::span<const EmbeddedPoint> points);
  std::vector<NodeShare> shares(int slab, const CubeLattice& lattice) const;
  /// The point, with nodes as a slab counts them; none: it doesn't hold them all.
  std::optional<EmbeddedPoint> local(int slab, const CubeLattice& lattice, EmbeddedPoint point) const;

  BodySolver* tissue_ = nullptr;
  Index count_ = 0, first_count_ = 0, others_ = 0, capacity_ = 0;
  std::vector<Part> parts_;
};

}  // namespace tactus
