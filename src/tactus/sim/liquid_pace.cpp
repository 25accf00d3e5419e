// How many steps the liquid takes in a frame.
#include <algorithm>
#include <cmath>

#include "tactus/sim/scene_liquid.h"

namespace tactus {
namespace {

/// How many layers bear on one another, as the mean pressure tells: in a pool, half of them bear on each.
double layers_of(const LiquidReport& last, double gravity_m_s2) {
  if (last.here == 0 || !(gravity_m_s2 > 0)) return 0;
  const double borne_m_s2 = static_cast<double>(last.borne) / double{LiquidReport::kBorneUnits} / last.here;
  return 2 * borne_m_s2 / gravity_m_s2;
}

/// The longest step in which so many layers stay at rest, over (d / g)^(1/2). With N layers, the force on the
/// floor was the weight to 1 % where N times that was 1.67, 1.74, 1.79, 1.52 and 1.93 for N = 8, 10, 12, 16
/// and 24, and not at 2.1, 2.4 and 2.3 for N = 12, 16 and 24 (docs/concepts/liquid.md). Pools of 2 and 5
/// layers rest at 0.35, too; at half of that two layers are 0.1 % too dense in place of 0.6 %.
double longest_fall(double layers) {
  constexpr double kLayers = 1.8, kMost = 0.2;
  return std::min(kMost, kLayers / std::max(layers, 1.0));
}

/// The acceleration of a soft body's wall, whose outermost nodes have half of a layer's mass.
double wall_yields_m_s2(double pressure_Pa, double density_kg_m3, double spacing_m) {
  return pressure_Pa / (0.5 * density_kg_m3 * spacing_m);
}

/// The longest step in which such a wall gets out of the liquid's way by no more than a part of d. What the
/// liquid does to a body comes once a step, so its nodes swing: a cube of 30 kPa under ten layers of d = 6 mm
/// was surrounded by liquid of twice its density, which boiled at 0.4 m/s, in steps of 2.8 ms, and is by
/// liquid of 1.03 times its density in steps of 1 ms.
double longest_yield_s(double yields_m_s2, double d) {
  constexpr double kPart = 0.01;
  return yields_m_s2 > 0 ? std::sqrt(kPart * d / yields_m_s2) : 1e30;
}

/// (mean u^4)^(1/4) of the speeds u relative to neighbours and walls: of a liquid that moves as one, u; of
/// speeds from 0 to u, 0.67 u; of one particle of a thousand, 0.18 u.
double relative_m_s(const LiquidReport& last, double max_speed_m_s) {
  if (last.here == 0) return 0;
  return max_speed_m_s * std::sqrt(std::sqrt(static_cast<double>(last.quartic) /
                                             double{LiquidReport::kQuarticUnits} / last.here));
}

}  // namespace

/// Whether emitters or wounds may bring liquid in that time.
bool SceneLiquid::may_bring(double from_s, double to_s) const {
  const auto is_on = [&](const EmitterDescription& e) {
    return e.from_s <= to_s && from_s <= e.until_s.value_or(to_s);
  };
  const auto bleeds = [](const Felt& felt) { return felt.bleeds; };
  return std::any_of(description_.emitters.begin(), description_.emitters.end(), is_on) ||
         std::any_of(bodies_.begin(), bodies_.end(), bleeds);
}

void SceneLiquid::follow(const Readback& readback, double dt_s) {
  last_ = readback.get<LiquidReport>(report_)[0];
  if (!(dt_s > 0) || last_.here == 0 || bodies_.empty()) return;
  const std::vector<Vec3f> impulses_N_s = readback.get<Vec3f>(impulses_);
  // As if the liquid were a cube, of which a face lies on the body.
  const double d = description_.spacing_m, wet_m2 = std::pow(last_.here, 2.0 / 3) * d * d;
  for (const Felt& felt : bodies_) {
    const BodyDescription& body = felt.body->description();
    const Vec3f impulse_N_s = impulses_N_s.at(static_cast<std::size_t>(felt.collider));
    const double pressure_Pa = static_cast<double>(length(impulse_N_s)) / dt_s / wet_m2;
    const double yields_m_s2 = wall_yields_m_s2(pressure_Pa, body.material.density_kg_m3, body.spacing_m);
    if (std::isfinite(yields_m_s2))  // else the body blew up
      pace_.yields_m_s2 = std::max(pace_.yields_m_s2, static_cast<float>(std::min(yields_m_s2, 1e9)));
  }
}

/// Layers are counted by the pressure of one moment, and a column that swings has moments without any. With
/// longer steps and fewer iterations then, it would swing the more: one of 34 columns of 60 layers was
/// pressed to 2.4 of its density within two seconds. So what bore, or pressed a body, does so for another
/// second.
void SceneLiquid::remember_layers(double dt_s, double gravity_m_s2) {
  constexpr double kForgets_s = 1;
  const double kept = std::exp(-dt_s / kForgets_s);
  pace_.layers = static_cast<float>(std::max(layers_of(last_, gravity_m_s2), double{pace_.layers} * kept));
  pace_.yields_m_s2 = static_cast<float>(double{pace_.yields_m_s2} * kept);
}

/// Iterations find the part of a long wave of pressure that they can carry in a step: four of them as much as
/// twelve layers need (docs/concepts/liquid.md). And while densities are more than 0.1 % too large in the
/// mean, there are half as many again.
void SceneLiquid::choose_iterations() {
  constexpr double kLayers = 12, kExcess = 1e-3;
  constexpr auto kMost = static_cast<Index>(kGrowth.size()) - 1;
  const int least = is_reduced_ ? reduced_iterations() : description_.iterations;
  if (description_.solver == LiquidModel::dfsph && last_.here > 0) {
    const double excess = static_cast<double>(last_.excess) / double{LiquidReport::kExcessUnits} / last_.here,
                 growth = double{pace_.layers} / kLayers;
    const auto enough =
        std::find_if(kGrowth.begin(), kGrowth.end() - 1, [&](double k) { return k >= growth; });
    const auto for_layers = static_cast<Index>(enough - kGrowth.begin());
    if (excess > kExcess) ++pace_.for_excess;
    if (excess < 0.25 * kExcess) --pace_.for_excess;
    pace_.for_excess = std::clamp(pace_.for_excess, Index{0}, std::min(for_layers + 1, kMost));
    pace_.growth = std::max(for_layers, pace_.for_excess);
  }
  liquid_.set_iterations(
      static_cast<int>(std::ceil(least * kGrowth.at(static_cast<std::size_t>(pace_.growth)))));
}

/// The pace grows at once. It falls by two fifths a frame at most, and only where clearly less is needed.
void SceneLiquid::look_ahead(double from_s, double to_s, Vec3d gravity_m_s2, std::span<const Reach> movers) {
  constexpr double kMargin = 1.1, kMuchLess = 0.85, kFallsBy = 0.6;
  /// A particle that has no neighbours may go 1.5 spacings in a step: it first meets a wall, or the liquid,
  /// within their reach of two. Those that fly together may go one, as a block that strikes a plate at 1.5
  /// loses some beside it; and 0.4 relative to one another.
  constexpr double kFreeOverNear = 0.4 / 1.5, kTogetherOverNear = 0.4;
  const double dt_s = to_s - from_s, d = description_.spacing_m, g = length(gravity_m_s2);
  remember_layers(dt_s, g);
  choose_iterations();
  const double most = liquid_.settings().max_speed_m_s, gains = 0.5 * g * dt_s;
  double near = relative_m_s(last_, most) + gains;
  const bool brings = may_bring(from_s, to_s);
  pace_.is_empty = last_.here == 0 && !brings ? 1 : 0;
  if (brings)
    for (const EmitterDescription& e : description_.emitters) near = std::max(near, e.speed_m_s);
  pace_.walls_move = 0;
  for (const Reach& mover : movers) {
    const double displacement_m = (mover.m_s + double{last_.fastest_m_s} + gains) * dt_s + 4 * d;
    const Vec3d apart =
        max(mover.low_m - vec_cast<double>(last_.high_m), vec_cast<double>(last_.low_m) - mover.high_m);
    const bool is_far = last_.here > 0 && !brings && std::max({apart.x, apart.y, apart.z}) > displacement_m;
    if (is_far || pace_.is_empty != 0) continue;
    near = std::max(near, mover.m_s);
    pace_.walls_move = 1;
  }
  const double alone = kFreeOverNear * (double{last_.fastest_m_s} + gains),
               together = kTogetherOverNear * (double{last_.fastest_together_m_s} + gains),
               needed = std::min(std::max({near, alone, together}), most);
  double pace = pace_.fastest_m_s;
  if (needed > pace)
    pace = std::min(kMargin * needed, most);
  else if (needed < kMuchLess * pace)
    pace = std::max(kMargin * needed, kFallsBy * pace);
  pace_.fastest_m_s = static_cast<float>(pace);
  pace_.longest_step_s = liquid_.largest_step_s(pace_.fastest_m_s);
  double rests_s = longest_yield_s(double{pace_.yields_m_s2}, d);
  if (g > 0) rests_s = std::min(rests_s, longest_fall(double{pace_.layers}) * std::sqrt(d / g));
  pace_.longest_step_s =
      std::clamp(static_cast<float>(rests_s), liquid_.largest_step_s(), pace_.longest_step_s);
}

int SceneLiquid::steps_for(double dt_s) const {
  if (pace_.is_empty != 0 || !(dt_s > 0)) return 0;
  return std::max(static_cast<int>(std::ceil(dt_s / double{pace_.longest_step_s} - 1e-4)), 1);
}

}  // namespace tactus
