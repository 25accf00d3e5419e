#include "tactus/fluid/liquid.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "tactus/fluid/cap_kernels.h"
#include "tactus/fluid/emitter_pattern.h"
#include "tactus/geom/search/visit_both.h"

namespace tactus {
namespace {

/// The most that emitters bring in a step.
Index emitted_of(const LiquidSettings& settings) {
  Index points = 0;
  for (const LiquidEmitter& e : settings.emitters) points += most_in_a_step(e, settings.spacing_m);
  return points;
}
/// The most that come between two steps.
Index arrivals_of(const LiquidSettings& settings) { return settings.arrivals + emitted_of(settings); }

/// A little more than the reach: positions and cuts are rounded.
constexpr float kCopiedReach = 1.F + 1.F / 256;

StepTime of_part(StepTime time, const FrameOnDevices* frame, Index part) {
  if (frame != nullptr) time.frame = frame->view(part);
  return time;
}

}  // namespace

int Liquid::part_count(const DeviceSet& devices, const LiquidSettings& settings) {
  if (!devices.reads_peers()) return 1;
  const Index least_on_gpus = settings.solver == LiquidSolver::dfsph ? kLeastDfsph : kLeastWcsph;
  const Index least =
      std::max(settings.least_particles.value_or(devices.is_cuda() ? least_on_gpus : 1), Index{1});
  return std::clamp(settings.max_particles / least, 1, std::min(devices.count(), kMostLiquidParts));
}

Liquid::Liquid(DeviceSet& devices, const LiquidSettings& settings)
    : devices_(devices),
      settings_(checked(settings)),
      constants_(constants_of(settings_)),
      parts_([&] {
        std::vector<LiquidPart> parts;
        const int count = part_count(devices, settings_);
        for (int p = 0; p < count; ++p)
          parts.emplace_back(devices.device(p), settings_.max_particles, arrivals_of(settings_),
                             constants_.kernel.reach_m(), kFaces + settings_.other_walls, p, count);
        return parts;
      }()),
      split_(devices, parts_),
      balance_(settings_.box_m, part_count()),
      wall_impulse_(devices.device(0), kFaces + settings_.other_walls),
      report_(devices.device(0), 1) {
  make_emitters();
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.sinks = to_device(ctx, settings_.sinks_m);
    if (settings_.solver == LiquidSolver::dfsph) {
      part.sums = Buffer<DfsphSums>(ctx.device(), settings_.max_particles);
      if (!ctx.device().is_cuda())
        part.pair_weight = Buffer<float>(ctx.device(), NearLists::weights(settings_.max_particles));
    }
    if (settings_.carreau) part.shear_m2_s = Buffer<float>(ctx.device(), settings_.max_particles);
    if (settings_.surface_tension_N_m > 0) {
      part.surface = Buffer<LiquidNormal>(ctx.device(), settings_.max_particles);
      part.smooth = Buffer<LiquidNormal>(ctx.device(), settings_.max_particles);
      part.curvature = Buffer<float>(ctx.device(), settings_.max_particles);
    }
    ctx.fill_bytes(part.wall_sums.view(), 0);
  });
  place({});
  // Wounds look for room in the search of the last step, which need not have come.
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.build(ctx, part.x_m.const_view(), part.id.const_view(), part.given(), part.first_copy());
  });
  devices_.synchronize();
}

void Liquid::make_emitters() {
  ExecContext& ctx = devices_.context(0);
  std::vector<EmitterState> states;
  std::vector<Vec3f> points;
  std::vector<float> phases;
  std::vector<Index> of;
  for (const LiquidEmitter& e : settings_.emitters) {
    const EmitterPattern pattern = emitter_pattern(e, settings_.spacing_m);
    states.push_back({.velocity_m_s = e.speed_m_s * normalized(e.direction),
                      .period_s = pattern.period_m / static_cast<double>(e.speed_m_s),
                      .from_s = e.from_s,
                      .until_s = e.until_s,
                      .first = static_cast<Index>(points.size()),
                      .points = static_cast<Index>(pattern.points_m.size()),
                      .first_thread = static_cast<Index>(of.size()),
                      .most = most_in_a_step(e, settings_.spacing_m)});
    points.insert(points.end(), pattern.points_m.begin(), pattern.points_m.end());
    phases.insert(phases.end(), pattern.phases.begin(), pattern.phases.end());
    of.resize(of.size() + at(states.back().most), static_cast<Index>(states.size()) - 1);
  }
  emitters_ = to_device(ctx, states);
  pattern_points_ = to_device(ctx, points);
  pattern_phases_ = to_device(ctx, phases);
  emitter_of_ = to_device(ctx, of);
}

void Liquid::step(const StepTime& time) {
  if (time.frame.empty() && !(time.dt_s <= largest_step_s())) {
    throw Error("liquid: a step of " + std::to_string(time.dt_s) + " s, but the largest stable step is " +
                std::to_string(largest_step_s()) + " s");
  }
  begin_step(time);
  end_step(time);
}

/// On the first device; from there they go where they belong.
void Liquid::emit(const StepTime& time) {
  if (emitters_.empty()) return;
  ExecContext& ctx = devices_.context(0);
  LiquidPart& part = parts_[0];
  ctx.parallel_for("fluid/emission", 1,
                   PlanEmission{time, part.counters.view(), part.count.view(), part.own.view(),
                                emitters_.view(), pattern_phases_.const_view(), settings_.max_particles});
  ctx.parallel_for("fluid/emit", emitter_of_.size(),
                   EmitParticles{emitters_.const_view(), pattern_points_.const_view(),
                                 pattern_phases_.const_view(), emitter_of_.const_view(), part.x_m.view(),
                                 part.v_m_s.view(), part.id.view(), part.push.view()});
}

void Liquid::expect(Index here, int steps) {
  const std::int64_t most =
      std::int64_t{here} + settings_.arrivals + std::int64_t{steps} * emitted_of(settings_);
  may_be_full_ = most > settings_.max_particles;
}

void Liquid::keep_youngest() {
  if (parts_[0].ages.empty() || !may_be_full_) return;
  each([&](ExecContext& ctx, LiquidPart& part) { ctx.fill_bytes(part.ages.view(), 0); });
  for (Index level = 0; level <= KeepYoungest::kLevels; ++level) {
    if (split_.is_split()) split_.barrier().meet();
    each([&](ExecContext& ctx, LiquidPart& part) {
      ctx.parallel_for(
          "fluid/cap", KeepYoungest::kBlocks,
          KeepYoungest{level, settings_.max_particles, part.shown_by.const_view(), part.count.const_view(),
                       part.id.const_view(), part.x_m.view(), part.ages.view(),
                       View<std::uint32_t>(&part.counters.view().data()->replaced, 1)});
    });
  }
}

void Liquid::begin_step(const StepTime& time, const FrameOnDevices* frame) {
  emit(of_part(time, frame, 0));
  keep_youngest();
  split_.migrate();
  split_.add_ghosts(kCopiedReach * constants_.kernel.reach_m());
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.build(ctx, part.x_m.const_view(), part.id.const_view(), part.given(), part.first_copy());
    ctx.parallel_for("fluid/count", 1,
                     KeepCount{part.search.cells().placed, part.ghost_count.const_view(), part.count.view(),
                               part.own.view()});
  });
  split_.link_ghosts();
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for("fluid/walls", part.search.placed(),
                     FindBoxWalls{part.search.cells().particles, settings_.box_m, settings_.open_faces,
                                  constants_.kernel.reach_m(), part.near_walls()});
  });
  if (settings_.solver == LiquidSolver::dfsph) sum_neighbours(time, frame);
}

void Liquid::sum_neighbours(const StepTime& time, const FrameOnDevices* frame) {
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for(
        "fluid/take", part.search.placed(),
        TakeMotion{of_part(time, frame, part.number), part.search.cells().order, part.v_m_s.const_view(),
                   part.push.const_view(), part.motion.view(), part.found.view()});
    if (is_timed(time)) part.timed_begin.take(ctx);
    part.search.visit_listing(ctx, "fluid/neighbours",
                              DfsphNeighbours{constants_, part.motion.const_view(), part.sums.view()},
                              part.near_lists());
    if (is_timed(time)) part.timed_end.take(ctx);
  });
}

LiquidStepped Liquid::stepped(LiquidPart& part) const {
  return {part.x_m.view(),
          part.v_m_s.view(),
          part.id.view(),
          LiquidEnds{settings_.box_m, settings_.open_faces, part.sinks.const_view(),
                     View<std::uint32_t>(&part.counters.view().data()->taken, 1)},
          part.wall_sums.view(),
          part.shear_m2_s.const_view(),
          part.smooth.const_view()};
}

/// Sets what forces need: of the surface, from `surface`, and of a liquid that thins, from the velocities in
/// `motion`.
void Liquid::prepare_forces() {
  if (settings_.surface_tension_N_m > 0) return measure_surface();
  if (!settings_.carreau) return;
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(ctx, "fluid/shear", shear_of(part), part.near_lists());
  });
  split_.update("fluid/copy shear", &LiquidPart::shear_m2_s);
}

LiquidShear Liquid::shear_of(LiquidPart& part) const {
  return {constants_, part.near_walls(), part.motion.const_view(), part.shear_m2_s.view()};
}

void Liquid::measure_surface() {
  split_.update("fluid/copy surface", &LiquidPart::surface);
  each([&](ExecContext& ctx, LiquidPart& part) {
    const SmoothNormals normals{constants_, part.near_walls(), part.surface.const_view(), part.smooth.view()};
    if (settings_.carreau)
      part.search.visit_listed(ctx, "fluid/normals, shear",
                               VisitBoth<SmoothNormals, LiquidShear>{normals, shear_of(part)},
                               part.near_lists());
    else
      part.search.visit_listed(ctx, "fluid/normals", normals, part.near_lists());
  });
  split_.update("fluid/copy normals", &LiquidPart::smooth);
  if (settings_.carreau) split_.update("fluid/copy shear", &LiquidPart::shear_m2_s);
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(ctx, "fluid/curvature",
                             FindCurvature{constants_, part.smooth.const_view(), part.curvature.view()},
                             part.near_lists());
  });
  split_.update("fluid/copy curvature", &LiquidPart::curvature);
}

/// Visits with a solver's forces, and the surface's.
template <class Force>
void Liquid::exert(ExecContext& ctx, LiquidPart& part, const Force& force) {
  if (settings_.surface_tension_N_m > 0)
    part.search.visit_listed(
        ctx, "fluid/force",
        PulledBySurface<Force>{force, part.smooth.const_view(), part.curvature.const_view()},
        part.near_lists());
  else
    part.search.visit_listed(ctx, "fluid/force", force, part.near_lists());
}

void Liquid::end_step(const StepTime& time, const FrameOnDevices* frame) {
  if (settings_.solver == LiquidSolver::dfsph)
    end_dfsph(time, frame);
  else
    end_weakly(time, frame);
}

/// True in the first substep of a block: a block is recorded as a whole.
bool Liquid::is_timed(const StepTime& time) const {
  return split_.is_split() && devices_.is_cuda() && time.in_block <= 0;
}

void Liquid::end_weakly(const StepTime& time, const FrameOnDevices* frame) {
  each([&](ExecContext& ctx, LiquidPart& part) {
    const auto density = [&](auto pair) {
      part.search.visit_listing(ctx, "fluid/density", pair, part.near_lists());
    };
    const View<const Index> order = part.search.cells().order;
    if (is_timed(time)) part.timed_begin.take(ctx);
    if (settings_.surface_tension_N_m > 0)
      density(LiquidDensity<true>{constants_, part.near_walls(), order, part.v_m_s.const_view(),
                                  part.density_kg_m3.view(), part.motion.view(), part.surface.view()});
    else
      density(LiquidDensity<false>{constants_, part.near_walls(), order, part.v_m_s.const_view(),
                                   part.density_kg_m3.view(), part.motion.view()});
    if (is_timed(time)) part.timed_end.take(ctx);
  });
  split_.update("fluid/copy motion", &LiquidPart::motion);
  prepare_forces();
  each([&](ExecContext& ctx, LiquidPart& part) {
    const StepTime here = of_part(time, frame, part.number);
    const View<const SearchParticle> particles = part.search.cells().particles;
    if (settings_.carreau)
      exert(ctx, part,
            LiquidForce<true>{constants_, here, part.near_walls(), particles, part.motion.const_view(),
                              stepped(part), part.shear_m2_s.const_view()});
    else
      exert(ctx, part,
            LiquidForce<false>{constants_, here, part.near_walls(), particles, part.motion.const_view(),
                               stepped(part)});
  });
}

void Liquid::end_dfsph(const StepTime& time, const FrameOnDevices* frame) {
  const auto time_of = [&](const LiquidPart& part) { return of_part(time, frame, part.number); };
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for("fluid/density", part.search.placed(),
                     DfsphDensity{constants_, time_of(part), part.near_walls(), part.search.cells().order,
                                  part.first_copy(), part.motion.const_view(), part.sums.const_view(),
                                  part.density_kg_m3.view(), part.alpha.view(), part.kappa_v.view(),
                                  part.relative_m_s.view(), part.surface.view()});
  });
  split_.update("fluid/copy kappa_v", &LiquidPart::kappa_v);
  prepare_forces();
  each([&](ExecContext& ctx, LiquidPart& part) {
    if (settings_.carreau)
      exert(ctx, part,
            DfsphForce<true>{constants_, time_of(part), part.near_walls(), part.motion.const_view(),
                             part.kappa_v.const_view(), part.v_star.view(), part.moved.view(),
                             part.shear_m2_s.const_view()});
    else
      exert(ctx, part,
            DfsphForce<false>{constants_, time_of(part), part.near_walls(), part.motion.const_view(),
                              part.kappa_v.const_view(), part.v_star.view(), part.moved.view()});
  });
  for (int k = 1; k <= settings_.iterations; ++k) {
    if (k > 1) {
      each([&](ExecContext& ctx, LiquidPart& part) {
        part.search.visit_listed(
            ctx, "fluid/velocity",
            DfsphVelocity<false>{constants_, time_of(part), part.near_walls(), part.kappa_v.const_view(),
                                 part.v_star.const_view(), part.moved.view()},
            part.near_lists());
      });
    }
    split_.update("fluid/copy moved", &LiquidPart::moved);
    each([&](ExecContext& ctx, LiquidPart& part) {
      part.search.visit_listed(
          ctx, "fluid/pressure",
          DfsphPressure{constants_, time_of(part), part.near_walls(), part.kappa_v.const_view(),
                        part.moved.const_view(), part.density_kg_m3.const_view(), part.alpha.const_view(),
                        part.found.view(), part.v_star.view(), k == settings_.iterations},
          part.near_lists());
    });
    split_.update("fluid/copy v_star", &LiquidPart::v_star);
  }
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(ctx, "fluid/step",
                             DfsphVelocity<true>{constants_,
                                                 time_of(part),
                                                 part.near_walls(),
                                                 part.kappa_v.const_view(),
                                                 part.v_star.const_view(),
                                                 {},
                                                 part.search.cells().particles,
                                                 part.motion.const_view(),
                                                 stepped(part),
                                                 part.push.view(),
                                                 part.density_kg_m3.const_view(),
                                                 part.alpha.const_view(),
                                                 DfsphPressure::share(settings_.iterations)},
                             part.near_lists());
  });
}

void Liquid::end_frame() {
  split_.barrier().meet();  // the first device has read the last frame's reports
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for("fluid/wall sums", part.wall_totals.size(),
                     SumWalls{part.wall_sums.view(), part.wall_totals.view()});
    ctx.parallel_for("fluid/report", ReportLiquid::kReports,
                     ReportLiquid{part.count.const_view(), part.x_m.const_view(), part.v_m_s.const_view(),
                                  part.density_kg_m3.const_view(), part.push.const_view(),
                                  part.relative_m_s.const_view(), part.counters.const_view(),
                                  part.number == 0 ? emitters_.const_view() : View<const EmitterState>{},
                                  settings_.max_speed_m_s, 1.F / settings_.density_kg_m3, settings_.spacing_m,
                                  part.reports.view()});
    if (!split_.is_split()) return;
    ctx.fill_bytes(part.layers.view(), 0);
    ctx.parallel_for("fluid/count layers", part.given(),
                     CountLayers{{settings_.box_m}, part.x_m.const_view(), part.layers.view()});
  });
  split_.barrier().meet();
  devices_.context(0).parallel_for("fluid/merge", wall_impulse_.size(),
                                   MergeParts{parts_[0].shown_by.const_view(), constants_.impulse_unit_N_s,
                                              wall_impulse_.view(), report_.view()});
}

void Liquid::balance(std::span<const std::vector<Index>> layers) {
  if (!split_.is_split()) return;
  std::vector<Index> all(LiquidLayers::kCounts), particles;
  std::vector<double> seconds;
  for (int p = 0; p < part_count(); ++p) {
    const std::vector<Index>& own = layers[at(p)];
    for (std::size_t k = 0; k < all.size(); ++k) all[k] += own[k];
    particles.push_back(std::accumulate(own.begin(), own.begin() + LiquidLayers::kLayers, Index{0}));
    if (devices_.is_cuda())
      seconds.push_back(parts_[at(p)].timed_end.seconds_since(parts_[at(p)].timed_begin));
  }
  if (balance_.move(all, particles, seconds)) split_.send_slabs(balance_.slabs());
}

float Liquid::largest_step_s(float fastest_m_s) const {
  const float d = settings_.spacing_m, most_m_s = settings_.max_speed_m_s;
  const float signal_m_s = settings_.solver == LiquidSolver::dfsph
                               ? std::clamp(fastest_m_s, most_m_s / kMostLonger, most_m_s)
                               : constants_.sound_m_s * (1 + 0.6F * settings_.artificial_viscosity);
  float step = 0.4F * d / signal_m_s;
  if (constants_.shear_m2_s > 0) step = std::min(step, d * d / (8 * constants_.shear_m2_s));
  if (settings_.surface_tension_N_m > 0)
    step = std::min(
        step, std::sqrt(settings_.density_kg_m3 * d * d * d / (8 * kPi * settings_.surface_tension_N_m)));
  return step;
}

LiquidView Liquid::view(int part) const {
  const LiquidPart& p = parts_[at(part)];
  return {Count(p.count.const_view(), settings_.max_particles), p.x_m.const_view(), p.v_m_s.const_view(),
          p.id.const_view()};
}

}  // namespace tactus
