#include "tactus/sim/scene_liquid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/cut_capacity.h"
#include "tactus/sim/body/slab_points.h"

namespace tactus {
namespace {

Box3f to_box(const BoxRegion& box) { return {vec_cast<float>(box.min_m), vec_cast<float>(box.max_m)}; }

Index open_faces(LiquidOpen open) {
  constexpr Index kTop = 1 << 3, kSides = 1 << 0 | 1 << 1 | 1 << 4 | 1 << 5, kFloor = 1 << 2;
  switch (open) {
    case LiquidOpen::none:
      return 0;
    case LiquidOpen::top:
      return kTop;
    case LiquidOpen::sides:
      return kTop | kSides;
    case LiquidOpen::all:
      break;
  }
  return kTop | kSides | kFloor;
}

LiquidSettings settings_of(const Scene& scene) {
  const LiquidDescription& f = *scene.fluid;
  LiquidSettings s{.solver = f.solver == LiquidModel::dfsph ? LiquidSolver::dfsph : LiquidSolver::wcsph,
                   .iterations = f.iterations,
                   .spacing_m = static_cast<float>(f.spacing_m),
                   .density_kg_m3 = static_cast<float>(f.density_kg_m3),
                   .viscosity_Pa_s = static_cast<float>(f.viscosity_pa_s),
                   .surface_tension_N_m = static_cast<float>(f.surface_tension_n_m),
                   .contact_angle_deg = static_cast<float>(f.contact_angle_deg),
                   .max_speed_m_s = static_cast<float>(liquid_speed_m_s(f, scene.gravity_m_s2)),
                   .artificial_viscosity = static_cast<float>(f.artificial_viscosity),
                   .box_m = to_box(f.box),
                   .open_faces = open_faces(f.open),
                   .max_particles = f.max_particles,
                   .other_walls = kColliders + static_cast<Index>(scene.bodies.size()),
                   .least_particles = f.least_particles};
  if (f.viscosity == LiquidViscosity::carreau)
    s.carreau = {.zero_shear_Pa_s = static_cast<float>(f.zero_shear_viscosity_pa_s),
                 .relaxation_s = static_cast<float>(f.relaxation_s),
                 .index = static_cast<float>(f.power_index)};
  // Wounds and films look for capacity in all of the liquid: it stays on one device.
  if (has_film(scene) || std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                     [](const BodyDescription& b) { return b.bleeding.has_value(); }))
    s.least_particles = f.max_particles, s.arrivals = 1024;
  for (const EmitterDescription& e : f.emitters) {
    s.emitters.push_back({.position_m = vec_cast<float>(e.position_m),
                          .direction = vec_cast<float>(e.direction),
                          .radius_m = static_cast<float>(e.radius_m),
                          .speed_m_s = static_cast<float>(e.speed_m_s),
                          .from_s = e.from_s,
                          .until_s = e.until_s.value_or(1e30)});
  }
  for (const SinkDescription& sink : f.sinks) s.sinks_m.push_back(to_box(sink.box));
  return s;
}

}  // namespace

double liquid_speed_m_s(const LiquidDescription& liquid, Vec3d gravity_m_s2) {
  if (liquid.max_speed_m_s) return *liquid.max_speed_m_s;
  const Vec3d edge = liquid.box.max_m - liquid.box.min_m, g = gravity_m_s2;
  const double fall = std::abs(g.x) * edge.x + std::abs(g.y) * edge.y + std::abs(g.z) * edge.z;
  double begins = 0;
  for (const EmitterDescription& e : liquid.emitters) begins = std::max(begins, e.speed_m_s);
  for (const BlockDescription& b : liquid.blocks) begins = std::max(begins, length(b.velocity_m_s));
  return std::max(std::sqrt(begins * begins + 2 * fall), 0.1);
}

int SceneLiquid::part_count(const DeviceSet& devices, const Scene& scene) {
  return scene.fluid ? Liquid::part_count(devices, settings_of(scene)) : 0;
}

/// Counts before it takes memory: a block may hold more particles than a machine has bytes.
/// Where blocks overlap, the first one fills the space: two particles at one place would never part.
std::vector<LiquidParticle> SceneLiquid::fill_blocks(const StillSolids& solids, LeftOut& left_out) const {
  /// Particles of blocks that share a face are half a spacing from it.
  constexpr float kNear = 0.4F;
  const float d = liquid_.settings().spacing_m;
  const auto most = static_cast<std::size_t>(description_.max_particles);
  double count = 0;
  for (const BlockDescription& block : description_.blocks)
    count += BlockLattice::of(to_box(block.box), d).count();
  std::vector<LiquidParticle> particles;
  particles.reserve(static_cast<std::size_t>(std::min(count, static_cast<double>(most))));
  std::vector<Box3f> filled;
  for (const BlockDescription& block : description_.blocks) {
    const auto is_filled = [&](Vec3f x_m) {
      return std::any_of(filled.begin(), filled.end(), [&](const Box3f& box) {
        const Vec3f out = max(box.min - x_m, x_m - box.max);
        return std::max({out.x, out.y, out.z}) < kNear * d;
      });
    };
    const bool has_capacity = BlockLattice::of(to_box(block.box), d).for_each([&](Vec3f x_m) {
      if (solids.hold(x_m, 0.4F * d)) {
        ++left_out.in_solids;
        return true;
      }
      if (is_filled(x_m)) {
        ++left_out.in_blocks;
        return true;
      }
      if (particles.size() == most) return false;
      particles.push_back({x_m, vec_cast<float>(block.velocity_m_s), static_cast<Index>(particles.size())});
      return true;
    });
    if (!has_capacity) refuse_blocks(count);
    filled.push_back(to_box(block.box));
  }
  return particles;
}

/// @param count of particles that the blocks hold
void SceneLiquid::refuse_blocks(double count) const {
  const int most = description_.max_particles;
  // In steps of 1 %, so that a lattice that is rounded up fits, too.
  const double coarser_m = description_.spacing_m * std::cbrt(count / most) * 1.01;
  const std::string raise = count <= kMostLiquidParticles
                                ? "raise 'fluid.max_particles' to " + particles_text(count) + ", or "
                                : "";
  throw usage_error("'fluid.blocks' hold " + particles_text(count) + " particles at 'fluid.spacing_m' " +
                    number_text(description_.spacing_m) + ", but 'fluid.max_particles' is " +
                    std::to_string(most) + ": " + raise + "raise 'fluid.spacing_m' to about " +
                    number_text(std::ceil(coarser_m * 1e5) / 1e5) + ", or make the blocks smaller");
}

/// Viscosity that needs steps a tenth as long as the liquid's speed does costs ten times the time.
void SceneLiquid::tell_of_short_steps() {
  const LiquidConstants& liquid = liquid_.constants();
  const float step_s = liquid_.largest_step_s(), d = liquid.spacing_m;
  if (step_s > 0.1F * 0.4F * d / liquid.max_speed_m_s) return;
  const bool thins = description_.viscosity == LiquidViscosity::carreau;
  const std::string key = thins ? "'fluid.zero_shear_viscosity_pa_s'" : "'fluid.viscosity_pa_s'";
  first_notices_.push_back(
      {"liquid.short_steps", Severity::warning,
       "the liquid takes " + number_text(std::ceil(1 / double{step_s})) + " steps a second: " + key + " " +
           number_text(thins ? description_.zero_shear_viscosity_pa_s : description_.viscosity_pa_s) +
           " is large for 'fluid.spacing_m' " + number_text(double{d}),
       "lower " + key + " (honey has 10), or raise 'fluid.spacing_m'"});
}

/// Sheets of few particles don't hold together: 1 ml at 90 degrees ran apart where a puddle has 6.6 layers.
/// It is 2 (sigma / (rho g))^(1/2) sin(angle / 2) high, where there is not enough liquid to cover the floor.
void SceneLiquid::tell_of_thin_puddles(double placed_m3, Vec3d gravity_m_s2) {
  constexpr double kLeastLayers = 8, kCovers = 0.5;
  const LiquidDescription& f = description_;
  const double g = length(gravity_m_s2);
  if (f.film || f.solver != LiquidModel::dfsph || !(f.surface_tension_n_m > 0 && g > 0)) return;
  double all_m3 = placed_m3;
  for (const EmitterDescription& e : f.emitters) {
    if (!e.until_s) return;
    all_m3 += std::numbers::pi * sqr(e.radius_m) * e.speed_m_s * (*e.until_s - e.from_s);
  }
  const double high_m = 2 * std::sqrt(f.surface_tension_n_m / (f.density_kg_m3 * g)) *
                        std::sin(f.contact_angle_deg * std::numbers::pi / 360);
  const Vec3d edge_m = f.box.max_m - f.box.min_m, down = (1 / g) * gravity_m_s2;
  const double floor_m2 = std::abs(down.x) * edge_m.y * edge_m.z + std::abs(down.y) * edge_m.x * edge_m.z +
                          std::abs(down.z) * edge_m.x * edge_m.y;
  if (!(all_m3 > 0) || high_m >= kLeastLayers * f.spacing_m || all_m3 > kCovers * floor_m2 * high_m) return;
  first_notices_.push_back({"liquid.thin_puddle", Severity::warning,
                            "puddles of this liquid are " + number_text(std::round(1e4 * high_m) / 1e4) +
                                " m high, and 'fluid.spacing_m' is " + number_text(f.spacing_m) +
                                ": particles alone don't hold such sheets together",
                            "say 'film: true' under 'fluid'"});
}

SceneLiquid::SceneLiquid(DeviceSet& devices, const Scene& scene,
                         const std::vector<std::unique_ptr<SoftBody>>& bodies,
                         std::span<const ObstacleDescription> obstacles)
    : devices_(devices), description_(*scene.fluid), liquid_(devices, settings_of(scene)) {
  LeftOut left_out;
  const std::vector<LiquidParticle> particles = fill_blocks(StillSolids(bodies, obstacles), left_out);
  const float d = liquid_.settings().spacing_m;
  const auto tell = [&](int count, const char* code, const char* where, const char* remedy) {
    if (count > 0)
      first_notices_.push_back(
          {code, Severity::info,
           std::to_string(count) + " particles of 'fluid.blocks' lay in " + where + " and were left out",
           remedy});
  };
  tell(left_out.in_solids, "liquid.overlap", "bodies or obstacles", "");
  tell(left_out.in_blocks, "liquid.blocks_overlap", "an earlier block", "let 'fluid.blocks' not overlap");
  for (const ObstacleDescription& o : obstacles) {
    const float thin = 2 * std::min({o.half_m.x, o.half_m.y, o.half_m.z});
    if (o.kind == ObstacleKind::box && thin < d)
      first_notices_.push_back({"liquid.thin_wall", Severity::warning,
                                "obstacle '" + o.name + "' is " + number_text(double{thin}) +
                                    " m thick, and the liquid's spacing is " + number_text(double{d}) +
                                    " m: it may leak through",
                                "take a thicker obstacle, or a smaller 'fluid.spacing_m'"});
  }
  if (description_.solver == LiquidModel::dfsph) tell_of_short_steps();
  liquid_.place(particles);
  for (const LiquidParticle& p : particles) {
    LiquidReport one{.here = 1, .fastest_m_s = length(p.v_m_s), .low_m = p.x_m, .high_m = p.x_m};
    one.quartic = LiquidReport::quartic_of(one.fastest_m_s / liquid_.settings().max_speed_m_s);
    last_.add(one);
  }
  // As if all stood one on the other, at rest.
  const Vec3d depth = max(vec_cast<double>(last_.high_m - last_.low_m), Vec3d{}), g = scene.gravity_m_s2;
  const double bears_m_s2 = 0.5 *
                            (std::abs(g.x) * depth.x + std::abs(g.y) * depth.y + std::abs(g.z) * depth.z) /
                            description_.spacing_m;
  last_.borne = static_cast<std::uint64_t>(bears_m_s2 * double{LiquidReport::kBorneUnits}) *
                static_cast<std::uint64_t>(last_.here);
  pace_ = {.fastest_m_s = liquid_.settings().max_speed_m_s, .longest_step_s = liquid_.largest_step_s()};
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (bodies[b]->description().contact)
      add_body(*bodies[b], Liquid::kFaces + kColliders + static_cast<Index>(b));
  if (has_film(scene)) {
    film_ = std::make_unique<SceneFilm>(devices_.context(0), scene, liquid_);
    for (const Felt& felt : bodies_) film_->add_body(*felt.body);
    film_->add_obstacles(obstacles, first_notices_);
  } else if (!description_.film) {
    tell_of_thin_puddles(static_cast<double>(particles.size()) * std::pow(description_.spacing_m, 3),
                         scene.gravity_m_s2);
  } else if (description_.film.value_or(false)) {
    first_notices_.push_back(
        {"liquid.no_film", Severity::info,
         "'fluid.film' is true, but no body, obstacle or floor touches the liquid: there is no film",
         "let a body have 'contact: true', add an obstacle, or close the floor of 'fluid.box'"});
  }
}

void SceneLiquid::add_body(SoftBody& body, Index collider) {
  const float d = liquid_.settings().spacing_m, h = body.shape().lattice.spacing_m;
  WallSurface surface{all_walls(devices_.context(0), body.shape().lattice, body.surface()),
                      {},
                      h,
                      liquid_.settings().box_m,
                      body.points().nodes(0)};
  if (const auto copies = static_cast<Index>(body.shape().lattice.copies.size()); copies > 0) {
    // A copy has a wall of some 1.2 h^2, in triangles of 0.2 d^2, or in a few, and pieces of the surface.
    const Index each = 30 + static_cast<Index>(10 * sqr(h / d));
    const SurfaceCapacity capacity = surface_capacity(body.shape().lattice, body.shape().surface_m);
    surface.capacity = {capacity.vertices, each * copies, each * copies, capacity.triangles};
  }
  Felt& felt = bodies_.emplace_back();
  felt.body = &body;
  felt.collider = collider;
  felt.walls = std::make_unique<BodyWalls>(devices_, liquid_.part_count(), surface, collider, d,
                                           liquid_.settings().max_particles);
  const Index pieces = body.cuts() != nullptr ? body.cuts()->keep_wounds(d) : 0;
  if (pieces == 0) return;
  ExecContext& ctx = devices_.context(0);
  const BleedingDescription& bleeding = body.description().bleeding.value();
  felt.wounds = std::make_unique<Wounds>(
      ctx, WoundSettings{.rate_m_s = static_cast<float>(bleeding.rate_m_s),
                         .fading_s = static_cast<float>(bleeding.fading_s.value_or(0)),
                         .pulse = {.beats_1_s = bleeding.pulse_per_min.value_or(0) / 60,
                                   .share = static_cast<float>(bleeding.pulse_share)},
                         .spacing_m = d,
                         .max_pieces = pieces});
  felt.hits = Buffer<WallHit>(ctx.device(), std::int64_t{kWallSides} * pieces);
}

void SceneLiquid::renew(SoftBody& body) {
  const auto known =
      std::find_if(bodies_.begin(), bodies_.end(), [&](const Felt& felt) { return felt.body == &body; });
  if (known == bodies_.end()) return;
  const auto place = static_cast<std::size_t>(known - bodies_.begin());
  const bool was_full = known->was_full, was_late = known->was_late;
  add_body(body, known->collider);
  bodies_[place] = std::move(bodies_.back());
  bodies_.pop_back();
  bodies_[place].was_full = was_full;
  bodies_[place].was_late = was_late;
  if (film_) film_->renew(body);
}

void SceneLiquid::follow_cut(SoftBody& body, std::vector<Notice>& notices) {
  const auto known =
      std::find_if(bodies_.begin(), bodies_.end(), [&](const Felt& felt) { return felt.body == &body; });
  if (known == bodies_.end()) return body.cuts()->forget_wall_change();
  known->walls->apply(body.cuts()->take_wall_change());
  if (film_) film_->follow_cut(body);
  if (known->wounds) {
    const std::vector<WoundPiece> pieces = body.cuts()->wound_pieces();
    known->wounds->set_pieces(devices_.context(0), pieces);
    known->bleeds = !pieces.empty();
  }
  if ((known->walls->is_full() || body.cuts()->wounds_are_full()) && !std::exchange(known->was_full, true))
    notices.push_back({"liquid.cut_full", Severity::warning,
                       "body '" + body.name() +
                           "': there is no capacity for more of its cut walls: the rest neither stops the "
                           "liquid nor bleeds",
                       "raise 'cut_capacity' of the body, or 'fluid.spacing_m'"});
}

void SceneLiquid::balance(const Readback& readback) {
  std::vector<std::vector<Index>> layers;
  for (const Readback::Place& place : layers_) layers.push_back(readback.get<Index>(place));
  if (layers.size() > 1) liquid_.balance(layers);
}

LiquidReport SceneLiquid::report(const Readback& readback, std::vector<Notice>& notices) {
  std::move(first_notices_.begin(), first_notices_.end(), std::back_inserter(notices));
  first_notices_.clear();
  const LiquidReport r = readback.get<LiquidReport>(report_)[0];
  if (std::exchange(replaced_, r.replaced) != r.replaced)
    notices.push_back({"liquid.full", Severity::warning,
                       "the liquid has its " + std::to_string(description_.max_particles) +
                           " particles: the oldest leave where newer ones need their capacity",
                       "raise 'fluid.max_particles', add a sink, or let emitters end: 'until_s'"});
  if (r.waiting > 0)
    notices.push_back({"liquid.waiting", Severity::warning,
                       "'fluid.max_particles' is " + std::to_string(description_.max_particles) +
                           ", less than emitters bring at once: they wait",
                       "raise 'fluid.max_particles', or lower 'radius_m' of the emitters"});
  if (r.fast > 0)
    notices.push_back({"liquid.fast", Severity::warning,
                       "liquid is faster than the " +
                           number_text(std::round(1e3 * double{liquid_.settings().max_speed_m_s}) / 1e3) +
                           " m/s that its steps are made for, and may be compressed by more than 1 %",
                       "raise 'fluid.max_speed_m_s'"});
  return r;
}

void SceneLiquid::add_forces(const Readback& readback,
                             const std::function<std::string(Index collider)>& name_of, double dt_frame_s,
                             std::vector<LiquidReaction>& forces) const {
  constexpr std::array kFaces{"face -x", "face +x", "face -y", "face +y", "face -z", "face +z"};
  if (!(dt_frame_s > 0)) return;
  const std::vector<Vec3f> impulses = readback.get<Vec3f>(impulses_);
  for (std::size_t k = 0; k < impulses.size(); ++k) {
    if (impulses[k] == Vec3f{}) continue;
    const std::string on = k < kFaces.size() ? kFaces.at(k) : name_of(static_cast<Index>(k - kFaces.size()));
    auto of = std::find_if(forces.begin(), forces.end(), [&](const LiquidReaction& f) { return f.on == on; });
    if (of == forces.end()) of = forces.insert(of, LiquidReaction{on, {}});
    of->force_N += static_cast<float>(1 / dt_frame_s) * impulses[k];
  }
}

double SceneLiquid::waiting_m3(const Readback& readback, double dt_frame_s, std::vector<Notice>& notices) {
  constexpr double kMany = 20;  // particles; fewer wait now and then
  const double particle_m3 = std::pow(description_.spacing_m, 3);
  double all = last_.waiting;
  for (Felt& felt : bodies_) {
    if (!felt.wounds) continue;
    double waiting = 0;
    for (const WoundLedger& ledger : readback.get<WoundLedger>(felt.ledgers))
      waiting += static_cast<double>(ledger.due) / WoundLedger::kUnits - static_cast<double>(ledger.emitted);
    all += waiting;
    const BleedingDescription& bleeding = felt.body->description().bleeding.value();
    const double rate_m_s = bleeding.rate_m_s * (bleeding.pulse_per_min ? 1 + bleeding.pulse_share : 1);
    const auto most_m_s = double{TryWounds::most_m_s(static_cast<float>(description_.spacing_m),
                                                     static_cast<float>(std::max(dt_frame_s, 1e-6)))};
    if (waiting < kMany || rate_m_s <= most_m_s || std::exchange(felt.was_late, true)) continue;
    notices.push_back({"liquid.wounds_wait", Severity::warning,
                       "body '" + felt.body->name() + "' bleeds " + number_text(rate_m_s) +
                           " m/s (volume per time and area), but wounds can bring " +
                           number_text(std::round(1e4 * most_m_s) / 1e4) +
                           " m/s at most, one particle's spacing a frame: the rest waits",
                       "lower 'bleeding.rate_m_s', raise 'fluid.spacing_m', or simulate shorter frames"});
  }
  return particle_m3 * all;
}

void SceneLiquid::add_bleeding(const Readback& readback, std::vector<CutScore>& cuts) const {
  const double particle_m3 = std::pow(description_.spacing_m, 3);
  for (const Felt& felt : bodies_) {
    if (!felt.wounds) continue;
    const std::vector<WoundLedger> ledgers = readback.get<WoundLedger>(felt.ledgers);
    for (CutScore& cut : cuts) {
      if (cut.body != felt.body->name() || cut.stroke >= kStrokes) continue;
      const WoundLedger& ledger = ledgers[static_cast<std::size_t>(cut.stroke)];
      cut.due_m3 = particle_m3 * static_cast<double>(ledger.due) / WoundLedger::kUnits;
      cut.bled_m3 = particle_m3 * static_cast<double>(ledger.emitted);
    }
  }
}

std::vector<Vec3f> SceneLiquid::positions_m() const {
  std::vector<Vec3f> x;
  for (const LiquidParticle& p : liquid_.particles()) x.push_back(p.x_m);
  return x;
}

void SceneLiquid::archive(StateArchive& a) {
  liquid_.archive(a);
  a.value("last report", last_);
  a.value("pace", pace_);
  constexpr auto kMost = static_cast<Index>(kGrowth.size());
  a.check(pace_.fastest_m_s >= 0 && pace_.longest_step_s > 0 && pace_.layers >= 0 && pace_.yields_m_s2 >= 0 &&
              pace_.growth >= 0 && pace_.growth < kMost && pace_.for_excess >= 0 && pace_.for_excess < kMost,
          "pace");
  archive_of_bodies(a);
}

void SceneLiquid::archive_of_bodies(StateArchive& a) {
  for (Felt& felt : bodies_) {
    if (!felt.wounds) continue;
    a.set_owner("wounds of body '" + felt.body->name() + "'");
    a.value("whether their capacity is full", felt.was_full);
    felt.wounds->archive(devices_.context(0), a);
  }
  if (film_) film_->archive(a);
}

}  // namespace tactus
