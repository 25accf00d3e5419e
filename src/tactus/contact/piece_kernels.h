#pragma once
/// The separate pieces of the real surface (two hands; a hand and a tool), each with a motion of its own:
/// what hangs together through shared vertices is one piece.
#include "tactus/contact/sample_kernels.h"

namespace tactus {

inline constexpr Index kPieces = 16;             ///< the largest pieces, which have a motion of their own
inline constexpr Index kFitPoints = 1024;        ///< samples of the last frame that are registered, at most
inline constexpr Index kLeastPieceSamples = 48;  ///< about 16 s²: what is smaller can't be registered
inline constexpr Index kLeastPieceShare = 32;    ///< a piece has at least 1/32 of the largest one's samples
inline constexpr Index kPieceParts = 64;         ///< partial sums: sample i goes to part i % 64

/// Every vertex by itself, of no number.
struct PieceStart {
  View<std::uint32_t> parent, samples;
  View<Index> number;
  TACTUS_HD void operator()(Index v) const {
    parent[v] = static_cast<std::uint32_t>(v);
    samples[v] = 0;
    number[v] = kNoPiece;
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

/// Counts the samples of each piece, and lists those that are large enough. The list's order depends on the
/// order of threads, what is made of it doesn't.
struct CountPieceSamples {
  static constexpr int kGrain = 1024;
  View<const Index> root;  ///< of each sample
  View<std::uint32_t> samples;
  View<std::uint32_t> candidates, candidate_count;
  TACTUS_HD void operator()(Index i) const {
    const Index r = root[i];
    if (atomic_fetch_add(samples[r], 1) + 1 == static_cast<std::uint32_t>(kLeastPieceSamples))
      candidates[static_cast<Index>(atomic_fetch_add(candidate_count[0], 1))] = static_cast<std::uint32_t>(r);
  }
};

/// A piece of the surface of one frame.
struct SurfacePiece {
  Index label = -1;  ///< the same from frame to frame
  Index samples = 0;
  Index next = -1;  ///< its number in the frame after
  float area_m2 = 0;
  Vec3f center_m;       ///< of gravity
  Vec3f low_m, high_m;  ///< box of its samples
  TACTUS_HD float size_m() const { return length(high_m - low_m); }
  /// False only for what is farther than `reach_m` from all its samples.
  TACTUS_HD bool may_reach(Vec3f p_m, float reach_m) const { return outside_m(p_m) < reach_m; }
  /// How far outside its box a point is along the farthest axis: no sample is nearer. < 0: in it.
  TACTUS_HD float outside_m(Vec3f p_m) const {
    const Vec3f out = max(low_m - p_m, p_m - high_m);
    return max(out.x, max(out.y, out.z));
  }
};

/// A piece that was seen once, and may come back: a hand that left the view, or that touches another.
struct LostPiece {
  static constexpr Index kFrames = 15;  ///< so long its label is kept
  Index label = -1;
  Index frames = 0;  ///< since it was seen
  float area_m2 = 0, size_m = 0;
  Vec3f center_m;
};

/// All pieces of a frame, the largest first.
struct SurfacePieces {
  Index count = 0;       ///< >= 1: what can't be told apart is one piece
  Index mixed = 0;       ///< != 0: there are samples that aren't the first piece's
  Index next_label = 0;  ///< for what is seen for the first time
  SurfacePiece piece[kPieces];
  Index lost_count = 0;
  LostPiece lost[kPieces];  ///< the longest lost first
  /// Points of each piece that are registered, at most: equal shares.
  TACTUS_HD Index share_of(Index points) const {
    Index parts = 1;
    while (parts < count) parts *= 2;
    return points / parts;
  }
  /// How many points of piece k are registered.
  TACTUS_HD Index points_of(Index k) const { return min(piece[k].samples, share_of(kFitPoints)); }
};

/// Numbers the largest pieces, by their samples and then by their root. Empties the list.
struct ChoosePieces {
  View<const std::uint32_t> samples, candidates;
  View<std::uint32_t> candidate_count;
  View<const Index> sample_count;
  View<Index> number;
  View<SurfacePieces> pieces;
  TACTUS_HD void operator()(Index) const {
    SurfacePieces& all = pieces[0];
    std::uint32_t root[kPieces];
    Index chosen = 0;
    for (Index c = 0, n = static_cast<Index>(candidate_count[0]); c < n; ++c) {
      std::uint32_t next = candidates[c];
      for (Index k = 0; k < kPieces; ++k) {  // inserts by moving what is smaller one on
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
    for (Index k = 0; k < chosen && size(root[k]) * kLeastPieceShare >= size(root[0]); ++k) {
      number[static_cast<Index>(root[k])] = k;
      all.piece[k].samples = size(root[k]);
      counted += size(root[k]);
      all.count = k + 1;
    }
    all.mixed = all.count > 1 || (all.count == 1 && counted < sample_count[0]) ? 1 : 0;
    if (all.count == 0) {
      all.count = 1;
      all.piece[0].samples = sample_count[0];
    }
  }

 private:
  TACTUS_HD Index size(std::uint32_t r) const { return static_cast<Index>(samples[static_cast<Index>(r)]); }
  TACTUS_HD bool before(std::uint32_t a, std::uint32_t b) const {
    return size(a) != size(b) ? size(a) > size(b) : a < b;
  }
};

/// From the root of each sample to the number of its piece.
struct NumberSamples {
  View<const Index> number;
  View<const SurfacePieces> pieces;
  View<Index> piece;  ///< in: root, out: number
  TACTUS_HD void operator()(Index i) const { piece[i] = pieces[0].mixed != 0 ? number[piece[i]] : 0; }
};

/// Partial sums of one piece.
struct PieceSums {
  float area_m2, x, y, z;  ///< area and its first moments
  Vec3f low_m, high_m;
  Index samples;  ///< of the part's run of consecutive samples, not of every 64th
};

/// Thread kPieceParts k + p: part p of piece k.
struct PiecePartSums {
  static constexpr int kGrain = 4;
  SamplesView samples;
  View<const SurfacePieces> pieces;
  View<PieceSums> parts;
  TACTUS_HD void operator()(Index kp) const {
    const Index k = kp / kPieceParts, p = kp % kPieceParts, n = samples.count[0];
    const SurfacePieces& all = pieces[0];
    if (k >= all.count) return;
    const bool mixed = all.mixed != 0;
    Vec3f x{}, low{1e30F, 1e30F, 1e30F}, high{-1e30F, -1e30F, -1e30F};
    float area = 0;
    for (Index i = p; i < n; i += kPieceParts) {
      const Index of = mixed ? samples.piece[i] : k;
      if (max(of, Index(0)) == k) {
        low = min(low, samples.x_m[i]);
        high = max(high, samples.x_m[i]);
      }
      if (of != k) continue;
      area += samples.area_m2[i];
      x += samples.area_m2[i] * samples.x_m[i];
    }
    Index own = 0;
    const Index last = run_begin(p + 1, n);
    for (Index i = run_begin(p, n); i < last; ++i) own += !mixed || samples.piece[i] == k ? 1 : 0;
    parts[kp] = {area, x.x, x.y, x.z, low, high, own};
  }
  /// First sample of run p of the kPieceParts runs into which n samples are cut.
  TACTUS_HD static Index run_begin(Index p, Index n) {
    return static_cast<Index>(static_cast<std::int64_t>(p) * n / kPieceParts);
  }
};

/// Centre, area and box of piece k.
struct PieceCenters {
  View<const PieceSums> parts;
  View<const SurfacePieces> before;
  View<SurfacePieces> pieces;
  TACTUS_HD void operator()(Index k) const {
    SurfacePieces& all = pieces[0];
    if (k >= all.count) return;
    float sum[4] = {};
    Vec3f low{1e30F, 1e30F, 1e30F}, high{-1e30F, -1e30F, -1e30F};
    for (Index p = 0; p < kPieceParts; ++p) {
      const PieceSums& part = parts[k * kPieceParts + p];
      sum[0] += part.area_m2;
      sum[1] += part.x;
      sum[2] += part.y;
      sum[3] += part.z;
      low = min(low, part.low_m);
      high = max(high, part.high_m);
    }
    SurfacePiece& piece = all.piece[k];
    piece.area_m2 = sum[0];
    piece.center_m = sum[0] > 0.F ? Vec3f{sum[1], sum[2], sum[3]} / sum[0] : before[0].piece[0].center_m;
    piece.low_m = low;
    piece.high_m = high;
  }
};

/// Keeps points of the last frame's surface for the registration: each piece evenly. Point share*k + j is
/// sample floor(j n / kept) of the n of piece k. What was this frame's pieces becomes the last frame's.
struct KeepPoints {
  static constexpr int kGrain = 64;
  SamplesView from;
  View<const PieceSums> parts;
  View<const SurfacePieces> pieces;
  View<SurfacePieces> before;
  View<Vec3f> x_m;
  TACTUS_HD void operator()(Index j) const {
    const SurfacePieces& all = pieces[0];
    if (j == 0) before[0] = all;
    const Index share = all.share_of(x_m.size()), k = j / share;
    if (k >= all.count) return;
    const Index n = all.piece[k].samples, kept = all.points_of(k);
    if (j % share >= kept) return;
    const auto rank = static_cast<Index>(static_cast<std::int64_t>(j % share) * n / kept);
    x_m[j] = from.x_m[all.mixed != 0 ? sample_of(k, rank) : rank];
  }

 private:
  /// The sample of that rank among those of piece k.
  TACTUS_HD Index sample_of(Index k, Index rank) const {
    Index p = 0;
    for (; p + 1 < kPieceParts && rank >= parts[k * kPieceParts + p].samples; ++p)
      rank -= parts[k * kPieceParts + p].samples;
    const Index n = from.count[0];
    Index i = PiecePartSums::run_begin(p, n);
    for (; i + 1 < n; ++i) {
      if (from.piece[i] == k && rank-- == 0) break;
    }
    return i;
  }
};

}  // namespace tactus
