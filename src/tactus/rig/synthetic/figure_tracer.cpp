#include "tactus/rig/synthetic/figure_tracer.h"

#include <algorithm>
#include <bit>

namespace tactus {
namespace {

constexpr float kHit_m = FigureTracer::kHit_m;
/// A ray that passes the figure at <= kHit_m shows a sample <= 2 kHit_m on every way of sphere tracing: if a
/// step of length f(t) jumps over a dip d at t + x, then f(t) <= d + x, so at its end f <= d + (f(t) - x) <=
/// 2 d. One more for rounding: samples above this are no evidence of a hit.
constexpr float kNear_m = 3 * kHit_m;
/// Most steps of a packet of rays before each of those left is asked alone.
constexpr int kPacketSteps = 160;
constexpr Index kTile = 32, kBlock = 8, kPixelsWide = 4, kPixelsHigh = 2;

/// Where a ray may meet the bounding spheres of a shape: [begin, end], begin > end for nowhere.
struct Span {
  float begin_m = 1e9F, end_m = -1e9F;
};

struct Relation {
  Span span;
  bool meets = false;
};
/// How a cone (or a ray, tangent 0) lies to a sphere.
Relation relation(Vec3f center_m, float radius_m, Vec3f eye_m, Vec3f axis, float tangent) {
  const Vec3f c = center_m - eye_m;
  const float along = dot(c, axis);
  const float across = length(c - along * axis);
  const bool meets =
      along > -radius_m && (across - along * tangent) <= radius_m * sqrt(1 + tangent * tangent);
  return {{std::max(along - radius_m, 0.F), along + radius_m}, meets};
}
/// To the bounding sphere of a limb, widened by the seam, within which it matters.
Relation relation(const FigureShape& shape, const FigureShape::Limb& limb, Vec3f eye_m, Vec3f axis,
                  float tangent) {
  return relation(limb.center_m, limb.radius_m + shape.seam_m() + 1e-4F, eye_m, axis, tangent);
}

/// Limbs that can matter in a cone: one of their parts, widened by its seams, meets it.
unsigned limbs_in_cone(const FigureShape& shape, Vec3f eye_m, Vec3f axis, float tangent) {
  unsigned limbs = 0;
  for (std::size_t i = 0; i < shape.limbs().size(); ++i) {
    const FigureShape::Limb& limb = shape.limbs()[i];
    if (!relation(shape, limb, eye_m, axis, tangent).meets) continue;
    const std::span<const RoundCone> cones = shape.cones(limb);
    const float margin_m = shape.seam_m() + limb.blend_m + 1e-4F;
    const bool meets = cones.empty() || std::any_of(cones.begin(), cones.end(), [&](const RoundCone& c) {
                         // The smallest sphere around the two end spheres.
                         const float radius_b_m = c.radius_a_m - c.slope * c.length_m;
                         const float radius_m = 0.5F * (c.length_m + c.radius_a_m + radius_b_m);
                         const Vec3f center_m = c.a_m + (radius_m - c.radius_a_m) * c.axis;
                         return relation(center_m, radius_m + margin_m, eye_m, axis, tangent).meets;
                       });
    if (meets) limbs |= 1U << i;
  }
  return limbs;
}

}  // namespace

FigureTracer::FigureTracer(const Camera& camera) : width_px_(camera.width_px), height_px_(camera.height_px) {
  check_camera(camera);
  eye_m_ = vec_cast<float>(camera.center_world());
  M_ = mat_cast<float>(transpose(camera.T_cam_world.R) * inverse(camera.intrinsics()));
}

float FigureTracer::first_hit_m(const FigureShape& shape, float x_px, float y_px) const {
  const Vec3f d = direction(x_px, y_px);
  Span span;
  for (const FigureShape::Limb& limb : shape.limbs()) {
    const Relation r = relation(shape, limb, eye_m_, d, 0);
    if (!r.meets) continue;
    span = {std::min(span.begin_m, r.span.begin_m), std::max(span.end_m, r.span.end_m)};
  }
  constexpr int kMostSteps = 4000;  // only a ray that grazes a plane along its whole length comes near
  float t = span.begin_m;
  for (int i = 0; i < kMostSteps && t <= span.end_m; ++i) {
    const float f = shape.distance_m(eye_m_ + t * d);
    if (f <= kHit_m) return t;
    t += f;
  }
  return 0;
}

FigureTracer::Cones FigureTracer::make_cones(Index x_px, Index y_px, Size size, Index columns) const {
  Cones cones;
  Float8 x0, y0;
  for (Index i = 0; i < 8; ++i) {
    const Index x = x_px + size.width_px * (i % columns), y = y_px + size.height_px * (i / columns);
    if (x < width_px_ && y < height_px_) cones.live |= 1U << i;
    x0.set(i, static_cast<float>(x));
    y0.set(i, static_cast<float>(y));
  }
  const auto right = static_cast<float>(size.width_px - 1), bottom = static_cast<float>(size.height_px - 1);
  cones.axis = direction(x0 + Float8(0.5F * right), y0 + Float8(0.5F * bottom));
  cones.tangent = 0.F;
  for (int corner = 0; corner < 4; ++corner) {
    const Vec3<Float8> d =
        direction(x0 + Float8((corner & 1) ? right : 0.F), y0 + Float8((corner & 2) ? bottom : 0.F));
    const Float8 along = dot(d, cones.axis);
    const Vec3<Float8> across = d - along * cones.axis;
    cones.tangent = max(cones.tangent, sqrt(dot(across, across)) / along);
  }
  cones.tangent = cones.tangent * Float8(1.0001F) + Float8(1e-6F);  // rounding
  return cones;
}

void FigureTracer::trace_cones(const FigureShape& shape, Cones& cones) const {
  const Float8 one(1.F), zero(0.F), margin(2 * kNear_m), a = cones.tangent;
  const auto point = [&](const Float8& t) {
    return Vec3<Float8>{Float8(eye_m_.x) + t * cones.axis.x, Float8(eye_m_.y) + t * cones.axis.y,
                        Float8(eye_m_.z) + t * cones.axis.z};
  };
  // Empty as far as balls on the axis reach: a ball of radius f at t covers the cone up to t + s where
  // s^2 + (a (t + s))^2 = f^2.
  Float8 t = cones.begin_m;
  unsigned moving = cones.live & ~less_bits(cones.end_m, t);
  const unsigned candidates = moving;
  unsigned stopped = 0;
  for (int i = 0; i < 64 && moving; ++i) {
    const Float8 f = shape.distance_m(point(t), cones.limbs) - margin;
    const Float8 r = a * t, a2 = one + a * a;
    const Float8 s = (sqrt(max(f * f * a2 - r * r, zero)) - a * r) / a2;
    const unsigned stop = moving & (less_bits(f, r) | less_bits(s, Float8(0.1F) * r + Float8(1e-4F)));
    stopped |= stop;
    moving &= ~stop;
    t = select(moving, t + s, t);
    moving &= ~less_bits(cones.end_m, t);
  }
  stopped |= moving;  // out of steps: undecided
  cones.begin_m = t;
  // Full where a ball inside the figure spans the whole cone. Depth -r can't be nearer than f + r.
  unsigned searching = stopped & candidates;
  for (int i = 0; i < 8 && searching; ++i) {
    const Float8 f = shape.distance_m(point(t), cones.limbs);
    const Float8 r = a * t + margin;
    cones.full |= searching & less_bits(f + r, zero);
    searching &= ~cones.full;
    t = select(searching, t + max(f + r, Float8(0.2F) * r), t);
    searching &= ~less_bits(cones.end_m, t);
  }
  cones.mixed = stopped & candidates & ~cones.full;
}

void FigureTracer::queue_pixels(Index x_px, Index y_px, const Cones& parent, int lane,
                                RayQueue& queue) const {
  Float8 x, y;
  for (int i = 0; i < 8; ++i) {
    x.set(i, static_cast<float>(x_px + i % kPixelsWide));
    y.set(i, static_cast<float>(y_px + i / kPixelsWide));
  }
  const Vec3<Float8> d = direction(x, y);
  for (int i = 0; i < 8; ++i) {
    const Index column = x_px + i % kPixelsWide, row = y_px + i / kPixelsWide;
    if (column >= width_px_ || row >= height_px_) continue;
    queue.rays[static_cast<std::size_t>(queue.count++)] = {
        {d.x[i], d.y[i], d.z[i]}, parent.begin_m[lane], column, row};
  }
}

namespace {

/// Eight rays under way. Everything before t is known to be no hit; f is the distance there, `fall` its loss
/// per way, `longest` a limit after a step that proved nothing.
struct RayPacket {
  Vec3<Float8> direction;
  Float8 t, f, fall, longest, steps_left;
  std::array<int, 8> ray{};

  void start(int lane, int index, Vec3f d, float begin_m) {
    ray[static_cast<std::size_t>(lane)] = index;
    direction.x.set(lane, d.x);
    direction.y.set(lane, d.y);
    direction.z.set(lane, d.z);
    t.set(lane, begin_m);
    f.set(lane, 0);  // with `longest`: the first step has length 0
    fall.set(lane, 0);
    longest.set(lane, 0);
    steps_left.set(lane, static_cast<float>(kPacketSteps));
  }
  /// Next step: the longest that will probably prove the way empty, or (`daring`), for rays that approach,
  /// one that may end well inside.
  Float8 step(bool daring) const {
    Float8 s = Float8(1.9F) * f / (Float8(1.F) + max(fall, Float8(-0.6F)));
    if (daring) {
      const Float8 inside = Float8(1.2F) * f / max(fall, Float8(0.02F)) + Float8(2e-5F);
      s = select(less_bits(Float8(0.02F), fall), inside, s);
    }
    return max(min(s, longest), f);
  }
  /// The distance after `s` is g. Moves on where the balls at both ends cover the way, or where the step was
  /// no longer than the first ball's radius.
  void advance(const Float8& s, const Float8& g, bool daring) {
    const unsigned passed = less_bits(s + Float8(kNear_m), f + g) | ~less_bits(f, s);
    const Float8 loss = select(less_bits(Float8(0.F), s), (f - g) / max(s, Float8(1e-9F)), Float8(0.F));
    fall = select(passed, loss, fall);
    t = select(passed, t + s, t);
    longest = select(passed, Float8(1e3F), daring ? Float8(1e3F) : f);
    f = select(passed, g, f);
    steps_left = steps_left - Float8(1.F);
  }
};

Vec3<Float8> points(Vec3f eye_m, const Vec3<Float8>& direction, const Float8& t) {
  return {Float8(eye_m.x) + t * direction.x, Float8(eye_m.y) + t * direction.y,
          Float8(eye_m.z) + t * direction.z};
}

}  // namespace

void FigureTracer::trace_hits(const FigureShape& shape, const RayQueue& queue, BitMask& mask) const {
  RayPacket packet;
  const Float8 end_m(queue.end_m), zero(0.F);
  unsigned busy = 0;
  int next = 0;
  for (bool daring = false;; daring = !daring) {
    // A lane whose ray is decided takes the next one; rays need from 2 to 100 steps.
    if (next < queue.count && std::popcount(busy) <= 6) {
      for (unsigned idle = ~busy & 0xFFU; idle && next < queue.count; idle &= idle - 1) {
        const int lane = std::countr_zero(idle);
        const RayQueue::Ray& ray = queue.rays[static_cast<std::size_t>(next)];
        packet.start(lane, next++, ray.direction, ray.begin_m);
        busy |= 1U << lane;
      }
    }
    if (!busy) break;
    const Float8 s = packet.step(daring);
    const Float8 g = shape.distance_m(points(eye_m_, packet.direction, packet.t + s), queue.limbs);
    const unsigned hit = busy & less_bits(g, Float8(-kHit_m));
    packet.advance(s, g, daring);
    const unsigned missed = busy & ~hit & less_bits(end_m, packet.t);
    const unsigned unsure =
        busy & ~hit & ~missed & (less_bits(packet.f, Float8(kNear_m)) | less_bits(packet.steps_left, zero));
    for (unsigned done = hit | unsure; done; done &= done - 1) {
      const int lane = std::countr_zero(done);
      const RayQueue::Ray& ray =
          queue.rays[static_cast<std::size_t>(packet.ray[static_cast<std::size_t>(lane)])];
      if ((hit >> lane & 1U) || resolve(shape, ray, packet.t[lane], queue.limbs))
        mask.set(ray.x_px, ray.y_px);
    }
    busy &= ~(hit | missed | unsure);
  }
}

bool FigureTracer::resolve(const FigureShape& shape, const RayQueue::Ray& ray, float t_m,
                           unsigned limbs) const {
  // Any inner point further on proves a hit.
  for (float ahead_m = 2e-4F; ahead_m < 0.02F; ahead_m *= 3) {
    if (shape.distance_m(eye_m_ + (t_m + ahead_m) * ray.direction, limbs) < -kHit_m) return true;
  }
  return first_hit_m(shape, static_cast<float>(ray.x_px), static_cast<float>(ray.y_px)) > 0;
}

void FigureTracer::trace_distances(const FigureShape& shape, const RayQueue& queue, BitMask* mask,
                                   DepthImage& distance_m) const {
  for (int first = 0; first < queue.count; first += 8) {
    const int lanes = std::min(8, queue.count - first);
    Vec3<Float8> d;
    Float8 t;
    for (int i = 0; i < 8; ++i) {
      const RayQueue::Ray& ray = queue.rays[static_cast<std::size_t>(first + std::min(i, lanes - 1))];
      d.x.set(i, ray.direction.x);
      d.y.set(i, ray.direction.y);
      d.z.set(i, ray.direction.z);
      t.set(i, ray.begin_m);
    }
    unsigned moving = (1U << lanes) - 1, near = 0;
    for (int i = 0; i < kPacketSteps && moving; ++i) {
      const Float8 f = shape.distance_m(points(eye_m_, d, t), queue.limbs);
      near |= moving & less_bits(f, Float8(kNear_m));
      moving &= ~near;
      t = select(moving, t + f, t);
      moving &= ~less_bits(Float8(queue.end_m), t);
    }
    // Clearly inside a tenth of a millimetre later: a hit on every way of tracing. Else ask the definition.
    const Float8 later = shape.distance_m(points(eye_m_, d, t + Float8(1e-4F)), queue.limbs);
    const unsigned hit = near & less_bits(later, Float8(-kHit_m));
    for (unsigned open = near | moving; open; open &= open - 1) {
      const int i = std::countr_zero(open);
      const RayQueue::Ray& ray = queue.rays[static_cast<std::size_t>(first + i)];
      const float hit_m =
          (hit >> i & 1U) ? t[i]
                          : first_hit_m(shape, static_cast<float>(ray.x_px), static_cast<float>(ray.y_px));
      if (hit_m <= 0) continue;
      distance_m(ray.x_px, ray.y_px) = hit_m;
      if (mask) mask->set(ray.x_px, ray.y_px);
    }
  }
}

void FigureTracer::set_pixels(Index x_px, Index y_px, Size size, BitMask& mask) const {
  const auto columns = static_cast<unsigned>(std::min(size.width_px, width_px_ - x_px));
  const std::uint32_t bits = (columns == 32 ? ~0U : (1U << columns) - 1) << (x_px & 31);
  const Index end = std::min(y_px + size.height_px, height_px_);
  for (Index y = y_px; y < end; ++y)
    mask.words[static_cast<std::size_t>(y * mask.words_per_row() + (x_px >> 5))] |= bits;
}

void FigureTracer::trace_block(const FigureShape& shape, Index x_px, Index y_px, const Cones& parent,
                               int lane, BitMask* mask, DepthImage* distance_m) const {
  constexpr Size kSize{kPixelsWide, kPixelsHigh};
  constexpr Index kColumns = kBlock / kPixelsWide;
  Cones cones = make_cones(x_px, y_px, kSize, kColumns);
  // Limbs that the block's cone doesn't meet can't change a sign in it.
  const Vec3f axis{parent.axis.x[lane], parent.axis.y[lane], parent.axis.z[lane]};
  const float a = parent.tangent[lane];
  cones.limbs = limbs_in_cone(shape, eye_m_, axis, a);
  cones.begin_m = parent.begin_m[lane];
  cones.end_m = parent.end_m[lane] * sqrt(1 + a * a);
  trace_cones(shape, cones);
  RayQueue queue;
  queue.limbs = cones.limbs;
  // A ray at an angle to the axis reaches the plane at t after at most t sqrt(1 + a^2).
  queue.end_m = cones.end_m[0] * sqrt(1 + a * a);
  for (int i = 0; i < 8; ++i) {
    const Index x = x_px + kPixelsWide * (i % kColumns), y = y_px + kPixelsHigh * (i / kColumns);
    const bool full = (cones.full >> i & 1U) != 0;
    if (full && !distance_m) set_pixels(x, y, kSize, *mask);
    if ((cones.mixed >> i & 1U) || (full && distance_m)) queue_pixels(x, y, cones, i, queue);
  }
  if (distance_m) {
    trace_distances(shape, queue, mask, *distance_m);
  } else {
    trace_hits(shape, queue, *mask);
  }
}

void FigureTracer::trace_tile(const FigureShape& shape, Index x_px, Index y_px, const Cones& parent, int lane,
                              BitMask* mask, DepthImage* distance_m) const {
  constexpr Index kColumns = kTile / kBlock;
  const Vec3f axis{parent.axis.x[lane], parent.axis.y[lane], parent.axis.z[lane]};
  const unsigned limbs = limbs_in_cone(shape, eye_m_, axis, parent.tangent[lane]);
  for (Index half = 0; half < 2; ++half) {
    const Index y0 = y_px + 2 * kBlock * half;
    Cones cones = make_cones(x_px, y0, {kBlock, kBlock}, kColumns);
    // The parent's empty part ends at a plane, which rays beside its axis reach later.
    const float a = parent.tangent[lane];
    cones.begin_m = parent.begin_m[lane];
    cones.end_m = parent.end_m[lane] * sqrt(1 + a * a);
    cones.limbs = limbs;
    trace_cones(shape, cones);
    for (int i = 0; i < 8; ++i) {
      const Index x = x_px + kBlock * (i % kColumns), y = y0 + kBlock * (i / kColumns);
      const bool full = (cones.full >> i & 1U) != 0;
      if (full && !distance_m) set_pixels(x, y, {kBlock, kBlock}, *mask);
      if ((cones.mixed >> i & 1U) || (full && distance_m))
        trace_block(shape, x, y, cones, i, mask, distance_m);
    }
  }
}

void FigureTracer::trace_strip(const FigureShape& shape, Index strip, BitMask* mask,
                               DepthImage* distance_m) const {
  const Index y = strip * kTile;
  for (Index x0 = 0; x0 < width_px_; x0 += 8 * kTile) {
    Cones cones = make_cones(x0, y, {kTile, kTile}, 8);
    for (int i = 0; i < 8; ++i) {
      Span span;
      for (const FigureShape::Limb& limb : shape.limbs()) {
        const Relation r = relation(shape, limb, eye_m_, {cones.axis.x[i], cones.axis.y[i], cones.axis.z[i]},
                                    cones.tangent[i]);
        if (!r.meets) continue;
        span = {std::min(span.begin_m, r.span.begin_m), std::max(span.end_m, r.span.end_m)};
      }
      cones.begin_m.set(i, span.begin_m);
      cones.end_m.set(i, span.end_m);
    }
    trace_cones(shape, cones);
    for (int i = 0; i < 8; ++i) {
      const Index x = x0 + kTile * i;
      const bool full = (cones.full >> i & 1U) != 0;
      if (full && !distance_m) set_pixels(x, y, {kTile, kTile}, *mask);
      if ((cones.mixed >> i & 1U) || (full && distance_m))
        trace_tile(shape, x, y, cones, i, mask, distance_m);
    }
  }
}

}  // namespace tactus
