#pragma once
/// The strain energies that the material laws derive from, in double on the host: for monitors and tests.
#include "tactus/tissue/tled/elastic_material.h"
#include "tactus/tissue/tled/tled.h"

namespace tactus {

/// W(F) [J/m^3] of the law that the options name.
double strain_energy_J_m3(const TledOptions& options, const ElasticMaterial& material, const Mat3d& F);

}  // namespace tactus
