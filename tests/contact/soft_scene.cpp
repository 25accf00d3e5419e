#include "contact/soft_scene.h"

namespace tactus::test {
namespace {

FlsmMaterial matched_material(const SoftMaterial& m, float density) {
  return {
      .young_Pa = m.elastic.young_Pa, .density_kg_m3 = density, .half_width = 1, .damping_ratio = m.damping};
}

RealSurfaceSettings roomy(float spacing_m) {
  RealSurfaceSettings s;
  s.sample_spacing_m = spacing_m;
  s.max_vertices = s.max_triangles = s.max_raw_samples = 1 << 17;
  s.max_samples = 1 << 15;
  return s;
}

}  // namespace

SoftThing::SoftThing(ExecContext& ctx, CubeLattice lattice_in, const TriangleMesh& surface_in,
                     const SoftMaterial& m)
    : lattice(std::move(lattice_in)),
      surface(surface_in),
      material(m),
      elements(lattice.cubes.size(), m.matched ? 0 : 1),
      solver(ctx, {.lattice = lattice,
                   .elements = elements,
                   .materials = {&m.elastic, 1},
                   .tled = {.damping_ratio = m.damping},
                   .flsm = matched_material(m, m.elastic.density_kg_m3)}),
      state(rest_state(ctx, lattice)),
      mass_kg(to_device(ctx, lattice.node_mass_kg)),
      held(to_device(ctx, std::vector<Index>(lattice.fixed.begin(), lattice.fixed.end()))),
      points(ctx, surface_points(lattice, surface, lattice.spacing_m / m.points_per_spacing),
             lattice.node_count(), lattice.spacing_m) {}

ContactNodes SoftThing::nodes() {
  return {state.x_m.view(), state.v_m_s.view(), mass_kg.const_view(), held.const_view()};
}

BodyMonitors SoftThing::monitors(ExecContext& ctx) const {
  return measure_body(lattice, elements, {&material.elastic, 1}, {}, {.damping_ratio = material.damping},
                      to_host(ctx, state.x_m.const_view()), to_host(ctx, state.v_m_s.const_view()));
}

void SoftThing::launch(ExecContext& ctx, Vec3f v_m_s, Vec3f move_m) {
  std::vector<Vec3f> x = to_host(ctx, state.x_m.const_view());
  for (Vec3f& p : x) p += move_m;
  ctx.upload(x, state.x_m.view());
  const std::vector<Vec3f> v(x.size(), v_m_s);
  ctx.upload(v, state.v_m_s.view());
  ctx.synchronize();
}

SoftThing soft_box(ExecContext& ctx, Vec3f corner_m, Vec3i cubes, float h, const SoftMaterial& material,
                   const std::function<bool(Vec3f)>& fixed) {
  CubeLattice lattice =
      lattice_from_box(corner_m, cubes, {.spacing_m = h, .density_kg_m3 = material.elastic.density_kg_m3});
  if (fixed) lattice.fix_where(fixed);
  const Vec3f half = (0.5F * h) * vec_cast<float>(cubes);
  return {ctx, std::move(lattice), transformed(box(half, 1), {Mat3f::identity(), corner_m + half}), material};
}

SoftThing soft_ball(ExecContext& ctx, float radius_m, float h, const SoftMaterial& material, float density) {
  const TriangleMesh surface = transformed(unit_sphere(16), {}, radius_m);
  CubeLattice lattice = lattice_from_mesh(surface, {.spacing_m = h, .density_kg_m3 = density});
  SoftMaterial m = material;
  m.elastic.density_kg_m3 = density;
  return {ctx, std::move(lattice), surface, m};
}

SoftScene::SoftScene(ExecContext& context, SoftThing& soft, float sample_spacing_m,
                     const ContactSettings& settings)
    : ctx(context),
      body(soft),
      surface(context.device(), roomy(sample_spacing_m)),
      contact(context.device(), settings) {
  // A surface far off, so that there is one.
  show(transformed(unit_sphere(2), {Mat3f::identity(), {1e3F, 0, 0}}, 0.01F));
}

void SoftScene::show(const TriangleMesh& mesh, float dt_s) {
  const DeviceMesh on_device(ctx, mesh);
  surface.update(ctx, on_device.view(), dt_s);
  ctx.synchronize();
}

ContactReport SoftScene::run(int substeps, float dt_s, Vec3f gravity_m_s2, float drag_per_s, bool moving) {
  const float frame_s = dt_s * static_cast<float>(substeps);
  contact.begin_frame(ctx, surface,
                      {.dt_s = dt_s, .substeps = substeps, .dt_frame_s = moving ? frame_s : 0.F});
  body.points.begin_frame(ctx);
  contact.push_out(ctx, surface, body.points, body.nodes());
  for (int k = 0; k < substeps; ++k) {
    body.solver.step(ctx, body.state, {dt_s, gravity_m_s2, drag_per_s});
    contact.correct(ctx, surface, obstacles.view(), body.points, body.nodes(), k);
  }
  body.points.end_frame(ctx);
  return contact_report(to_host(ctx, body.points.totals()), frame_s, substeps);
}

}  // namespace tactus::test
