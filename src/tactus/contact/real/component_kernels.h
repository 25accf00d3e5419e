#pragma once
/// The separate components of the real surface (two hands; a hand and a tool), each with a motion of its own:
/// triangles that hang together through shared vertices are one component.
#include "tactus/contact/real/sample_kernels.h"

namespace tactus {

inline constexpr Index kComponents = 16;   ///< the largest components, which have a motion of their own
inline constexpr Index kFitPoints = 1024;  ///< samples of the last frame that are registered, at most
inline constexpr Index kLeastComponentSamples = 48;  ///< about 16 s²: smaller ones can't be registered
inline constexpr Index kLeastComponentShare =
    32;                                       ///< a component has at least 1/32 of the largest one's samples
inline constexpr Index kComponentParts = 64;  ///< partial sums: sample i goes to part i % 64

/// Every vertex by itself, of no number.
struct ComponentStart {
  View<std::uint32_t> parent, samples;
  View<Index> number;
  TACTUS_HD void operator()(Index v) const {
    parent[v] = static_cast<std::uint32_t>(v);
    samples[v] = 0;
    number[v] = kNoComponent;
  }
};

/// A first guess: each vertex hangs on the lowest corner of its triangles. Paths are short then, when the
/// corners that this leaves apart are joined.
struct HangOnLowest {
  static constexpr int kGrain = 512;
  View<const Vec3i> triangles;
  Count vertex_count;
  View<std::uint32_t> parent;
  TACTUS_HD void operator()(Index t) const {
    const Vec3i v = triangles[t];
    const Index n = vertex_count.get(), low = min(v.x, min(v.y, v.z));
    if (low < 0 || max(v.x, max(v.y, v.z)) >= n) return;
    for (int k = 0; k < 3; ++k) {
      if (v[k] != low) atomic_min(parent[v[k]], static_cast<std::uint32_t>(low));
    }
  }
};

/// The corners of each triangle hang together.
struct JoinCorners {
  static constexpr int kGrain = 512;
  View<const Vec3i> triangles;
  Count vertex_count;
  VertexForest forest;
  TACTUS_HD void operator()(Index t) const {
    const Vec3i v = triangles[t];
    const Index n = vertex_count.get();
    if (v.x < 0 || v.y < 0 || v.z < 0 || v.x >= n || v.y >= n || v.z >= n) return;
    forest.join(static_cast<std::uint32_t>(v.x), static_cast<std::uint32_t>(v.y));
    forest.join(static_cast<std::uint32_t>(v.y), static_cast<std::uint32_t>(v.z));
  }
};

/// Counts the samples of each component, and lists those that are large enough. The list's order depends on
/// the order of threads, the components don't.
struct CountComponentSamples {
  static constexpr int kGrain = 1024;
  View<const Index> root;  ///< of each sample
  View<std::uint32_t> samples;
  View<std::uint32_t> candidates, candidate_count;
  TACTUS_HD void operator()(Index i) const {
    const Index r = root[i];
    if (atomic_fetch_add(samples[r], 1) + 1 == static_cast<std::uint32_t>(kLeastComponentSamples))
      candidates[static_cast<Index>(atomic_fetch_add(candidate_count[0], 1))] = static_cast<std::uint32_t>(r);
  }
};

/// A component of the surface of one frame.
struct SurfaceComponent {
  Index label = -1;  ///< the same from frame to frame
  Index samples = 0;
  Index next = -1;  ///< its number in the frame after
  float area_m2 = 0;
  Vec3f center_m;       ///< of gravity
  Vec3f low_m, high_m;  ///< box of its samples
  TACTUS_HD float size_m() const { return length(high_m - low_m); }
  /// False only for points farther than `reach_m` from all its samples.
  TACTUS_HD bool may_reach(Vec3f p_m, float reach_m) const { return outside_m(p_m) < reach_m; }
  /// How far outside its box a point is along the farthest axis: no sample is nearer. < 0: in it.
  TACTUS_HD float outside_m(Vec3f p_m) const {
    const Vec3f out = max(low_m - p_m, p_m - high_m);
    return max(out.x, max(out.y, out.z));
  }
};

/// A component that was seen once, and may come back: a hand that left the view, or that touches another.
struct LostComponent {
  static constexpr Index kFrames = 15;  ///< so long its label is kept
  Index label = -1;
  Index frames = 0;  ///< since it was seen
  float area_m2 = 0, size_m = 0;
  Vec3f center_m;
};

/// All components of a frame, the largest first.
struct SurfaceComponents {
  Index count = 0;       ///< >= 1: components that can't be told apart are one
  Index mixed = 0;       ///< != 0: there are samples that aren't the first component's
  Index next_label = 0;  ///< for a component that is seen for the first time
  SurfaceComponent component[kComponents];
  Index lost_count = 0;
  LostComponent lost[kComponents];  ///< the longest lost first
  /// Copies the share of thread k of kComponents or more.
  TACTUS_HD void copy_part(const SurfaceComponents& from, Index k) {
    if (k == 0) {
      count = from.count;
      mixed = from.mixed;
      next_label = from.next_label;
      lost_count = from.lost_count;
    }
    if (k >= kComponents) return;
    component[k] = from.component[k];
    lost[k] = from.lost[k];
  }
  /// Points of each component that are registered, at most: equal shares.
  TACTUS_HD Index share_of(Index points) const {
    Index parts = 1;
    while (parts < count) parts *= 2;
    return points / parts;
  }
  /// How many points of component k are registered.
  TACTUS_HD Index points_of(Index k) const { return min(component[k].samples, share_of(kFitPoints)); }
};

/// Numbers the largest components, by their samples and then by their root. Empties the list.
struct ChooseComponents {
  View<const std::uint32_t> samples, candidates;
  View<std::uint32_t> candidate_count;
  View<const Index> sample_count;
  View<Index> number;
  View<SurfaceComponents> components;
  TACTUS_HD void operator()(Index) const {
    SurfaceComponents& all = components[0];
    std::uint32_t root[kComponents];
    Index chosen = 0;
    for (Index c = 0, n = static_cast<Index>(candidate_count[0]); c < n; ++c) {
      std::uint32_t next = candidates[c];
      for (Index k = 0; k < kComponents; ++k) {  // inserts by moving smaller ones on by one
        if (k == chosen) {
          root[chosen++] = next;
          break;
        }
        if (!before(next, root[k])) continue;
        const std::uint32_t smaller = root[k];
        root[k] = next;
        next = smaller;
      }
    }
    candidate_count[0] = 0;
    Index counted = 0;
    all.count = 0;
    for (Index k = 0; k < chosen && size(root[k]) * kLeastComponentShare >= size(root[0]); ++k) {
      number[static_cast<Index>(root[k])] = k;
      all.component[k].samples = size(root[k]);
      counted += size(root[k]);
      all.count = k + 1;
    }
    all.mixed = all.count > 1 || (all.count == 1 && counted < sample_count[0]) ? 1 : 0;
    if (all.count == 0) {
      all.count = 1;
      all.component[0].samples = sample_count[0];
    }
  }

 private:
  TACTUS_HD Index size(std::uint32_t r) const { return static_cast<Index>(samples[static_cast<Index>(r)]); }
  TACTUS_HD bool before(std::uint32_t a, std::uint32_t b) const {
    return size(a) != size(b) ? size(a) > size(b) : a < b;
  }
};

/// From the root of each sample to the number of its component.
struct NumberSamples {
  View<const Index> number;
  View<const SurfaceComponents> components;
  View<Index> component;  ///< in: root, out: number
  TACTUS_HD void operator()(Index i) const {
    component[i] = components[0].mixed != 0 ? number[component[i]] : 0;
  }
};

/// Partial sums of one component.
struct ComponentSums {
  float area_m2 = 0;
  Vec3f moment_m3;  ///< the area's first moment
  Vec3f low_m{1e30F, 1e30F, 1e30F}, high_m{-1e30F, -1e30F, -1e30F};
  Index samples = 0;  ///< of the part's run of consecutive samples, not of every 64th
  TACTUS_HD void add(const ComponentSums& other) {
    area_m2 += other.area_m2;
    moment_m3 += other.moment_m3;
    low_m = min(low_m, other.low_m);
    high_m = max(high_m, other.high_m);
    samples += other.samples;
  }
};

/// Block p: part p of every component. Its threads share the samples; their sums are added up in pairs.
struct ComponentPartSums {
  static constexpr int kThreads = 32;
  SamplesView samples;
  View<const SurfaceComponents> components;
  View<ComponentSums> parts;
  struct Shared {
    ComponentSums of[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    for (Index k = 0; k < components[0].count; ++k) {
      b.for_each_thread([&](int t) { s.of[t] = sum(k, b.index(), t); });
      for (int half = kThreads / 2; half > 0; half /= 2)
        b.for_threads(half, [&](int t) { s.of[t].add(s.of[t + half]); });
      b.on_one_thread([&] { parts[k * kComponentParts + b.index()] = s.of[0]; });
    }
  }
  /// First sample of run p of the kComponentParts runs into which n samples are cut.
  TACTUS_HD static Index run_begin(Index p, Index n) {
    return static_cast<Index>(static_cast<std::int64_t>(p) * n / kComponentParts);
  }

 private:
  TACTUS_HD ComponentSums sum(Index k, Index p, Index t) const {
    const Index n = samples.count[0];
    const bool mixed = components[0].mixed != 0;
    ComponentSums sum;
    for (Index i = p + kComponentParts * t; i < n; i += kComponentParts * kThreads) {
      const Index of = mixed ? samples.component[i] : k;
      if (max(of, Index(0)) == k) {
        sum.low_m = min(sum.low_m, samples.x_m[i]);
        sum.high_m = max(sum.high_m, samples.x_m[i]);
      }
      if (of != k) continue;
      sum.area_m2 += samples.area_m2[i];
      sum.moment_m3 += samples.area_m2[i] * samples.x_m[i];
    }
    const Index last = run_begin(p + 1, n);
    for (Index i = run_begin(p, n) + t; i < last; i += kThreads)
      sum.samples += !mixed || samples.component[i] == k ? 1 : 0;
    return sum;
  }
};

/// Centre, area and box of component k.
struct ComponentCenters {
  View<const ComponentSums> parts;
  View<const SurfaceComponents> before;
  View<SurfaceComponents> components;
  TACTUS_HD void operator()(Index k) const {
    SurfaceComponents& all = components[0];
    if (k >= all.count) return;
    ComponentSums sum;
    for (Index p = 0; p < kComponentParts; ++p) sum.add(parts[k * kComponentParts + p]);
    SurfaceComponent& component = all.component[k];
    component.area_m2 = sum.area_m2;
    component.center_m = sum.area_m2 > 0.F ? sum.moment_m3 / sum.area_m2 : before[0].component[0].center_m;
    component.low_m = sum.low_m;
    component.high_m = sum.high_m;
  }
};

/// Keeps points of the last frame's surface for the registration: each component evenly. Point share*k + j is
/// sample floor(j n / kept) of the n of component k. This frame's components become the last frame's.
struct KeepPoints {
  static constexpr int kGrain = 64;
  SamplesView from;
  View<const ComponentSums> parts;
  View<const SurfaceComponents> components;
  View<SurfaceComponents> before;
  View<Vec3f> x_m;
  TACTUS_HD void operator()(Index j) const {
    const SurfaceComponents& all = components[0];
    before[0].copy_part(all, j);
    const Index share = all.share_of(x_m.size()), k = j / share;
    if (k >= all.count) return;
    const Index n = all.component[k].samples, kept = all.points_of(k);
    if (j % share >= kept) return;
    const auto rank = static_cast<Index>(static_cast<std::int64_t>(j % share) * n / kept);
    x_m[j] = from.x_m[all.mixed != 0 ? sample_of(k, rank) : rank];
  }

 private:
  /// The sample of that rank among those of component k.
  TACTUS_HD Index sample_of(Index k, Index rank) const {
    constexpr Index kAhead = 8;  // a GPU fetches so many while it waits for one
    Index p = 0;
    for (; p + kAhead < kComponentParts; p += kAhead) {
      Index of[kAhead], here = 0;
      for (Index u = 0; u < kAhead; ++u) of[u] = parts[k * kComponentParts + p + u].samples;
      for (Index u = 0; u < kAhead; ++u) here += of[u];
      if (rank < here) break;
      rank -= here;
    }
    for (; p + 1 < kComponentParts && rank >= parts[k * kComponentParts + p].samples; ++p)
      rank -= parts[k * kComponentParts + p].samples;
    const Index n = from.count[0];
    Index i = ComponentPartSums::run_begin(p, n);
    for (; i + kAhead <= n; i += kAhead) {
      Index of[kAhead], here = 0;
      for (Index u = 0; u < kAhead; ++u) of[u] = from.component[i + u];
      for (Index u = 0; u < kAhead; ++u) here += of[u] == k ? 1 : 0;
      if (rank < here) break;
      rank -= here;
    }
    for (; i + 1 < n; ++i) {
      if (from.component[i] == k && rank-- == 0) break;
    }
    return i;
  }
};

}  // namespace tactus
