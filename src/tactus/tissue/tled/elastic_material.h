#pragma once
/// What tissue is made of, as users say it.
#include <cstdint>
#include <string>

#include "tactus/base/vec.h"

namespace tactus {

enum class MaterialLaw : std::uint8_t { neo_hookean, isochoric_neo_hookean, transversely_isotropic };

struct ElasticMaterial {
  float young_Pa = 3000;  ///< > 0
  float poisson = 0.45F;  ///< -1 < nu < 0.5
  float density_kg_m3 = 1000;

  float mu_Pa() const { return young_Pa / (2 * (1 + poisson)); }
  float lambda_Pa() const { return young_Pa * poisson / ((1 + poisson) * (1 - 2 * poisson)); }
};

/// @throws Error naming the field and its value for what is out of range.
void check_material(const ElasticMaterial& material);

}  // namespace tactus
