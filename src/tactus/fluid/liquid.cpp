#include "tactus/fluid/liquid.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace tactus {
namespace {

[[noreturn]] void refuse(const char* what, float value, const char* expected) {
  throw Error(std::string("liquid: ") + what + " is " + std::to_string(value) + ", must be " + expected);
}

CarreauLaw thinning_of(const LiquidSettings& s) {
  const Carreau c = s.carreau.value_or(Carreau{.zero_shear_Pa_s = s.viscosity_Pa_s});
  return {.zero_m2_s = c.zero_shear_Pa_s / s.density_kg_m3,
          .infinite_m2_s = s.viscosity_Pa_s / s.density_kg_m3,
          .relaxation_s = c.relaxation_s,
          .index = c.index};
}

LiquidConstants constants_of(const LiquidSettings& s) {
  // The surface's shortest waves are fast, however slow the liquid is.
  const float d = s.spacing_m,
              speed_m_s = std::max(s.max_speed_m_s, std::sqrt(s.surface_tension_N_m / (s.density_kg_m3 * d))),
              sound = 10 * speed_m_s;
  // What is incompressible has no sound to damp, but jiggles.
  const float damped_m_s = s.solver == LiquidSolver::dfsph ? 4 * speed_m_s : sound;
  return {.kernel = {1.F / d},
          .spacing_m = d,
          .mass_kg = s.density_kg_m3 * d * d * d,
          .density_kg_m3 = s.density_kg_m3,
          .tait_Pa = s.density_kg_m3 * sound * sound / 7,
          .sound_m_s = sound,
          .shear_m2_s = (s.carreau ? s.carreau->zero_shear_Pa_s : s.viscosity_Pa_s) / s.density_kg_m3,
          .damping_m2_s = s.artificial_viscosity * damped_m_s * d,
          .closest_m = 0.25F * d,
          .tension_N_m = s.surface_tension_N_m,
          .contact_cos = std::cos(s.contact_angle_deg * kPi / 180),
          .contact_sin = std::sin(s.contact_angle_deg * kPi / 180),
          .thinning = thinning_of(s)};
}

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

}  // namespace

LiquidSettings checked(const LiquidSettings& s) {
  if (!(s.spacing_m > 0 && s.spacing_m < 1e3F)) refuse("spacing_m", s.spacing_m, "> 0");
  if (!(s.density_kg_m3 > 0)) refuse("density_kg_m3", s.density_kg_m3, "> 0");
  if (!(s.viscosity_Pa_s >= 0)) refuse("viscosity_Pa_s", s.viscosity_Pa_s, ">= 0");
  if (s.carreau) {
    const Carreau& c = *s.carreau;
    if (!(c.zero_shear_Pa_s >= s.viscosity_Pa_s))
      refuse("zero_shear_Pa_s", c.zero_shear_Pa_s,
             "at least viscosity_Pa_s, which is left at high shear rates");
    if (!(c.relaxation_s >= 0)) refuse("relaxation_s", c.relaxation_s, ">= 0");
    if (!(c.index > 0 && c.index <= 1)) refuse("index", c.index, "> 0 and <= 1");
  }
  if (!(s.surface_tension_N_m >= 0)) refuse("surface_tension_N_m", s.surface_tension_N_m, ">= 0");
  if (!(s.contact_angle_deg >= 0 && s.contact_angle_deg <= 180))
    refuse("contact_angle_deg", s.contact_angle_deg, "from 0 to 180");
  if (!(s.max_speed_m_s > 0)) refuse("max_speed_m_s", s.max_speed_m_s, "> 0");
  if (!(s.artificial_viscosity >= 0)) refuse("artificial_viscosity", s.artificial_viscosity, ">= 0");
  if (s.iterations < 1) refuse("iterations", static_cast<float>(s.iterations), "> 0");
  if (s.max_particles <= 0) refuse("max_particles", static_cast<float>(s.max_particles), "> 0");
  const Vec3f edge = s.box_m.extent();
  const float least = std::min({edge.x, edge.y, edge.z});
  if (!(least >= s.spacing_m)) refuse("the shortest edge of box_m", least, "at least the spacing");
  for (const LiquidEmitter& e : s.emitters) {
    if (!(e.speed_m_s > 0)) refuse("speed_m_s of an emitter", e.speed_m_s, "> 0");
    if (!(e.radius_m > 0)) refuse("radius_m of an emitter", e.radius_m, "> 0");
    if (!(length(e.direction) > 0)) refuse("the length of an emitter's direction", 0, "> 0");
  }
  return s;
}

Liquid::Liquid(ExecContext& ctx, const LiquidSettings& settings)
    : settings_(checked(settings)),
      constants_(constants_of(settings_)),
      search_(ctx.device(),
              {.max_particles = settings_.max_particles, .reach_m = constants_.kernel.reach_m()}),
      count_(ctx.device(), 1),
      id_(ctx.device(), settings_.max_particles),
      wall_count_(ctx.device(), settings_.max_particles),
      list_count_(ctx.device(), settings_.max_particles),
      near_(ctx.device(), NearLists::size(settings_.max_particles)),
      x_m_(ctx.device(), settings_.max_particles),
      v_m_s_(ctx.device(), settings_.max_particles),
      density_kg_m3_(ctx.device(), settings_.max_particles),
      push_(ctx.device(), settings_.max_particles),
      inverse_D_(ctx.device(), settings_.max_particles),
      found_(ctx.device(), settings_.max_particles),
      kd_(ctx.device(), settings_.max_particles),
      shear_m2_s_(ctx.device(), settings_.carreau ? settings_.max_particles : 0),
      motion_(ctx.device(), settings_.max_particles),
      star_(ctx.device(), settings_.max_particles),
      moved_(ctx.device(), settings_.max_particles),
      surface_(ctx.device(), settings_.surface_tension_N_m > 0 ? settings_.max_particles : 0),
      smooth_(ctx.device(), surface_.size()),
      curvature_(ctx.device(), surface_.size()),
      walls_(ctx.device(), std::int64_t{kNearWalls} * settings_.max_particles),
      wall_sums_(ctx.device(), std::int64_t{kFaces + settings_.other_walls} * WallSums::kCopies),
      wall_impulse_(ctx.device(), kFaces + settings_.other_walls),
      counters_(ctx.device(), 1),
      report_(ctx.device(), 1),
      sinks_(to_device(ctx, settings_.sinks_m)) {
  make_emitters(ctx);
  ctx.fill_bytes(wall_sums_.view(), 0);
  place(ctx, {});
}

void Liquid::make_emitters(ExecContext& ctx) {
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

void Liquid::place(ExecContext& ctx, std::span<const LiquidParticle> particles) {
  if (particles.size() > static_cast<std::size_t>(settings_.max_particles)) {
    throw Error("liquid: " + std::to_string(particles.size()) + " particles, but max_particles is " +
                std::to_string(settings_.max_particles));
  }
  const auto room = static_cast<std::size_t>(settings_.max_particles);
  std::vector<Vec3f> x(room), v(room);
  std::vector<Index> id(room);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    x[i] = particles[i].x_m;
    v[i] = particles[i].v_m_s;
    id[i] = static_cast<Index>(i);
  }
  const auto n = static_cast<Index>(particles.size());
  const std::vector<Index> count{n};
  const std::vector<LiquidCounters> counters{{.next_id = n, .placed = static_cast<std::uint32_t>(n)}};
  ctx.upload(x, x_m_.view());
  ctx.upload(v, v_m_s_.view());
  ctx.upload(id, id_.view());
  ctx.upload(count, count_.view());
  ctx.upload(counters, counters_.view());
  ctx.fill_bytes(density_kg_m3_.view(), 0);
  ctx.fill_bytes(push_.view(), 0);
  ctx.synchronize();
  end_frame(ctx);
  ctx.synchronize();
}

void Liquid::step(ExecContext& ctx, const StepTime& time) {
  if (time.frame.empty() && !(time.dt_s <= largest_step_s())) {
    throw Error("liquid: a step of " + std::to_string(time.dt_s) + " s, but the largest stable step is " +
                std::to_string(largest_step_s()) + " s");
  }
  begin_step(ctx, time);
  end_step(ctx, time);
}

void Liquid::begin_step(ExecContext& ctx, const StepTime& time) {
  if (!emitters_.empty()) {
    ctx.parallel_for("fluid/layers", 1,
                     PlanLayers{time, counters_.view(), count_.view(), emitters_.view(), id_.size()});
    ctx.parallel_for("fluid/emit", layer_points_.size(),
                     EmitLayers{emitters_.const_view(), layer_points_.const_view(), emitter_of_.const_view(),
                                x_m_.view(), v_m_s_.view(), id_.view(), push_.view()});
  }
  search_.build(ctx, x_m_.const_view(), id_.const_view(), Count(count_.const_view(), id_.size()));
  ctx.parallel_for("fluid/walls", search_.placed(),
                   FindBoxWalls{search_.cells().particles, settings_.box_m, settings_.open_faces,
                                constants_.kernel.reach_m(), near_walls()});
}

void Liquid::end_step(ExecContext& ctx, const StepTime& time) {
  const LiquidEnds ends{settings_.box_m, settings_.open_faces, sinks_.const_view(),
                        View<std::uint32_t>(&counters_.view().data()->taken, 1)};
  const LiquidStepped stepped{x_m_.view(), v_m_s_.view(),     id_.view(),
                              ends,        wall_sums_.view(), shear_m2_s_.const_view()};
  if (settings_.solver == LiquidSolver::dfsph)
    end_dfsph(ctx, time, stepped);
  else
    end_weakly(ctx, time, stepped);
  ctx.parallel_for("fluid/count", 1, KeepCount{search_.cells().placed, count_.view()});
}

void Liquid::end_weakly(ExecContext& ctx, const StepTime& time, const LiquidStepped& stepped) {
  const NeighbourCells cells = search_.cells();
  const NearLists lists{list_count_.view(), near_.view()};
  search_.visit_listing(ctx, "fluid/density",
                        LiquidDensity{constants_, near_walls(), cells.order, v_m_s_.const_view(),
                                      density_kg_m3_.view(), motion_.view()},
                        lists);
  pull_surface(ctx, time);
  const auto force = [&](auto pair) { search_.visit_listed(ctx, "fluid/force", pair, lists); };
  if (settings_.carreau) {
    measure_shear(ctx);
    force(LiquidForce<true>{constants_, time, near_walls(), cells.particles, motion_.const_view(), stepped,
                            shear_m2_s_.const_view()});
  } else {
    force(LiquidForce<false>{constants_, time, near_walls(), cells.particles, motion_.const_view(), stepped});
  }
}

/// Adds to the velocities in motion_.
void Liquid::pull_surface(ExecContext& ctx, const StepTime& time) {
  if (surface_.empty()) return;
  const NearLists lists{list_count_.view(), near_.view()};
  search_.visit_listed(ctx, "fluid/surface", FindSurface{constants_, near_walls(), surface_.view()}, lists);
  search_.visit_listed(ctx, "fluid/normals",
                       SmoothNormals{constants_, near_walls(), surface_.const_view(), smooth_.view()}, lists);
  search_.visit_listed(ctx, "fluid/curvature",
                       FindCurvature{constants_, smooth_.const_view(), curvature_.view()}, lists);
  search_.visit_listed(
      ctx, "fluid/tension",
      PullSurface{constants_, time, smooth_.const_view(), curvature_.const_view(), motion_.view()}, lists);
}

/// Of the velocities in motion_.
void Liquid::measure_shear(ExecContext& ctx) {
  search_.visit_listed(ctx, "fluid/shear",
                       LiquidShear{constants_, near_walls(), motion_.const_view(), shear_m2_s_.view()},
                       NearLists{list_count_.view(), near_.view()});
}

void Liquid::end_dfsph(ExecContext& ctx, const StepTime& time, const LiquidStepped& stepped) {
  const NeighbourCells cells = search_.cells();
  const NearLists lists{list_count_.view(), near_.view()};
  const NearWalls walls = near_walls();
  const View<const LiquidMotion> motion = motion_.const_view(), star = star_.const_view();
  const View<const float> kd = kd_.const_view();
  ctx.parallel_for(
      "fluid/take", search_.placed(),
      TakeMotion{cells.order, v_m_s_.const_view(), push_.const_view(), motion_.view(), found_.view()});
  search_.visit_listing(
      ctx, "fluid/density",
      DfsphDensity{constants_, time, walls, motion, density_kg_m3_.view(), inverse_D_.view(), kd_.view()},
      lists);
  pull_surface(ctx, time);
  const auto force = [&](auto pair) { search_.visit_listed(ctx, "fluid/force", pair, lists); };
  if (settings_.carreau) {
    measure_shear(ctx);
    force(DfsphForce<true>{constants_, time, walls, motion, kd, star_.view(), moved_.view(),
                           shear_m2_s_.const_view()});
  } else {
    force(DfsphForce<false>{constants_, time, walls, motion, kd, star_.view(), moved_.view()});
  }
  for (int k = 1; k <= settings_.iterations; ++k) {
    if (k > 1)
      search_.visit_listed(ctx, "fluid/velocity",
                           DfsphVelocity<false>{constants_, time, walls, kd, star, moved_.view()}, lists);
    search_.visit_listed(
        ctx, "fluid/pressure",
        DfsphPressure{constants_, time, walls, kd, moved_.const_view(), density_kg_m3_.const_view(),
                      inverse_D_.const_view(), found_.view(), star_.view(), k == settings_.iterations},
        lists);
  }
  search_.visit_listed(
      ctx, "fluid/step",
      DfsphVelocity<true>{
          constants_, time, walls, kd, star, {}, cells.particles, motion, stepped, push_.view()},
      lists);
}

void Liquid::end_frame(ExecContext& ctx) {
  ctx.parallel_for("fluid/wall sums", wall_impulse_.size(),
                   SumWalls{wall_sums_.view(), wall_impulse_.view()});
  ctx.parallel_for("fluid/report", 1,
                   ReportLiquid{count_.const_view(), x_m_.const_view(), v_m_s_.const_view(),
                                density_kg_m3_.const_view(), counters_.const_view(), emitters_.const_view(),
                                settings_.max_speed_m_s, 1.F / settings_.density_kg_m3, report_.view()});
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

LiquidView Liquid::view() const {
  return {Count(count_.const_view(), id_.size()), x_m_.const_view(), v_m_s_.const_view(), id_.const_view()};
}

void Liquid::archive(ExecContext& ctx, StateArchive& a) {
  a.set_owner("liquid");
  a.buffer(ctx, "count", count_);
  a.buffer(ctx, "ids", id_);
  a.buffer(ctx, "positions", x_m_);
  a.buffer(ctx, "velocities", v_m_s_);
  a.buffer(ctx, "pressures", push_);
  a.buffer(ctx, "counters", counters_);
  a.buffer(ctx, "emitters", emitters_);
  const Index count = to_host(ctx, count_.view())[0];
  a.check(count >= 0 && count <= id_.size(), "count");
}

std::vector<LiquidParticle> Liquid::particles(ExecContext& ctx) const {
  const Index count = to_host(ctx, count_.view())[0];
  const std::vector<Vec3f> x = to_host(ctx, x_m_.view().part(0, count)),
                           v = to_host(ctx, v_m_s_.view().part(0, count));
  const std::vector<Index> id = to_host(ctx, id_.view().part(0, count));
  std::vector<LiquidParticle> all;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::isfinite(x[i].x)) all.push_back({x[i], v[i], id[i]});
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return all;
}

std::vector<float> Liquid::densities_kg_m3(ExecContext& ctx) const {
  return to_host(ctx, density_kg_m3_.view().part(0, to_host(ctx, count_.view())[0]));
}

std::vector<LiquidParticle> fill_box(const Box3f& box_m, float spacing_m) {
  const Vec3f edge = box_m.extent();
  constexpr float kRounding = 1e-3F;  // of an edge of whole spacings
  const auto along = [&](float m) { return std::max(1, static_cast<int>(m / spacing_m + kRounding)); };
  const Vec3i n{along(edge.x), along(edge.y), along(edge.z)};
  std::vector<LiquidParticle> particles;
  for (Index z = 0; z < n.z; ++z) {
    for (Index y = 0; y < n.y; ++y) {
      for (Index x = 0; x < n.x; ++x) {
        const Vec3f at{(static_cast<float>(x) + 0.5F) / static_cast<float>(n.x) * edge.x,
                       (static_cast<float>(y) + 0.5F) / static_cast<float>(n.y) * edge.y,
                       (static_cast<float>(z) + 0.5F) / static_cast<float>(n.z) * edge.z};
        particles.push_back({box_m.min + at, {}, static_cast<Index>(particles.size())});
      }
    }
  }
  return particles;
}

}  // namespace tactus
