#include "tactus/fluid/liquid.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace tactus {
namespace {

[[noreturn]] void refuse(const char* what, float value, const char* expected) {
  throw Error(std::string("liquid: ") + what + " is " + std::to_string(value) + ", must be " + expected);
}

LiquidConstants constants_of(const LiquidSettings& s) {
  const float sound = 10 * s.max_speed_m_s, d = s.spacing_m;
  return {.kernel = {1.F / d},
          .spacing_m = d,
          .mass_kg = s.density_kg_m3 * d * d * d,
          .density_kg_m3 = s.density_kg_m3,
          .tait_Pa = s.density_kg_m3 * sound * sound / 7,
          .sound_m_s = sound,
          .shear_m2_s = s.viscosity_Pa_s / s.density_kg_m3,
          .damping_m2_s = s.artificial_viscosity * sound * d,
          .closest_m = 0.25F * d};
}

}  // namespace

LiquidSettings checked(const LiquidSettings& s) {
  if (!(s.spacing_m > 0 && s.spacing_m < 1e3F)) refuse("spacing_m", s.spacing_m, "> 0");
  if (!(s.density_kg_m3 > 0)) refuse("density_kg_m3", s.density_kg_m3, "> 0");
  if (!(s.viscosity_Pa_s >= 0)) refuse("viscosity_Pa_s", s.viscosity_Pa_s, ">= 0");
  if (!(s.max_speed_m_s > 0)) refuse("max_speed_m_s", s.max_speed_m_s, "> 0");
  if (!(s.artificial_viscosity >= 0)) refuse("artificial_viscosity", s.artificial_viscosity, ">= 0");
  if (s.max_particles <= 0) refuse("max_particles", static_cast<float>(s.max_particles), "> 0");
  const Vec3f edge = s.box_m.extent();
  const float least = std::min({edge.x, edge.y, edge.z});
  if (!(least >= s.spacing_m)) refuse("the shortest edge of box_m", least, "at least the spacing");
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
      motion_(ctx.device(), settings_.max_particles),
      walls_(ctx.device(), std::int64_t{kNearWalls} * settings_.max_particles),
      wall_sums_(ctx.device(), FindBoxWalls::kFaces * WallSums::kCopies),
      left_(ctx.device(), 1) {
  ctx.fill_bytes(count_.view(), 0);
  ctx.fill_bytes(wall_sums_.view(), 0);
  ctx.fill_bytes(left_.view(), 0);
  ctx.synchronize();
}

void Liquid::place(ExecContext& ctx, std::span<const LiquidParticle> particles) {
  if (particles.size() > static_cast<std::size_t>(settings_.max_particles))
    throw Error("liquid: " + std::to_string(particles.size()) + " particles, but max_particles is " +
                std::to_string(settings_.max_particles));
  const std::size_t room = static_cast<std::size_t>(settings_.max_particles);
  std::vector<Vec3f> x(room), v(room);
  std::vector<Index> id(room);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    x[i] = particles[i].x_m;
    v[i] = particles[i].v_m_s;
    id[i] = static_cast<Index>(i);
  }
  const std::vector<Index> count{static_cast<Index>(particles.size())};
  ctx.upload(x, x_m_.view());
  ctx.upload(v, v_m_s_.view());
  ctx.upload(id, id_.view());
  ctx.upload(count, count_.view());
  ctx.synchronize();
}

void Liquid::step(ExecContext& ctx, const StepTime& time) {
  if (time.frame.empty() && !(time.dt_s <= largest_step_s()))
    throw Error("liquid: a step of " + std::to_string(time.dt_s) + " s, but the largest stable step is " +
                std::to_string(largest_step_s()) + " s");
  const Count all(count_.const_view(), settings_.max_particles);
  search_.build(ctx, x_m_.const_view(), id_.const_view(), all);
  const NeighbourCells cells = search_.cells();
  const NearWalls walls{wall_count_.view(), walls_.view()};
  const NearLists lists{list_count_.view(), near_.view()};
  ctx.parallel_for("fluid/walls", search_.placed(),
                   FindBoxWalls{cells.particles, settings_.box_m, settings_.open_faces,
                                constants_.kernel.reach_m(), walls});
  search_.visit_listing(ctx, "fluid/density",
                        LiquidDensity{constants_, walls, cells.order, v_m_s_.const_view(),
                                      density_kg_m3_.view(), motion_.view()},
                        lists);
  search_.visit_listed(
      ctx, "fluid/force",
      LiquidForce{constants_, time, walls, cells.particles, motion_.const_view(), x_m_.view(), v_m_s_.view(),
                  id_.view(), settings_.box_m, wall_sums_.view(), left_.view()},
      lists);
  ctx.parallel_for("fluid/count", 1, NoteParticles{cells.placed, count_.view()});
}

float Liquid::largest_step_s() const {
  const float d = settings_.spacing_m;
  float step = 0.4F * d / (constants_.sound_m_s * (1 + 0.6F * settings_.artificial_viscosity));
  if (constants_.shear_m2_s > 0) step = std::min(step, d * d / (8 * constants_.shear_m2_s));
  return step;
}

LiquidView Liquid::view() const {
  return {Count(count_.const_view(), settings_.max_particles), x_m_.const_view(), v_m_s_.const_view(),
          id_.const_view()};
}

std::vector<LiquidParticle> Liquid::particles(ExecContext& ctx) const {
  const auto count = static_cast<std::size_t>(to_host(ctx, count_.view())[0]);
  const std::vector<Vec3f> x = to_host(ctx, x_m_.view()), v = to_host(ctx, v_m_s_.view());
  const std::vector<Index> id = to_host(ctx, id_.view());
  std::vector<LiquidParticle> all;
  for (std::size_t i = 0; i < count; ++i) {
    if (std::isfinite(x[i].x)) all.push_back({x[i], v[i], id[i]});
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return all;
}

std::vector<float> Liquid::densities_kg_m3(ExecContext& ctx) const {
  std::vector<float> rho = to_host(ctx, density_kg_m3_.view());
  rho.resize(static_cast<std::size_t>(to_host(ctx, count_.view())[0]));
  return rho;
}

std::uint32_t Liquid::left(ExecContext& ctx) const { return to_host(ctx, left_.view())[0]; }

std::vector<Vec3f> Liquid::take_wall_impulses_N_s(ExecContext& ctx) {
  const std::vector<WallSums> sums = to_host(ctx, wall_sums_.view());
  ctx.fill_bytes(wall_sums_.view(), 0);
  ctx.synchronize();
  std::vector<Vec3f> impulses;
  for (std::size_t w = 0; w < sums.size(); w += WallSums::kCopies) {
    std::uint64_t total[3]{};
    for (std::size_t c = w; c < w + WallSums::kCopies; ++c) {
      for (int a = 0; a < 3; ++a) total[a] += sums[c].impulse[a];
    }
    const auto value = [&](int a) {
      return WallSums::kUnit * static_cast<float>(static_cast<std::int64_t>(total[a]));
    };
    impulses.push_back({value(0), value(1), value(2)});
  }
  return impulses;
}

std::vector<LiquidParticle> fill_box(const Box3f& box_m, float spacing_m) {
  const Vec3f edge = box_m.extent();
  const auto along = [&](float m) { return std::max(1, static_cast<int>(std::lround(m / spacing_m))); };
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
