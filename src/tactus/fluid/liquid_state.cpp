// The particles of a liquid: placed, archived, read.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "tactus/fluid/liquid.h"

namespace tactus {

void Liquid::place(std::span<const LiquidParticle> particles) {
  if (particles.size() > static_cast<std::size_t>(settings_.max_particles)) {
    throw Error("liquid: " + std::to_string(particles.size()) + " particles, but max_particles is " +
                std::to_string(settings_.max_particles));
  }
  std::vector<Kept> kept;
  for (const LiquidParticle& p : particles)
    kept.push_back({.particle = {p.x_m, p.v_m_s, static_cast<Index>(kept.size())}, .sorted_m = p.x_m});
  const auto n = static_cast<Index>(particles.size());
  put(kept, n, {.next_id = n, .placed = static_cast<std::uint32_t>(n)});
  // A film takes those that were laid down before they run apart: in the first frame, ahead of its steps.
  if (part_count() == 1) sort_again(kept);
}

void Liquid::put(const std::vector<Kept>& particles, Index count, const LiquidCounters& counters) {
  constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
  const auto capacity = static_cast<std::size_t>(parts_[0].id.size());
  std::vector<Vec3f> x(capacity, {kNowhere, kNowhere, kNowhere}), v(capacity);
  std::vector<float> push(capacity);
  std::vector<Index> id(capacity), layers(LiquidLayers::kCounts);
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
    counters.replaced += c.replaced;
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
  for (EmitterState& e : emitters) e.slot = e.id = e.come = 0, e.now_s = 0;  // of the last step
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
  order.resize(at(to_host(ctx, part.search.cells().placed)[0]));
  // Particles that came since, or before the first step, were not sorted: it comes last.
  std::vector<std::uint8_t> is_sorted(particles.size());
  for (const Index i : order) is_sorted[at(i)] = 1;
  for (Index i = 0; i < here; ++i)
    if (is_sorted[at(i)] == 0) order.push_back(i);
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
    const auto placed = at(std::min(to_host(ctx, part.search.cells().placed)[0], count));
    const std::vector<SearchParticle> sorted = to_host(ctx, part.search.cells().particles.part(0, count));
    constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < x.size(); ++i)
      if (std::isfinite(x[i].x))
        all.push_back({{x[i], v[i], id[i]},
                       push[i],
                       density[i],
                       i < placed ? sorted[i].x_m : Vec3f{kNowhere, kNowhere, kNowhere}});
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

std::vector<float> Liquid::pressures_Pa(float dt_s) const {
  std::vector<std::pair<Index, float>> by_id;
  for (int p = 0; p < part_count(); ++p) {
    ExecContext& ctx = devices_.context(p);
    const LiquidPart& part = parts_[at(p)];
    const Index count = to_host(ctx, part.count.view())[0];
    const auto read = [&](const auto& buffer) { return to_host(ctx, buffer.view().part(0, count)); };
    const std::vector<Vec3f> x = read(part.x_m);
    const std::vector<Index> id = read(part.id);
    const std::vector<float> rho = read(part.density_kg_m3), k = read(part.push),
                             kappa_v = read(part.kappa_v);
    const std::vector<LiquidMotion> motion = read(part.motion);
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!std::isfinite(x[i].x)) continue;
      const float push = settings_.solver == LiquidSolver::dfsph ? k[i] + kappa_v[i] / dt_s : motion[i].push;
      by_id.emplace_back(id[i], push * sqr(rho[i]));
    }
  }
  std::sort(by_id.begin(), by_id.end());
  std::vector<float> all;
  for (const auto& [id, p_Pa] : by_id) all.push_back(p_Pa);
  return all;
}

}  // namespace tactus
