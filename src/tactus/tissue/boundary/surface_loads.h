#pragma once
/// Forces, tractions and pressures on parts of a body's surface.
#include <string>

#include "tactus/frame/frame_params.h"
#include "tactus/frame/state_archive.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/tissue/body_state.h"
#include "tactus/tissue/boundary/boundary_data.h"

namespace tactus {

/// Load on some triangles of the seen surface.
struct SurfaceLoad {
  std::string name;                     ///< for messages
  Vec3d traction_Pa;                    ///< per area at rest, its direction stays
  double pressure_Pa = 0;               ///< into the body, on the area as it is and where it faces now
  std::vector<boundary::LoadKey> keys;  ///< times increasing, >= 0; empty: always as given
  std::vector<Index> triangles;
};

/// Shares loads among the nodes as the surface hangs on them: integrals of the trilinear weights, three
/// points a triangle. Force and moment are those of the triangles, for any lattice. They become the state's
/// external forces.
class SurfaceLoads {
 public:
  SurfaceLoads() = default;
  /// @param surface of the body at rest
  /// @param window of the state; its own nodes are loaded
  /// @throws Error naming load and key for times out of order and values that are not numbers.
  SurfaceLoads(ExecContext& ctx, const CubeLattice& lattice, const TriangleMesh& surface,
               std::span<const SurfaceLoad> loads, const NodeWindow& window);

  /// State that it keeps from frame to frame.
  void archive(ExecContext& ctx, StateArchive& a) {
    if (!curves_.empty()) a.buffer(ctx, "time of loads", clock_s_);
  }
  bool empty() const { return nodes_.empty(); }
  /// Nodes of the body that share the k-th load, ascending.
  const std::vector<Index>& nodes_of(std::size_t load) const { return nodes_of_[load]; }
  /// External forces of the coming substep. Asynchronous.
  void apply(ExecContext& ctx, BodyState& state, const StepTime& time);

 private:
  std::vector<std::vector<Index>> nodes_of_;
  float gradient_per_m_ = 0;
  Buffer<boundary::LoadCurve> curves_;
  Buffer<boundary::LoadKey> keys_;
  Buffer<double> clock_s_;
  Buffer<float> factor_;
  Buffer<boundary::LoadedCube> loaded_;
  Buffer<Vec3f> part_force_N_;
  Buffer<Index> nodes_, begin_;
  Buffer<boundary::LoadShare> shares_;
};

/// Area of some triangles [m^2].
double area_m2(const TriangleMesh& surface, std::span<const Index> triangles);

}  // namespace tactus
