#include "tactus/tissue/tled/strain_energy.h"

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

double trace_C(const Mat3d& F) {
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum += F(i, j) * F(i, j);
  return sum;
}

/// ln J, continued by its tangent below the smallest J that stresses see.
double log_volume(double J) {
  const double smallest = static_cast<double>(kSmallestJ);
  return J >= smallest ? std::log(J) : std::log(smallest) + (J - smallest) / smallest;
}

double neo_hookean(double mu, double lambda, const Mat3d& F) {
  const double J = determinant(F);
  return mu / 2 * (trace_C(F) - 3) - mu * log_volume(J) + lambda / 2 * (J - 1) * (J - 1);
}

}  // namespace

double strain_energy_J_m3(const TledOptions& options, const ElasticMaterial& material, const Mat3d& F) {
  const auto mu = static_cast<double>(material.mu_Pa()), lambda = static_cast<double>(material.lambda_Pa());
  switch (options.law) {
    case MaterialLaw::neo_hookean:
      return neo_hookean(mu, lambda, F);
    case MaterialLaw::isochoric_neo_hookean: {
      const double J = determinant(F), safe = std::max(J, static_cast<double>(kSmallestJ));
      return mu / 2 * (trace_C(F) / std::pow(safe, 2.0 / 3) - 3) +
             (lambda + 2 * mu / 3) / 2 * (J - 1) * (J - 1);
    }
    case MaterialLaw::transversely_isotropic: {
      const Vec3d a = vec_cast<double>(normalized(options.fibre, Vec3f{1, 0, 0})), Fa = F * a;
      const double stretch = std::max(dot(Fa, Fa) - 1, 0.0);
      return neo_hookean(mu, lambda, F) +
             static_cast<double>(options.fibre_ratio) * mu / 2 * stretch * stretch;
    }
  }
  return 0;
}

}  // namespace tactus
