/// The scene's liquid.
#include <cmath>
#include <numbers>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/fluid/block_lattice.h"
#include "tactus/io/region_schema.h"

namespace tactus {
namespace {

bool is_in(const BoxRegion& box, Vec3d p) {
  const Vec3d out = max(box.min_m - p, p - box.max_m);
  return max(out.x, max(out.y, out.z)) <= 1e-9;
}

void describe_block(FieldVisitor& v, BlockDescription& b) {
  describe_box(v, b.box);
  v.vector({"velocity_m_s", "with which it begins"}, b.velocity_m_s, {"m/s", -100, 100});
}

void describe_emitter(FieldVisitor& v, EmitterDescription& e) {
  describe_name(v, {"name", "unique name", kRequired}, e.name);
  v.vector({"position_m", "middle of the disc from which it flows", kRequired}, e.position_m, kPosition);
  v.vector({"direction", "in which it flows; any length > 0"}, e.direction, {"", -1000, 1000});
  v.real({"radius_m", "of the disc"}, e.radius_m, positive("m", 10));
  v.real({"speed_m_s", "of the liquid there"}, e.speed_m_s, positive("m/s", 100));
  v.real({"from_s", "when it begins, in simulated time"}, e.from_s, {"s", 0, 1e6});
  v.real_or_auto({"until_s", "when it ends"}, e.until_s, {"s", 0, 1e6}, "never");
  v.check(dot(e.direction, e.direction) > 0, "direction", "'direction' is zero, expected a direction");
  v.check(!e.until_s || *e.until_s > e.from_s, "until_s",
          "'until_s' " + number_text(e.until_s.value_or(0)) + " is not after 'from_s' " +
              number_text(e.from_s) + ": nothing would flow");
}

void describe_sink(FieldVisitor& v, SinkDescription& s) { describe_box(v, s.box); }

/// Particles that lengths over the spacing ask for, before anything takes memory for them.
void check_counts(FieldVisitor& v, const LiquidDescription& f) {
  const double particle_m3 = f.spacing_m * f.spacing_m * f.spacing_m;
  double blocks_m3 = 0;
  for (const BlockDescription& b : f.blocks) {
    const Vec3d edge = max(b.box.max_m - b.box.min_m, Vec3d{});
    blocks_m3 += edge.x * edge.y * edge.z;
  }
  const double most = kMostLiquidParticles, blocks = blocks_m3 / particle_m3;
  const double coarser_m = std::ceil(1e5 * std::cbrt(blocks_m3 / most)) / 1e5;
  v.check(blocks <= most, "spacing_m",
          "'spacing_m' is " + number_text(f.spacing_m) + ", which takes " + particles_text(blocks) +
              " particles to fill the 'blocks', at most " + particles_text(most) +
              " can be indexed: raise it to at least " + number_text(coarser_m) +
              ", or make the blocks smaller");
  for (const EmitterDescription& e : f.emitters) {
    // In the time in which the liquid moves on by one spacing.
    const double come = std::ceil(std::numbers::pi * e.radius_m * e.radius_m / (f.spacing_m * f.spacing_m));
    v.check(come <= std::max(f.max_particles, 1), "emitters",
            "the 'radius_m' " + number_text(e.radius_m) + " of emitter '" + e.name + "' brings " +
                particles_text(come) + " particles at once at 'spacing_m' " + number_text(f.spacing_m) +
                ", more than 'max_particles' " + std::to_string(f.max_particles) +
                ": lower the radius, or raise 'max_particles' or 'spacing_m'");
  }
}

}  // namespace

void describe_fluid(FieldVisitor& v, LiquidDescription& f) {
  v.real({"spacing_m", "between particles at rest: smaller is finer and slower", kRequired}, f.spacing_m,
         {"m", 0.0001, 1});
  v.choice(
      {"solver",
       "`dfsph`: incompressible, with long steps; `wcsph`: weakly compressible, with steps a tenth as long "
       "and a third as dear"},
      f.solver, {{"dfsph", LiquidModel::dfsph}, {"wcsph", LiquidModel::wcsph}});
  v.integer({"iterations",
             "dfsph: the least of each step; in a pool of 12 layers, 3 leave 0.06 % too much density, 4 "
             "leave 0.01 %; "
             "deeper pools take up to eight times as many"},
            f.iterations, {"", 1, 100});
  v.section({"box",
             "the liquid's world; its faces are walls, but for those that are open. They hold the liquid "
             "alone: bodies fall through them, and need `obstacles`",
             kRequired},
            [&](FieldVisitor& in) { describe_box(in, f.box); });
  v.choice({"open", "faces of the box through which particles leave; `sides` opens the top, too"}, f.open,
           {{"none", LiquidOpen::none},
            {"top", LiquidOpen::top},
            {"sides", LiquidOpen::sides},
            {"all", LiquidOpen::all}});
  v.list({"blocks", "boxes that are full of liquid at the start"}, items_of(f.blocks, describe_block));
  v.list({"emitters", "discs from which liquid flows"}, items_of(f.emitters, describe_emitter));
  v.list({"sinks", "boxes that take all liquid that gets there"}, items_of(f.sinks, describe_sink));
  v.integer({"max_particles", "capacity: when emitters or wounds bring more, the oldest leave"},
            f.max_particles, {"", 1, double{kMostLiquidParticles}});
  v.real({"density_kg_m3", "mass per volume; blood 1060, water 1000"}, f.density_kg_m3,
         positive("kg/m^3", 30000));
  v.real({"viscosity_pa_s",
          "blood 0.0035, water 0.001, honey 10; of `carreau`, what is left at high shear rates"},
         f.viscosity_pa_s, {"Pa s", 0, 1000});
  v.choice({"viscosity",
            "`newton`: the same at all shear rates; `carreau`: thins, the defaults are those of blood"},
           f.viscosity, {{"newton", LiquidViscosity::newton}, {"carreau", LiquidViscosity::carreau}});
  v.real({"zero_shear_viscosity_pa_s", "carreau: at rest"}, f.zero_shear_viscosity_pa_s, {"Pa s", 0, 1000});
  v.real({"relaxation_s", "carreau: thinning begins at a shear rate of 1 over this"}, f.relaxation_s,
         {"s", 0, 1e6});
  v.real({"power_index", "carreau: n, viscosity falls as the shear rate to the power of n - 1"},
         f.power_index, {"", 0.01, 1});
  v.real({"surface_tension_n_m", "blood 0.056, water 0.073; acts where drops have some spacings across"},
         f.surface_tension_n_m, {"N/m", 0, 10});
  v.real({"contact_angle_deg", "at which its surface meets walls, in the liquid: below 90 it wets them"},
         f.contact_angle_deg, {"deg", 0, 180});
  v.real({"artificial_viscosity", "alpha of Monaghan: damps what approaches, and so sound"},
         f.artificial_viscosity, {"", 0, 1});
  v.real_or_auto({"max_speed_m_s",
                  "that the shortest steps are made for; slower liquid takes fewer. What moves faster may be "
                  "compressed"},
                 f.max_speed_m_s, positive("m/s", 1000),
                 "of what falls through the box, faster by what it begins with");
  v.choice<std::optional<bool>>(
      {"film",
       "whether liquid that touches a body, an obstacle or the real surface slowly becomes a film on it, "
       "which flows, follows "
       "cuts and obstacles that move, and drips where it is thick; not in a pool, whose liquid it would soak "
       "up. Without it, sheets of fewer than some eight particles fall apart: puddles want it. `auto`: where "
       "a body bleeds, the solver is dfsph and 'surface_tension_n_m' is > 0"},
      f.film, {{"auto", std::nullopt}, {"true", true}, {"false", false}});
  v.real({"film_drying_m_s",
          "by which a film gets thinner; what dries stays as a stain. Water in still air 3e-8, under a lamp "
          "more"},
         f.film_drying_m_s, {"m/s", 0, 0.01});
  v.choice({"looks", "how it is drawn"}, f.looks,
           {{"blood", LiquidLooks::blood}, {"water", LiquidLooks::water}});
  v.only_when(f.solver == LiquidModel::dfsph, "iterations", "'solver' is dfsph");
  const bool carreau = f.viscosity == LiquidViscosity::carreau;
  for (const char* key : {"zero_shear_viscosity_pa_s", "relaxation_s", "power_index"})
    v.only_when(carreau, key, "'viscosity' is carreau");
  v.only_when(f.surface_tension_n_m > 0, "contact_angle_deg", "'surface_tension_n_m' is > 0");
  v.check(!carreau || f.zero_shear_viscosity_pa_s >= f.viscosity_pa_s, "zero_shear_viscosity_pa_s",
          "'zero_shear_viscosity_pa_s' is " + number_text(f.zero_shear_viscosity_pa_s, f.viscosity_pa_s) +
              ", expected at least 'viscosity_pa_s', " + number_text(f.viscosity_pa_s) +
              ": what is sheared fast is thinner");
  const Vec3d edge = f.box.max_m - f.box.min_m;
  v.check(
      min(edge.x, min(edge.y, edge.z)) >= 2 * f.spacing_m, "spacing_m",
      "'spacing_m' is " + number_text(f.spacing_m) + ", expected at most half of the shortest edge of 'box'");
  for (const BlockDescription& b : f.blocks)
    v.check(is_in(f.box, b.box.min_m) && is_in(f.box, b.box.max_m), "blocks",
            "one of the 'blocks' is not within 'box'");
  for (const EmitterDescription& e : f.emitters)
    v.check(is_in(f.box, e.position_m), "emitters",
            "the 'position_m' of emitter '" + e.name + "' is not within 'box'");
  check_counts(v, f);
}

}  // namespace tactus
