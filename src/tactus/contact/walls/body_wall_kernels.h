#pragma once
/// A soft body's surface beside particles: where it is, and the impulses of the particles on it. Its
/// triangles move with the body's nodes. The impulse of a particle on a wall goes to the triangle's corners
/// by the point's barycentric weights, and on to nodes by those of the corners: linear momentum is conserved
/// to rounding. Corners and nodes sum integers, in any order.
#include "tactus/compute/atomic.h"
#include "tactus/contact/body_points.h"
#include "tactus/contact/walls/wall_mesh.h"
#include "tactus/geom/search/near_walls.h"

namespace tactus {

/// Where a vertex is.
struct PosedVertex {
  Vec3f x_m, v_m_s;
  float inverse_mass_1_kg = 0;
};

/// [N s], as integers of 2^-48.
struct VertexImpulse {
  static constexpr float kUnit = 1.F / (1ULL << 48);
  std::uint64_t sum[3];
  TACTUS_HD bool is_zero() const { return (sum[0] | sum[1] | sum[2]) == 0; }
  TACTUS_HD static float newton_seconds(std::uint64_t sum) {
    return kUnit * static_cast<float>(static_cast<std::int64_t>(sum));
  }
  TACTUS_HD static std::int64_t units(float N_s) {
    constexpr float kMost = 1.6e4F;  // 2^62 units
    return N_s != N_s ? 0 : static_cast<std::int64_t>(clamp(N_s, -kMost, kMost) / kUnit);
  }
  TACTUS_HD Vec3f value() const {
    return {newton_seconds(sum[0]), newton_seconds(sum[1]), newton_seconds(sum[2])};
  }
};

/// Thread: vertex.
struct PoseWallVertices {
  static constexpr int kGrain = 512;
  View<const EmbeddedPoint> points;
  ContactNodes nodes;
  float crowd;  ///< particles that share a node's mass
  View<PosedVertex> posed;
  View<VertexImpulse> impulse;
  TACTUS_HD void operator()(Index i) const {
    const EmbeddedPoint& p = points[i];
    float give = 0;
    for (int k = 0; k < 8; ++k)
      if (p.weight[k] != 0.F && !nodes.is_held(p.node[k]))
        give += abs(p.weight[k]) / nodes.mass_kg[p.node[k]];
    posed[i] = {nodes.position(p), nodes.velocity(p), nodes.has_stopped() ? 0.F : crowd * give};
    impulse[i] = {};
  }
};
/// Thread: active vertex. As PoseWallVertices.
struct PoseActiveVertices {
  static constexpr int kGrain = 512;
  View<const Index> active;
  PoseWallVertices pose;
  TACTUS_HD void operator()(Index k) const { pose(active[k]); }
};

/// Thread: vertex. To another device.
struct CopyWallVertices {
  View<const PosedVertex> from;
  View<PosedVertex> posed;
  View<VertexImpulse> impulse;
  TACTUS_HD void operator()(Index i) const {
    posed[i] = from[i];
    impulse[i] = {};
  }
};

/// Thread: vertex. Adds its impulse from another device, which forgets it.
struct AddWallImpulses {
  View<VertexImpulse> from;
  Index first;
  View<VertexImpulse> impulse;
  TACTUS_HD void operator()(Index i) const {
    for (int a = 0; a < 3; ++a) impulse[first + i].sum[a] += from[first + i].sum[a];
    from[first + i] = {};
  }
};

/// A point of a body's surface that a particle sees.
struct WallHit {
  Index triangle = -1;  ///< of those that are near
  float b, c;           ///< weights of its second and third corner
};
/// The nearest one, and WallAcross.
inline constexpr Index kWallSides = 2;

/// Thread: particle. Its impulses go to the corners of the triangles that it pushed.
struct PushVertices {
  View<const WallHit> hits;  ///< kWallSides of each
  View<const Vec3i> triangles;
  NearWalls near_walls;
  Index collider;
  View<VertexImpulse> impulse;
  TACTUS_HD void operator()(Index i) const {
    if (hits[kWallSides * i].triangle < 0) return;
    for (Index k = 0; k < near_walls.count[i]; ++k) {
      const NearWall& wall = near_walls.at(i, k);
      if (wall.collider != collider) continue;
      const WallHit& hit = hits[kWallSides * i + wall.side];
      const Vec3i v = triangles[hit.triangle];
      for (int a = 0; a < 3; ++a) {
        const float J = wall.impulse_N_s[a];
        const std::int64_t all = VertexImpulse::units(J), b = VertexImpulse::units(hit.b * J),
                           c = VertexImpulse::units(hit.c * J);
        atomic_add(impulse[v.x].sum[a], static_cast<std::uint64_t>(all - b - c));
        atomic_add(impulse[v.y].sum[a], static_cast<std::uint64_t>(b));
        atomic_add(impulse[v.z].sum[a], static_cast<std::uint64_t>(c));
      }
    }
  }
};

/// The impulse of a vertex that halving added goes to the corners of its triangle. The vertex forgets it.
struct PushCorners {
  View<const WallVertex> added;
  Index first;
  View<VertexImpulse> impulse;
  TACTUS_HD void operator()(Index i) const {
    const VertexImpulse own = impulse[first + i];
    if (own.is_zero()) return;
    impulse[first + i] = {};
    const WallVertex v = added[i];
    for (int k = 0; k < 3; ++k) {
      const float J = VertexImpulse::newton_seconds(own.sum[k]);
      const auto b = static_cast<std::uint64_t>(VertexImpulse::units(v.b * J)),
                 c = static_cast<std::uint64_t>(VertexImpulse::units(v.c * J));
      atomic_add(impulse[v.corners.x].sum[k], own.sum[k] - b - c);
      atomic_add(impulse[v.corners.y].sum[k], b);
      atomic_add(impulse[v.corners.z].sum[k], c);
    }
  }
};
/// Thread: triangle of the surface that is listed. As PushCorners, of its vertices.
struct PushListedCorners {
  static constexpr int kGrain = 64;
  View<const Index> listed;
  View<const IndexRange> added_of;
  View<const Index> added_list;
  PushCorners push;
  TACTUS_HD void operator()(Index k) const {
    const IndexRange range = added_of[listed[k]];
    for (Index i = range.begin; i < range.end; ++i) push(added_list[i]);
  }
};

/// Thread: active vertex of the surface. Its impulse goes to its nodes.
struct GatherAtNodes {
  static constexpr int kGrain = 512;
  View<const Index> active;
  View<const EmbeddedPoint> points;
  View<const VertexImpulse> impulse;
  View<VertexImpulse> node_impulse;
  TACTUS_HD void operator()(Index k) const { gather(active[k]); }

 private:
  TACTUS_HD void gather(Index i) const {
    const VertexImpulse own = impulse[i];
    if (own.is_zero()) return;
    const EmbeddedPoint& p = points[i];
    for (int a = 0; a < 3; ++a) {
      const float J = VertexImpulse::newton_seconds(own.sum[a]);
      std::uint64_t rest = own.sum[a];
      for (int k = 1; k < 8; ++k) {
        if (p.weight[k] == 0.F) continue;
        const auto part = static_cast<std::uint64_t>(VertexImpulse::units(p.weight[k] * J));
        atomic_add(node_impulse[p.node[k]].sum[a], part);
        rest -= part;
      }
      atomic_add(node_impulse[p.node[0]].sum[a], rest);
    }
  }
};

/// Thread: node. Takes the impulses that vertices gave it.
struct PushNodes {
  static constexpr int kGrain = 1024;
  View<VertexImpulse> node_impulse;
  ContactNodes nodes;
  TACTUS_HD void operator()(Index node) const {
    const VertexImpulse own = node_impulse[node];
    if (own.is_zero()) return;
    node_impulse[node] = {};
    if (nodes.has_stopped()) return;
    nodes.change(node, {}, nodes.free_part(node, (1.F / nodes.mass_kg[node]) * own.value()));
  }
};

}  // namespace tactus
