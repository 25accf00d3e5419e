#include "tactus/fluid/wounds.h"

#include <string>

#include "tactus/base/error.h"

namespace tactus {
namespace {

const WoundSettings& checked(const WoundSettings& s) {
  const auto require = [](bool ok, const char* what, float value) {
    if (!ok) throw Error(std::string("wounds: ") + what + " is " + std::to_string(value) + ", must be > 0");
  };
  require(s.rate_m_s > 0, "rate_m_s", s.rate_m_s);
  require(s.spacing_m > 0, "spacing_m", s.spacing_m);
  require(s.max_pieces > 0, "max_pieces", static_cast<float>(s.max_pieces));
  if (!(s.fading_s >= 0)) throw Error("wounds: fading_s is " + std::to_string(s.fading_s) + ", must be >= 0");
  if (!(s.pulse.beats_1_s >= 0))
    throw Error("wounds: pulse.beats_1_s is " + std::to_string(s.pulse.beats_1_s) + ", must be >= 0");
  if (!(s.pulse.share >= 0 && s.pulse.share <= 1))
    throw Error("wounds: pulse.share is " + std::to_string(s.pulse.share) + ", must be from 0 to 1");
  return s;
}

}  // namespace

Wounds::Wounds(ExecContext& ctx, const WoundSettings& settings)
    : settings_(checked(settings)),
      search_(ctx.device(),
              {.max_particles = settings.max_pieces, .reach_m = JudgePlaces::kToLiquid * settings.spacing_m}),
      count_(ctx.device(), 1),
      pieces_(ctx.device(), settings.max_pieces),
      states_(ctx.device(), settings.max_pieces),
      ledgers_(ctx.device(), kStrokes),
      place_m_(ctx.device(), settings.max_pieces),
      speed_m_s_(ctx.device(), settings.max_pieces),
      key_(ctx.device(), settings.max_pieces),
      clock_(ctx.device(), 1),
      is_shut_(ctx.device(), settings.max_pieces),
      open_(ctx.device(), settings.max_pieces),
      open_count_(ctx.device(), 1),
      slot_(ctx.device(), settings.max_pieces),
      planned_(ctx.device(), 1),
      first_id_(ctx.device(), 1),
      wall_count_(ctx.device(), settings.max_pieces),
      walls_(ctx.device(), std::int64_t{kNearWalls} * settings.max_pieces),
      round_(ctx.device(), settings.max_pieces) {
  ctx.fill_bytes(states_.view(), 0);
  ctx.fill_bytes(ledgers_.view(), 0);
  ctx.fill_bytes(clock_.view(), 0);
  ctx.fill_bytes(open_count_.view(), 0);
  set_pieces(ctx, {});
}

void Wounds::set_rate_m_s(float rate_m_s) {
  WoundSettings changed = settings_;
  changed.rate_m_s = rate_m_s;
  settings_ = checked(changed);
}

void Wounds::set_pieces(ExecContext& ctx, std::span<const WoundPiece> pieces) {
  const auto n = static_cast<Index>(pieces.size());
  if (n > max_pieces())
    throw Error("wounds: " + std::to_string(n) + " pieces, but there is room for " +
                std::to_string(max_pieces()));
  if (n > 0) ctx.upload(pieces, pieces_.view().part(0, n));
  ctx.upload(std::span<const Index>(&n, 1), count_.view());
  ctx.synchronize();
}

void Wounds::try_places(ExecContext& ctx, View<const FrameParams> frame, View<const Vec3f> x_m,
                        View<const Vec3f> v_m_s) {
  const float d = settings_.spacing_m;
  ctx.parallel_for("wounds/try", count(),
                   TryWounds{pieces_.const_view(), frame, x_m, v_m_s, clock_.const_view(), settings_.pulse,
                             settings_.rate_m_s, settings_.fading_s > 0 ? 1.F / settings_.fading_s : 0.F,
                             1.F / (d * d * d), d, states_.view(), ledgers_.view(), place_m_.view(),
                             speed_m_s_.view(), key_.view(), is_shut_.view()});
  search_.build(ctx, place_m_.const_view(), {}, count());
}

void Wounds::bleed(ExecContext& ctx, View<const FrameParams> frame, const NeighbourSearch& search,
                   const LiquidArrivals& liquid) {
  const float d = settings_.spacing_m;
  const View<const Index> order = search_.cells().order;
  search_.visit(
      ctx, "wounds/liquid", search,
      FindLiquidRound{
          {1.F / d}, d * d * d, search_.cells().particles, View<const Vec3f>(liquid.x_m), round_.view()});
  ctx.parallel_for("wounds/judge", search_.placed(),
                   JudgePlaces{order,
                               near_walls(),
                               round_.const_view(),
                               {1.F / d},
                               d,
                               pieces_.const_view(),
                               states_.view(),
                               is_shut_.const_view(),
                               key_.view()});
  search_.visit(ctx, "wounds/beat",
                BeatPlaces{order, key_.const_view(), pieces_.const_view(), open_.view(), open_count_.view()});
  ctx.parallel_for("wounds/plan", 1,
                   PlanWounds{open_.const_view(), open_count_.view(), frame, liquid, ledgers_.view(),
                              clock_.view(), slot_.view(), planned_.view(), first_id_.view()});
  ctx.parallel_for("wounds/bleed", Count(planned_.const_view(), max_pieces()),
                   BleedWounds{open_.const_view(), slot_.const_view(), first_id_.const_view(),
                               place_m_.const_view(), speed_m_s_.const_view(), liquid, states_.view()});
}

void Wounds::archive(ExecContext& ctx, StateArchive& a) {
  std::vector<WoundState> states = to_host(ctx, states_.const_view());
  a.values("states of wounds", states);
  for (const WoundState& s : states) a.check(s.level >= -1000 && s.level <= 1000, "states of wounds");
  ctx.upload(states, states_.view());
  ctx.synchronize();
  a.buffer(ctx, "ledgers of strokes", ledgers_);
  a.buffer(ctx, "clock of wounds", clock_);
}

}  // namespace tactus
