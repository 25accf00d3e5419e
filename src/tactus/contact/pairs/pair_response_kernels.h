#pragma once
/// Response of points that touch another body: impulses on it and on their own.
#include "tactus/contact/pairs/pair_views.h"
#include "tactus/contact/response_kernels.h"

namespace tactus {

/// Block: group of points. The impulse of each that touches: J = D^-1 (change wanted), with D the row sum
/// D = sum_k |w_k| s_k / m_k over the nodes of both sides, as in ApplyContacts: the velocity between the two
/// is u = W v, with weights of both signs, so |W| takes the place of W.
struct PairImpulses {
  static constexpr int kThreads = kGroupPoints, kGrain = 8;
  PairTable table;
  PairState state;
  View<const SurfacePoses> poses;
  struct Shared {};
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index number = table.used_groups[b.index()];
    if (state.group_active[number] == 0U) return;
    const PointGroup group = table.groups[number];
    b.for_threads(group.count, [&](int t) {
      const Index i = group.first + t;
      if (state.contact[i].touching == 1) press(group.body, i);
    });
  }

 private:
  TACTUS_HD void press(Index of, Index i) const {
    PairContact& contact = state.contact[i];
    const SolidCube& cube = table.cubes[contact.cube];
    const PairBody &body = table.bodies[of], &other = table.bodies[cube.body];
    const EmbeddedPoint& point = table.points[i];
    float sum = 0;
    for (int k = 0; k < 8; ++k) {
      sum += share(body.nodes, point.node[k], table.rows[8 * i + k], point.weight[k]);
      sum += share(other.nodes, cube.node[k], cube.row[k], CubeMap::weight(contact.q, k));
    }
    const float mass = 1.F / sum;
    contact.impulse_N_s = mass * contact.velocity_correction_m_s;
    contact.shift_kg_m = mass * contact.position_correction_m;
    // In any order: MovePairs adds integers.
    state.next[i] = atomic_exchange(state.cube_list[contact.cube], static_cast<std::uint32_t>(i) + 1U);
    note(of, i, cube.body, contact);
  }
  TACTUS_HD float share(const ContactNodes& nodes, Index node, Index row, float weight) const {
    if (weight == 0.F || nodes.is_held(node) || nodes.has_stopped()) return 0;
    return abs(weight) * PointWeights::value(state.row_weight[row]) / nodes.mass_kg[node];
  }
  TACTUS_HD void note(Index of, Index i, Index other, const PairContact& contact) const {
    const Index bodies = table.bodies.size();
    ContactRecord& record = state.records[i];
    if (state.recorded[i]++ == 0) {
      record = {};
    } else if (record.collider != other) {
      state.moved_on[of * bodies + record.collider].add_atomically(record.impulse_N_s, record.moment_N_m_s);
      record.impulse_N_s = record.moment_N_m_s = {};
    }
    record.collider = other;
    atomic_store(state.used[of * bodies + other], 1U);
    const Vec3f done = -contact.impulse_N_s;  // to the other
    record.add({done, cross(contact.x_m - poses[0].reference_m, done), contact.depth_m, 1, 0, other});
  }
};

/// A sum of vectors as integers, in units of the scene's smallest mass: the same number is added on one side
/// and taken on the other, and the order doesn't matter.
struct PairSum {
  std::int64_t impulse[3] = {}, shift[3] = {};
  static constexpr float kImpulse = 1.F / (1 << 30);                ///< of that mass times 1 m/s
  static constexpr float kShift = 1.F / (std::uint64_t{1} << 40U);  ///< of that mass times 1 m
  TACTUS_HD void add(float weight, const PairContact& c, float inverse_mass_1_kg) {
    for (int a = 0; a < 3; ++a) {
      impulse[a] += units(weight * c.impulse_N_s[a] * inverse_mass_1_kg, kImpulse);
      shift[a] += units(weight * c.shift_kg_m[a] * inverse_mass_1_kg, kShift);
    }
  }
  TACTUS_HD void add(const PairSum& other) {
    for (int a = 0; a < 3; ++a) {
      impulse[a] += other.impulse[a];
      shift[a] += other.shift[a];
    }
  }
  TACTUS_HD static Vec3f value(const std::int64_t* sum, float unit) {
    return {unit * static_cast<float>(sum[0]), unit * static_cast<float>(sum[1]),
            unit * static_cast<float>(sum[2])};
  }

 private:
  TACTUS_HD static std::int64_t units(float value, float unit) {
    const float most = unit * static_cast<float>(std::int64_t{1} << 56);
    return static_cast<std::int64_t>(clamp(value, -most, most) / unit);
  }
};

/// Block: kNodes nodes. Each takes the impulses of its own points and of the points of others in its cubes.
/// On a GPU kLanes threads share its lists.
struct MovePairs {
  static constexpr int kThreads = 128, kLanes = 16, kNodes = kThreads / kLanes, kGrain = 32;
  PairTable table;
  PairState state;
  struct Shared {
    PairSum of_lane[kNodes][kLanes];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index first = table.used_row_groups[b.index()] * kNodes,
                count = min(Index(kNodes), table.nodes.size() - first);
    constexpr int kShare = Block::kIsLoop ? 1 : kLanes;
    const auto is_moved = [&](int g) { return moves(first + g); };
    b.template for_groups<kShare>(
        count, is_moved, [&](int g, int lane) { s.of_lane[g][lane] = sum_of(first + g, lane, kShare); });
    b.for_threads(count, [&](int g) {
      if (!moves(first + g)) return;
      PairSum sum;
      for (int lane = 0; lane < kShare; ++lane) sum.add(s.of_lane[g][lane]);
      move(first + g, sum);
    });
  }

 private:
  TACTUS_HD bool moves(Index row) const {
    if (state.row_weight[row] == 0U) return false;
    const PairNode& at = table.nodes[row];
    const ContactNodes& nodes = table.bodies[at.body].nodes;
    return !nodes.is_held(at.node) && !nodes.has_stopped();
  }
  TACTUS_HD void move(Index row, const PairSum& sum) const {
    const PairNode& at = table.nodes[row];
    const ContactNodes& nodes = table.bodies[at.body].nodes;
    const float share = state.smallest_mass_kg / nodes.mass_kg[at.node];
    nodes.v_m_s[at.node] += nodes.free_part(at.node, share * PairSum::value(sum.impulse, PairSum::kImpulse));
    nodes.x_m[at.node] += nodes.free_part(at.node, share * PairSum::value(sum.shift, PairSum::kShift));
  }
  /// The sum over every `lanes`-th entry of the row's lists, from the lane-th on.
  TACTUS_HD PairSum sum_of(Index row, int lane, int lanes) const {
    const float inverse = 1.F / state.smallest_mass_kg;
    PairSum sum;
    const IndexRange points = table.incident_points.ranges[row], cubes = table.incident_cubes.ranges[row];
    for (Index e = points.begin + lane; e < points.end; e += lanes) {
      const Index entry = table.incident_points.values[e], i = entry / 8;
      if (state.contact[i].touching == 1)
        sum.add(table.points[i].weight[entry % 8], state.contact[i], inverse);
    }
    for (Index e = cubes.begin + lane; e < cubes.end; e += lanes) {
      const Index entry = table.incident_cubes.values[e];
      for (std::uint32_t i = state.cube_list[entry / 8]; i != 0U;
           i = state.next[static_cast<Index>(i - 1U)]) {
        const PairContact& contact = state.contact[static_cast<Index>(i - 1U)];
        sum.add(-CubeMap::weight(contact.q, entry % 8), contact, inverse);
      }
    }
    return sum;
  }
};

}  // namespace tactus
