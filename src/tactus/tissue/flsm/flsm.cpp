#include "tactus/tissue/flsm/flsm.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tactus/base/error.h"
#include "tactus/tissue/flsm/flsm_kernels.h"
#include "tactus/tissue/flsm/near_kernels.h"

namespace tactus {
namespace {

void check_range(const char* what, float value, float low, float high) {
  if (value >= low && value <= high) return;
  throw Error(std::string(what) + " is " + std::to_string(value) + ", not within " + std::to_string(low) +
              " to " + std::to_string(high));
}

template <class T>
Buffer<T> zeros(ExecContext& ctx, std::int64_t count) {
  Buffer<T> buffer(ctx.device(), count);
  ctx.fill_bytes(buffer.view(), 0);
  return buffer;
}

}  // namespace

Flsm::Flsm(ExecContext& ctx, const CubeLattice& lattice, const FlsmMaterial& material)
    : Flsm(ctx, lattice, make_flsm_regions(lattice, material.half_width), material) {}

Flsm::Flsm(ExecContext& ctx, const CubeLattice& lattice, const FlsmRegions& r, const FlsmMaterial& material)
    : material_(material), spacing_m_(lattice.spacing_m) {
  check_range("Young's modulus [Pa]", material.young_Pa, 1e-3F, 1e12F);
  check_range("density [kg/m^3]", material.density_kg_m3, 1e-3F, 1e6F);
  check_range("damping ratio", material.damping_ratio, 0, 0.7F);
  check_range("stiffness scale", material.stiffness_scale, 0.1F, 10);
  grid_ = r.grid;
  sigma2_ = r.sigma2_m2;
  scale_stiffness(1);
  if (material.damping_time_s > 0)
    material_.damping_ratio = std::clamp(0.5F * material.damping_time_s * omega_, 0.1F, 0.7F);
  moves_ = std::any_of(lattice.fixed.begin(), lattice.fixed.end(), [](HeldAxes f) { return f != kAllAxes; });
  cell_ = to_device(ctx, r.cell);
  fixed_ = to_device(ctx, std::vector<Index>(lattice.fixed.begin(), lattice.fixed.end()));
  shared_mass_kg_ = to_device(ctx, r.shared_mass_kg);
  mass_kg_ = to_device(ctx, lattice.node_mass_kg);
  std::vector<double> inverse_weight(r.weight_sum.size());
  std::transform(r.weight_sum.begin(), r.weight_sum.end(), inverse_weight.begin(),
                 [](double sum) { return 1 / sum; });
  inverse_weight_ = to_device(ctx, inverse_weight);
  held_ = to_device(ctx, r.held);
  turn_m_ = to_device(ctx, r.turn_m);
  inverse_mass_ = to_device(ctx, r.inverse_mass_per_kg);
  center_ = to_device(ctx, r.center);
  std::vector<float> identity(static_cast<std::size_t>(4 * grid_.cells));
  std::fill_n(identity.begin(), grid_.cells, 1.F);
  quaternion_ = to_device(ctx, identity);
  exceptions_ = to_device(ctx, r.exceptions);
  offsets_ = to_device(ctx, r.offsets);
  node_rows_ = to_device(ctx, r.node_rows);
  x_rows_ = to_device(ctx, r.x_rows);
  y_blocks_ = to_device(ctx, r.y_blocks);
  z_blocks_ = to_device(ctx, r.z_blocks);
  goal_z_blocks_ = to_device(ctx, r.goal_z_blocks);
  goal_y_blocks_ = to_device(ctx, r.goal_y_blocks);
  const std::int64_t cells = grid_.cells;
  loaded_ = zeros<double>(ctx, 3 * cells);
  sums_z_ = zeros<double>(ctx, 12 * cells);
  translation_ = zeros<double>(ctx, 3 * cells);
  goal_sum_ = zeros<double>(ctx, 3 * cells);
  rotation_ = zeros<float>(ctx, 9 * cells);
  if (material.half_width == 1) return;  // no sums in between
  sums_x_ = zeros<double>(ctx, 6 * cells);
  sums_y_ = zeros<double>(ctx, 9 * cells);
  goals_z_ = zeros<double>(ctx, 3 * cells);
  goals_y_ = zeros<double>(ctx, 3 * cells);
  turns_z_ = zeros<float>(ctx, 6 * cells);
  turns_y_ = zeros<float>(ctx, 3 * cells);
}

void Flsm::scale_stiffness(float scale) {
  check_range("stiffness scale", scale, 0.99e-6F, 1.01e6F);
  scale_ = scale;
  omega_ =
      static_cast<float>(std::sqrt(double{scale} * double{material_.stiffness_scale} *
                                   double{material_.young_Pa} / (double{material_.density_kg_m3} * sigma2_)));
}

float Flsm::effective_young_Pa(float dt_s) const {
  return scale_ * material_.young_Pa / std::max(1.F, sqr(omega_ * dt_s));
}

int Flsm::substeps_for(float dt_frame_s) const {
  check_range("frame time [s]", dt_frame_s, 1e-7F, 10.F);
  return std::max(1, static_cast<int>(std::ceil(omega_ * dt_frame_s)));
}

void Flsm::slide_sums(ExecContext& ctx) {
  const Index n = grid_.cells;
  const int w = material_.half_width;
  ctx.parallel_for("flsm/sum_x", 3 * x_rows_.size(),
                   flsm::RowSums{x_rows_.const_view(), loaded_.const_view(), sums_x_.view(), n, w});
  ctx.parallel_for(
      "flsm/sum_y", 6 * y_blocks_.size(),
      flsm::SlideSums{y_blocks_.const_view(), sums_x_.const_view(), sums_y_.view(), n, grid_.stride_y, w, 6});
  ctx.parallel_for(
      "flsm/sum_z", 9 * z_blocks_.size(),
      flsm::SlideSums{z_blocks_.const_view(), sums_y_.const_view(), sums_z_.view(), n, grid_.stride_z, w, 9});
}

void Flsm::sum_over_regions(ExecContext& ctx) {
  if (material_.half_width == 1)
    ctx.parallel_for("flsm/sum", 3 * node_rows_.size(),
                     flsm::NearSums{node_rows_.const_view(), loaded_.const_view(), sums_z_.view(),
                                    grid_.cells, grid_.stride_y, grid_.stride_z});
  else
    slide_sums(ctx);
  ctx.parallel_for("flsm/correct_sums", 3 * exceptions_.size(),
                   flsm::CorrectSums{exceptions_.const_view(), offsets_.const_view(), loaded_.const_view(),
                                     sums_z_.view(), grid_.cells, grid_.stride_y, grid_.stride_z});
}

void Flsm::slide_goals(ExecContext& ctx) {
  const Index n = grid_.cells;
  const int w = material_.half_width;
  ctx.parallel_for(
      "flsm/goal_z", 9 * goal_z_blocks_.size(),
      flsm::SlideGoals{goal_z_blocks_.const_view(), translation_.const_view(), rotation_.const_view(),
                       goals_z_.view(), turns_z_.view(), n, grid_.stride_z, w, 3});
  ctx.parallel_for("flsm/goal_y", 6 * goal_y_blocks_.size(),
                   flsm::SlideGoals{goal_y_blocks_.const_view(), goals_z_.const_view(), turns_z_.const_view(),
                                    goals_y_.view(), turns_y_.view(), n, grid_.stride_y, w, 2});
  ctx.parallel_for("flsm/goal_x", 3 * node_rows_.size(),
                   flsm::RowGoals{node_rows_.const_view(), goals_y_.const_view(), turns_y_.const_view(),
                                  goal_sum_.view(), n, w});
}

void Flsm::sum_goals(ExecContext& ctx) {
  if (material_.half_width == 1)
    ctx.parallel_for(
        "flsm/goal", 3 * node_rows_.size(),
        flsm::NearGoals{node_rows_.const_view(), translation_.const_view(), rotation_.const_view(),
                        goal_sum_.view(), grid_.cells, grid_.stride_y, grid_.stride_z});
  else
    slide_goals(ctx);
  ctx.parallel_for("flsm/correct_goals", 3 * exceptions_.size(),
                   flsm::CorrectGoals{exceptions_.const_view(), offsets_.const_view(),
                                      translation_.const_view(), rotation_.const_view(), goal_sum_.view(),
                                      grid_.cells, grid_.stride_y, grid_.stride_z});
}

void Flsm::compute_goals(ExecContext& ctx, const BodyState& state, const FlsmStep& step,
                         View<const Index> nodes) {
  if (!moves_) return;
  ctx.parallel_for(
      "flsm/load", node_count(),
      flsm::LoadNodes{state.x_m.const_view(), state.v_m_s.const_view(), nodes, shared_mass_kg_.const_view(),
                      cell_.const_view(), loaded_.view(), grid_.cells, step.time(), pace(step)});
  sum_over_regions(ctx);
  ctx.parallel_for(
      "flsm/fit", node_rows_.size(),
      flsm::FitRegions{node_rows_.const_view(), sums_z_.const_view(), inverse_mass_.const_view(),
                       turn_m_.const_view(), center_.const_view(), quaternion_.view(), rotation_.view(),
                       translation_.view(), grid_.cells, 1 / double{spacing_m_}, step.rotation_iterations});
  sum_goals(ctx);
}

void Flsm::step(ExecContext& ctx, BodyState& state, const FlsmStep& step) {
  check_range("substep [s]", step.dt_s, 1e-8F, 1.F);
  check_range("drag [1/s]", step.drag_per_s, 0, 1e6F);
  check_range("rotation iterations", static_cast<float>(step.rotation_iterations), 1, 100);
  if (state.x_m.size() != node_count())
    throw Error("body state has " + std::to_string(state.x_m.size()) + " nodes, the model " +
                std::to_string(node_count()));
  compute_goals(ctx, state, step);
  ctx.parallel_for("flsm/integrate", node_count(),
                   flsm::Integrate{state.x_m.view(), state.v_m_s.view(), state.f_ext_N.const_view(),
                                   goal_sum_.const_view(), cell_.const_view(), inverse_weight_.const_view(),
                                   held_.const_view(), mass_kg_.const_view(), fixed_.const_view(),
                                   grid_.cells, step.time(), pace(step), step.drag_per_s});
}

std::vector<Vec3d> Flsm::goals_m(ExecContext& ctx) const {
  const std::vector<double> sum = to_host(ctx, goal_sum_.const_view());
  const std::vector<Index> cell = to_host(ctx, cell_.const_view());
  const std::vector<double> inverse = to_host(ctx, inverse_weight_.const_view());
  std::vector<Vec3d> goals(cell.size());
  for (std::size_t i = 0; i < cell.size(); ++i) {
    for (int a = 0; a < 3; ++a) {
      const std::int64_t field = std::int64_t{a} * grid_.cells + cell[i];
      goals[i][a] = sum[static_cast<std::size_t>(field)] * inverse[i];
    }
  }
  return goals;
}

}  // namespace tactus
