// Where bodies come to rest under gravity and loads, before the first frame.
#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"
#include "tactus/sim/body/kinetic_damping.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

/// Share of the force of all loads that may be left.
constexpr double kResidual = 1e-3;
/// No more work than so many frames.
constexpr int kMostFrames = 200;
constexpr double kTells_s = 5;  ///< between two lines in the log
/// Force that rounding of positions makes: with stiff bodies, no less can be reached. Rounding moves each
/// node by a third of 2^-24 of its coordinates, and a third of the fastest mode's stiffness, m (2 / dt)^2,
/// answers.
double rounding_N(const SoftBody& body) {
  const CubeLattice& lattice = body.shape().lattice;
  double masses2 = 0, farthest_m = 0;
  for (const float m : lattice.node_mass_kg) masses2 += sqr(double{m});
  for (const Vec3f p : lattice.rest_positions_m()) farthest_m = std::max(farthest_m, double{length(p)});
  const double omega2 = 4 / sqr(double{body.tissue().model().stable_step_s()});
  return std::sqrt(masses2) * omega2 * farthest_m / 9 / (1 << 24);
}

/// A quarter of a swing takes at least and at most so many pieces.
constexpr int kFewPieces = 6, kManyPieces = 24;
/// Bodies that touch one another rattle by a rounding from substep to substep: the force of one alone never
/// falls below 0.1 of the loads.
constexpr int kSubstepsOfRattle = 8;

/// How the nodes of a body moved in a piece that began at before_m, in the mean.
std::vector<Vec3d> mean_velocities_m_s(const std::vector<Vec3f>& before_m, const std::vector<Vec3f>& now_m,
                                       double seconds) {
  std::vector<Vec3d> v(now_m.size());
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = (1 / seconds) * vec_cast<double>(now_m[i] - before_m[i]);
  return v;
}

double kinetic_J(const CubeLattice& lattice, const std::vector<Vec3d>& v_m_s) {
  double sum = 0;
  for (std::size_t i = 0; i < v_m_s.size(); ++i)
    sum += 0.5 * double{lattice.node_mass_kg[i]} * dot(v_m_s[i], v_m_s[i]);
  return sum;
}

/// Momenta of all nodes as one vector: its length.
double momentum_N_s(const CubeLattice& lattice, const std::vector<Vec3d>& v_m_s) {
  double sum = 0;
  for (std::size_t i = 0; i < v_m_s.size(); ++i)
    sum += sqr(double{lattice.node_mass_kg[i]}) * dot(v_m_s[i], v_m_s[i]);
  return std::sqrt(sum);
}

/// All nodes stand still where they were so long ago. Synchronizes.
void stop_nodes(SoftBody& body, ExecContext& ctx, double ago_s) {
  std::vector<Vec3f> x_m = body.positions_m(ctx), v_m_s = body.velocities_m_s(ctx);
  for (std::size_t i = 0; i < x_m.size(); ++i)
    x_m[i] = x_m[i] - static_cast<float>(ago_s) * std::exchange(v_m_s[i], Vec3f{});
  body.set_nodes(x_m, v_m_s);
}

/// Takes the mean velocity of each node from its velocity, as far as that goes the same way: fast swings turn
/// more than once in a piece, and would gain from a mean that goes the other way. Synchronizes.
void slow_nodes(SoftBody& body, ExecContext& ctx, std::span<const Vec3d> mean_m_s) {
  std::vector<Vec3f> v_m_s = body.velocities_m_s(ctx);
  for (std::size_t i = 0; i < v_m_s.size(); ++i) {
    const double along = dot(vec_cast<double>(v_m_s[i]), mean_m_s[i]), all = dot(mean_m_s[i], mean_m_s[i]);
    if (along > 0) v_m_s[i] -= vec_cast<float>(std::min(along / all, 1.0) * mean_m_s[i]);
  }
  body.set_nodes(body.positions_m(ctx), v_m_s);
}

/// One body.
class Settling {
 public:
  explicit Settling(SoftBody& body, ExecContext& ctx) : body_(&body) {
    if (touches()) before_m_ = body.positions_m(ctx);
  }
  void after_piece(ExecContext& ctx, int substeps, double seconds) {
    is_done_ = is_done_ || body_->status().is_frozen;
    const CubeLattice& lattice = body_->shape().lattice;
    std::vector<Vec3d> v_m_s;
    if (touches()) {
      std::vector<Vec3f> now_m = body_->positions_m(ctx);
      v_m_s = mean_velocities_m_s(before_m_, now_m, seconds);
      before_m_ = std::move(now_m);
    }
    const auto back =
        damping_.after_piece(touches() ? kinetic_J(lattice, v_m_s) : body_->status().motion.kinetic_J);
    stopped_ = back.has_value();
    if (damping_.just_started()) {
      if (!touches())
        for (const Vec3f v : body_->velocities_m_s(ctx)) v_m_s.push_back(vec_cast<double>(v));
      // From rest, with the same force in each of n substeps of dt: v = n dt a, x = n (n + 1) / 2 dt^2 a.
      const double mean = touches() ? 2.0 * substeps / (substeps + 1) : 1;
      note_force(mean * momentum_N_s(lattice, v_m_s) / seconds);
    }
    if (!stopped_) return;
    if (touches())
      slow_nodes(*body_, ctx, v_m_s);
    else
      stop_nodes(*body_, ctx, *back * seconds);
  }
  bool is_done() const { return is_done_; }
  /// Shorter or longer pieces are wanted: a quarter of a swing took few of them, or many.
  bool wants_shorter() const { return !is_done_ && stopped_ && damping_.pieces_of_swing() < kFewPieces; }
  bool wants_longer() const {
    const int since = damping_.pieces_since_stop();
    return is_done_ || (since > 0 && since % kManyPieces == 0);
  }
  /// The force doesn't fall any more.
  bool is_stuck() const { return !is_done_ && stops_since_half_ > kMostStops; }
  double residual() const { return loads_N_ > 0 ? left_N_ / loads_N_ : 0; }

 private:
  static constexpr int kStopsOfRounding = 8;
  /// On a slope, a stiff block's force still fell fivefold from stop 200 to stop 1,500. Others need some 12.
  static constexpr int kMostStops = 2000;
  /// Contact moves nodes, too: where a body rests on something, velocities between gravity and contact are
  /// not those of its nodes.
  bool touches() const { return body_->points().count() > 0; }
  void note_force(double force_N) {
    if (loads_N_ == 0) loads_N_ = force_N;
    left_N_ = force_N;
    stops_since_half_ = force_N < 0.5 * half_N_ ? 0 : stops_since_half_ + 1;
    if (stops_since_half_ == 0) half_N_ = force_N;
    const bool rounding = stops_since_half_ > kStopsOfRounding && force_N <= rounding_N(*body_);
    is_done_ = is_done_ || force_N <= kResidual * loads_N_ || rounding;
  }
  SoftBody* body_;
  KineticDamping damping_;
  std::vector<Vec3f> before_m_;
  double loads_N_ = 0, left_N_ = 0, half_N_ = 1e300;
  int stops_since_half_ = 0;
  bool stopped_ = false, is_done_ = false;
};

}  // namespace

/// A body that nothing holds would fall for ever, unless another body is below.
void World::Impl::check_settles() const {
  if (scene_.frame.start != FrameStart::settled || !scene_.obstacles.empty() ||
      (scene_.contact.bodies && scene_.bodies.size() > 1))
    return;
  for (const BodyDescription& body : scene_.bodies) {
    const bool pulled = length(scene_.gravity_m_s2) > 0 || !body.loads.empty();
    if (pulled && body.fixed.empty() && body.moved.empty())
      throw usage_error("'frame.start' is settled, but nothing holds body '" + body.name +
                        "': expected 'fixed', 'moved' or an obstacle, or start: undeformed");
  }
}

/// Length of a substep that is stable as bodies are strained now.
double World::Impl::settling_dt_s() const {
  const double frame_s = scene_.frame.dt_s.value_or(1.0 / 30);
  return frame_s / substeps_for(frame_s, 0);
}

/// A piece: so many substeps. Time doesn't go on for the motions and loads of the bodies.
void World::Impl::settle_interval(int substeps, StepReport& report) {
  Timings unused;
  const double dt_s = settling_dt_s();
  schedule_.run({.dt_s = static_cast<float>(dt_s),
                 .gravity_m_s2 = vec_cast<float>(scene_.gravity_m_s2),
                 .substeps = substeps,
                 .settles = 1},
                false);
  schedule_.finish(unused);
  StepReport of_piece;
  collect_bodies(dt_s * substeps, substeps, of_piece);
  std::move(of_piece.notices.begin(), of_piece.notices.end(), std::back_inserter(report.notices));
  report.settling_substeps += substeps;
}

void World::Impl::settle(StepReport& report) {
  ExecContext& ctx = devices_.context(0);
  std::vector<Settling> all;
  for (const auto& body : bodies_) all.emplace_back(*body, ctx);
  const int most = kMostFrames * substeps_for(scene_.frame.dt_s.value_or(1.0 / 30), 0);
  const int unit = schedule_.unit(), least = scene_.contact.bodies && bodies_.size() > 1
                                                 ? unit * ((kSubstepsOfRattle + unit - 1) / unit)
                                                 : unit;
  int piece = least;
  const auto ends = [](const Settling& body) { return body.is_done() || body.is_stuck(); };
  double told_s = now_s();
  while (report.settling_substeps < most && !std::all_of(all.begin(), all.end(), ends)) {
    const double seconds = piece * settling_dt_s();
    settle_interval(piece, report);
    for (Settling& body : all) body.after_piece(ctx, piece, seconds);
    if (std::any_of(all.begin(), all.end(), std::mem_fn(&Settling::wants_shorter)))
      piece = std::max(piece / 2, least);
    else if (std::all_of(all.begin(), all.end(), std::mem_fn(&Settling::wants_longer)))
      piece *= 2;
    if (now_s() - told_s < kTells_s) continue;
    told_s = now_s();
    log_info("bodies are settling: " + std::to_string(report.settling_substeps) + " of at most " +
             std::to_string(most) + " substeps");
  }
  last_substep_s_ = 0;
  bool are_at_rest = true;
  for (std::size_t b = 0; b < all.size(); ++b) {
    stop_nodes(*bodies_[b], ctx, 0);
    are_at_rest = are_at_rest && all[b].is_done() && !bodies_[b]->status().is_frozen;
    if (all[b].is_done()) continue;
    report.notices.push_back({"body.unsettled", Severity::warning,
                              "body '" + bodies_[b]->name() + "' is not at rest after " +
                                  std::to_string(report.settling_substeps) + " substeps: the force left is " +
                                  number_text(all[b].residual(), kResidual) + " of its loads, expected " +
                                  number_text(kResidual),
                              "hold it better, or let it swing with 'drag_per_s'"});
  }
  if (are_at_rest) log_info("bodies settled in " + std::to_string(report.settling_substeps) + " substeps");
}

}  // namespace tactus
