#include "tactus/fluid/liquid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

namespace tactus {
namespace {

/// Points d apart on the disc of an emitter.
std::vector<Vec3f> layer_of(const LiquidEmitter& e, float d) {
  const Vec3f along = normalized(e.direction),
              aside = std::abs(along.x) < 0.7F ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0},
              u = normalized(cross(along, aside)), w = cross(along, u);
  std::vector<Vec3f> points;
  const int most = static_cast<int>(e.radius_m / d) + 1;
  for (int b = -most; b <= most; ++b) {
    for (int a = -most; a <= most; ++a) {
      const Vec3f out = (static_cast<float>(a) * d) * u + (static_cast<float>(b) * d) * w;
      if (length(out) <= std::max(e.radius_m - 0.25F * d, 0.F)) points.push_back(e.position_m + out);
    }
  }
  return points;
}

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
          parts.emplace_back(devices.device(p), settings_.max_particles, constants_.kernel.reach_m(),
                             kFaces + settings_.other_walls, p, count);
        return parts;
      }()),
      split_(devices, parts_),
      balance_(settings_.box_m, part_count()),
      wall_impulse_(devices.device(0), kFaces + settings_.other_walls),
      report_(devices.device(0), 1),
      elsewhere_(devices.device(0), part_count() > 1 ? 1 : 0) {
  make_emitters();
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.sinks = to_device(ctx, settings_.sinks_m);
    if (settings_.carreau) part.shear_m2_s = Buffer<float>(ctx.device(), settings_.max_particles);
    if (settings_.surface_tension_N_m > 0) {
      part.surface = Buffer<LiquidNormal>(ctx.device(), settings_.max_particles);
      part.smooth = Buffer<LiquidNormal>(ctx.device(), settings_.max_particles);
      part.curvature = Buffer<float>(ctx.device(), settings_.max_particles);
    }
    ctx.fill_bytes(part.wall_sums.view(), 0);
  });
  place({});
}

void Liquid::make_emitters() {
  ExecContext& ctx = devices_.context(0);
  std::vector<EmitterState> states;
  std::vector<Vec3f> points;
  std::vector<Index> of;
  for (const LiquidEmitter& e : settings_.emitters) {
    const std::vector<Vec3f> layer = layer_of(e, settings_.spacing_m);
    states.push_back({.velocity_m_s = e.speed_m_s * normalized(e.direction),
                      .layer_s = settings_.spacing_m / e.speed_m_s,
                      .from_s = e.from_s,
                      .until_s = e.until_s,
                      .first = static_cast<Index>(points.size()),
                      .points = static_cast<Index>(layer.size()),
                      .next_s = e.from_s});
    points.insert(points.end(), layer.begin(), layer.end());
    of.resize(points.size(), static_cast<Index>(states.size()) - 1);
  }
  emitters_ = to_device(ctx, states);
  layer_points_ = to_device(ctx, points);
  emitter_of_ = to_device(ctx, of);
}

void Liquid::place(std::span<const LiquidParticle> particles) {
  if (particles.size() > static_cast<std::size_t>(settings_.max_particles)) {
    throw Error("liquid: " + std::to_string(particles.size()) + " particles, but max_particles is " +
                std::to_string(settings_.max_particles));
  }
  std::vector<Kept> kept;
  for (const LiquidParticle& p : particles)
    kept.push_back({.particle = {p.x_m, p.v_m_s, static_cast<Index>(kept.size())}});
  const auto n = static_cast<Index>(particles.size());
  put(kept, n, {.next_id = n, .placed = static_cast<std::uint32_t>(n)});
}

void Liquid::put(const std::vector<Kept>& particles, Index count, const LiquidCounters& counters) {
  constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
  const auto room = static_cast<std::size_t>(parts_[0].id.size());
  std::vector<Vec3f> x(room, {kNowhere, kNowhere, kNowhere}), v(room);
  std::vector<float> push(room);
  std::vector<Index> id(room), layers(LiquidLayers::kCounts);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    x[i] = particles[i].particle.x_m;
    v[i] = particles[i].particle.v_m_s;
    id[i] = particles[i].particle.id;
    push[i] = particles[i].push;
    for (Index axis = 0; axis < 3; ++axis) ++layers[at(LiquidLayers{settings_.box_m}.at(x[i], axis))];
  }
  const std::vector<Index> none{0}, all{count};
  const std::vector<LiquidCounters> no_counters(1), all_counters{counters};
  each([&](ExecContext& ctx, LiquidPart& part) {
    const bool is_first = part.number == 0;
    ctx.upload(is_first ? all : none, part.count.view());
    ctx.upload(is_first ? all : none, part.own.view());
    ctx.upload(none, part.ghost_count.view());
    ctx.upload(is_first ? all_counters : no_counters, part.counters.view());
    ctx.fill_bytes(part.density_kg_m3.view(), 0);
    if (!is_first) return;
    ctx.upload(x, part.x_m.view());
    ctx.upload(v, part.v_m_s.view());
    ctx.upload(id, part.id.view());
    ctx.upload(push, part.push.view());
  });
  balance_.begin(layers);
  split_.send_slabs(balance_.slabs());
  devices_.synchronize();
  end_frame();
  devices_.synchronize();
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
  if (split_.is_split())
    ctx.parallel_for("fluid/elsewhere", 1,
                     CountElsewhere{part.shown_by.const_view(), part.count.const_view(), elsewhere_.view()});
  ctx.parallel_for("fluid/layers", 1,
                   PlanLayers{time, part.counters.view(), part.count.view(), emitters_.view(),
                              settings_.max_particles, elsewhere_.const_view()});
  ctx.parallel_for("fluid/emit", layer_points_.size(),
                   EmitLayers{emitters_.const_view(), layer_points_.const_view(), emitter_of_.const_view(),
                              part.x_m.view(), part.v_m_s.view(), part.id.view(), part.push.view()});
}

void Liquid::begin_step(const StepTime& time, const FrameOnDevices* frame) {
  emit(of_part(time, frame, 0));
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
}

LiquidStepped Liquid::stepped(LiquidPart& part) const {
  return {part.x_m.view(),
          part.v_m_s.view(),
          part.id.view(),
          LiquidEnds{settings_.box_m, settings_.open_faces, part.sinks.const_view(),
                     View<std::uint32_t>(&part.counters.view().data()->taken, 1)},
          part.wall_sums.view(),
          part.shear_m2_s.const_view()};
}

/// Of the velocities in `motion`.
void Liquid::measure_shear() {
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(
        ctx, "fluid/shear",
        LiquidShear{constants_, part.near_walls(), part.motion.const_view(), part.shear_m2_s.view()},
        part.near_lists());
  });
  split_.update("fluid/copy shear", &LiquidPart::shear_m2_s);
}

/// Adds to the velocities in `motion` of a part's own particles.
void Liquid::pull_surface(const StepTime& time, const FrameOnDevices* frame) {
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(ctx, "fluid/surface",
                             FindSurface{constants_, part.near_walls(), part.surface.view()},
                             part.near_lists());
  });
  split_.update("fluid/copy surface", &LiquidPart::surface);
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(
        ctx, "fluid/normals",
        SmoothNormals{constants_, part.near_walls(), part.surface.const_view(), part.smooth.view()},
        part.near_lists());
  });
  split_.update("fluid/copy normals", &LiquidPart::smooth);
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(ctx, "fluid/curvature",
                             FindCurvature{constants_, part.smooth.const_view(), part.curvature.view()},
                             part.near_lists());
  });
  split_.update("fluid/copy curvature", &LiquidPart::curvature);
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(
        ctx, "fluid/tension",
        PullSurface{constants_, of_part(time, frame, part.number), part.smooth.const_view(),
                    part.curvature.const_view(), part.motion.view()},
        part.near_lists());
  });
}

void Liquid::end_step(const StepTime& time, const FrameOnDevices* frame) {
  if (settings_.solver == LiquidSolver::dfsph)
    end_dfsph(time, frame);
  else
    end_weakly(time, frame);
}

/// Once in what is recorded together.
bool Liquid::is_timed(const StepTime& time) const {
  return split_.is_split() && devices_.is_cuda() && time.in_block == 0;
}

void Liquid::end_weakly(const StepTime& time, const FrameOnDevices* frame) {
  each([&](ExecContext& ctx, LiquidPart& part) {
    if (is_timed(time)) part.timed_begin.take(ctx);
    part.search.visit_listing(
        ctx, "fluid/density",
        LiquidDensity{constants_, part.near_walls(), part.search.cells().order, part.v_m_s.const_view(),
                      part.density_kg_m3.view(), part.motion.view()},
        part.near_lists());
    if (is_timed(time)) part.timed_end.take(ctx);
  });
  if (settings_.surface_tension_N_m > 0) pull_surface(time, frame);
  split_.update("fluid/copy motion", &LiquidPart::motion);
  if (settings_.carreau) measure_shear();
  each([&](ExecContext& ctx, LiquidPart& part) {
    const auto force = [&](auto pair) {
      part.search.visit_listed(ctx, "fluid/force", pair, part.near_lists());
    };
    const StepTime here = of_part(time, frame, part.number);
    const View<const SearchParticle> particles = part.search.cells().particles;
    if (settings_.carreau)
      force(LiquidForce<true>{constants_, here, part.near_walls(), particles, part.motion.const_view(),
                              stepped(part), part.shear_m2_s.const_view()});
    else
      force(LiquidForce<false>{constants_, here, part.near_walls(), particles, part.motion.const_view(),
                               stepped(part)});
  });
}

void Liquid::end_dfsph(const StepTime& time, const FrameOnDevices* frame) {
  const auto time_of = [&](const LiquidPart& part) { return of_part(time, frame, part.number); };
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for("fluid/take", part.search.placed(),
                     TakeMotion{part.search.cells().order, part.v_m_s.const_view(), part.push.const_view(),
                                part.motion.view(), part.found.view()});
    if (is_timed(time)) part.timed_begin.take(ctx);
    part.search.visit_listing(
        ctx, "fluid/density",
        DfsphDensity{constants_, time_of(part), part.near_walls(), part.motion.const_view(),
                     part.density_kg_m3.view(), part.inverse_D.view(), part.kd.view()},
        part.near_lists());
    if (is_timed(time)) part.timed_end.take(ctx);
  });
  split_.update("fluid/copy kd", &LiquidPart::kd);
  if (settings_.surface_tension_N_m > 0) {
    pull_surface(time, frame);
    split_.update("fluid/copy motion", &LiquidPart::motion);
  }
  if (settings_.carreau) measure_shear();
  each([&](ExecContext& ctx, LiquidPart& part) {
    const auto force = [&](auto pair) {
      part.search.visit_listed(ctx, "fluid/force", pair, part.near_lists());
    };
    if (settings_.carreau)
      force(DfsphForce<true>{constants_, time_of(part), part.near_walls(), part.motion.const_view(),
                             part.kd.const_view(), part.star.view(), part.moved.view(),
                             part.shear_m2_s.const_view()});
    else
      force(DfsphForce<false>{constants_, time_of(part), part.near_walls(), part.motion.const_view(),
                              part.kd.const_view(), part.star.view(), part.moved.view()});
  });
  for (int k = 1; k <= settings_.iterations; ++k) {
    if (k > 1) {
      each([&](ExecContext& ctx, LiquidPart& part) {
        part.search.visit_listed(
            ctx, "fluid/velocity",
            DfsphVelocity<false>{constants_, time_of(part), part.near_walls(), part.kd.const_view(),
                                 part.star.const_view(), part.moved.view()},
            part.near_lists());
      });
    }
    split_.update("fluid/copy moved", &LiquidPart::moved);
    each([&](ExecContext& ctx, LiquidPart& part) {
      part.search.visit_listed(
          ctx, "fluid/pressure",
          DfsphPressure{constants_, time_of(part), part.near_walls(), part.kd.const_view(),
                        part.moved.const_view(), part.density_kg_m3.const_view(), part.inverse_D.const_view(),
                        part.found.view(), part.star.view(), k == settings_.iterations},
          part.near_lists());
    });
    split_.update("fluid/copy star", &LiquidPart::star);
  }
  each([&](ExecContext& ctx, LiquidPart& part) {
    part.search.visit_listed(ctx, "fluid/step",
                             DfsphVelocity<true>{constants_,
                                                 time_of(part),
                                                 part.near_walls(),
                                                 part.kd.const_view(),
                                                 part.star.const_view(),
                                                 {},
                                                 part.search.cells().particles,
                                                 part.motion.const_view(),
                                                 stepped(part),
                                                 part.push.view()},
                             part.near_lists());
  });
}

void Liquid::end_frame() {
  split_.barrier().meet();  // the first device read what the last frame left
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for("fluid/wall sums", part.wall_totals.size(),
                     SumWalls{part.wall_sums.view(), part.wall_totals.view()});
    ctx.parallel_for(
        "fluid/report", ReportLiquid::kReports,
        ReportLiquid{part.count.const_view(), part.x_m.const_view(), part.v_m_s.const_view(),
                     part.density_kg_m3.const_view(), part.counters.const_view(),
                     part.number == 0 ? emitters_.const_view() : View<const EmitterState>{},
                     settings_.max_speed_m_s, 1.F / settings_.density_kg_m3, part.reports.view()});
    if (!split_.is_split()) return;
    ctx.fill_bytes(part.layers.view(), 0);
    ctx.parallel_for("fluid/count layers", part.given(),
                     CountLayers{{settings_.box_m}, part.x_m.const_view(), part.layers.view()});
  });
  split_.barrier().meet();
  devices_.context(0).parallel_for(
      "fluid/merge", wall_impulse_.size(),
      MergeParts{parts_[0].shown_by.const_view(), wall_impulse_.view(), report_.view()});
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

float Liquid::largest_step_s() const {
  const float d = settings_.spacing_m;
  const float signal_m_s = settings_.solver == LiquidSolver::dfsph
                               ? settings_.max_speed_m_s
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

void Liquid::archive(StateArchive& a) {
  ExecContext& ctx = devices_.context(0);
  std::vector<Kept> particles = kept();
  LiquidCounters counters;
  Index count = 0;
  each([&](ExecContext& there, LiquidPart& part) {
    const LiquidCounters c = to_host(there, part.counters.view())[0];
    counters.next_id = std::max(counters.next_id, c.next_id);
    counters.placed += c.placed;
    counters.emitted += c.emitted;
    counters.taken += c.taken;
    count += to_host(there, part.own.view())[0];
  });
  a.set_owner("liquid");
  auto here = static_cast<Index>(particles.size());
  a.value("count", count);
  a.value("here", here);
  a.check(here >= 0 && here <= count && count <= settings_.max_particles, "count");
  particles.resize(static_cast<std::size_t>(settings_.max_particles));
  a.values("particles", particles);
  a.value("counters", counters);
  std::vector<EmitterState> emitters = to_host(ctx, emitters_.const_view());
  for (EmitterState& e : emitters) e.slot = -1;  // where the layer of the last step went
  a.values("emitters", emitters);
  if (!a.reads()) return;
  ctx.upload(emitters, emitters_.view());
  particles.resize(static_cast<std::size_t>(here));
  put(particles, count, counters);
  if (part_count() == 1) sort_again(particles);
}

void Liquid::sort_again(const std::vector<Kept>& particles) {
  ExecContext& ctx = devices_.context(0);
  LiquidPart& part = parts_[0];
  const std::vector<Vec3f> x_m = to_host(ctx, part.x_m.view()), v_m_s = to_host(ctx, part.v_m_s.view());
  const std::vector<float> push = to_host(ctx, part.push.view());
  const std::vector<Index> id = to_host(ctx, part.id.view());
  std::vector<Vec3f> sorted_m = x_m;
  for (std::size_t i = 0; i < particles.size(); ++i) sorted_m[i] = particles[i].sorted_m;
  ctx.upload(sorted_m, part.x_m.view());
  part.search.build(ctx, part.x_m.const_view(), part.id.const_view(), part.given(), part.first_copy());
  const auto here = static_cast<Index>(particles.size());
  std::vector<Index> order = to_host(ctx, part.search.cells().order);
  // Before the first step, nothing was sorted.
  if (to_host(ctx, part.search.cells().placed)[0] != here) std::iota(order.begin(), order.end(), 0);
  const auto put_in_order = [&](const auto& list, auto& buffer) {
    auto out = list;
    for (Index slot = 0; slot < here; ++slot) out[at(slot)] = list[at(order[at(slot)])];
    ctx.upload(out, buffer.view());
    ctx.synchronize();
  };
  put_in_order(x_m, part.x_m);
  put_in_order(v_m_s, part.v_m_s);
  put_in_order(push, part.push);
  put_in_order(id, part.id);
}

std::vector<Liquid::Kept> Liquid::kept() const {
  std::vector<Kept> all;
  for (int p = 0; p < part_count(); ++p) {
    ExecContext& ctx = devices_.context(p);
    const LiquidPart& part = parts_[at(p)];
    const Index count = to_host(ctx, part.count.view())[0];
    const std::vector<Vec3f> x = to_host(ctx, part.x_m.view().part(0, count)),
                             v = to_host(ctx, part.v_m_s.view().part(0, count));
    const std::vector<float> push = to_host(ctx, part.push.view().part(0, count)),
                             density = to_host(ctx, part.density_kg_m3.view().part(0, count));
    const std::vector<Index> id = to_host(ctx, part.id.view().part(0, count));
    const std::vector<SearchParticle> sorted = to_host(ctx, part.search.cells().particles.part(0, count));
    for (std::size_t i = 0; i < x.size(); ++i)
      if (std::isfinite(x[i].x)) all.push_back({{x[i], v[i], id[i]}, push[i], density[i], sorted[i].x_m});
  }
  std::sort(all.begin(), all.end(),
            [](const Kept& a, const Kept& b) { return a.particle.id < b.particle.id; });
  return all;
}

std::vector<LiquidParticle> Liquid::particles() const {
  std::vector<LiquidParticle> all;
  for (const Kept& k : kept()) all.push_back(k.particle);
  return all;
}

std::vector<float> Liquid::densities_kg_m3() const {
  std::vector<float> all;
  for (const Kept& k : kept()) all.push_back(k.density_kg_m3);
  return all;
}

}  // namespace tactus
