#include "tactus/sim/body/body_measures.h"

#include "tactus/sim/body/body_shape.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {

BodyMonitors BodyMeasures::monitors(ExecContext& ctx, double step_s) const {
  return measure_body(shape_.lattice, shape_.elements, shape_.materials, shape_.material_of_cube, elements_,
                      to_host(ctx, tissue_.body().x_m.const_view()),
                      to_host(ctx, tissue_.body().v_m_s.const_view()), step_s);
}

std::vector<CubeStrain> BodyMeasures::strains(ExecContext& ctx) const {
  return cube_strains(shape_.lattice, shape_.elements, shape_.materials, shape_.material_of_cube, elements_,
                      to_host(ctx, tissue_.body().x_m.const_view()));
}

std::vector<CubeStrain> BodyMeasures::strains(std::span<const Vec3f> x_m,
                                              std::span<const Index> cubes) const {
  return cube_strains(shape_.lattice, shape_.elements, shape_.materials, shape_.material_of_cube, elements_,
                      x_m, cubes);
}

}  // namespace tactus
