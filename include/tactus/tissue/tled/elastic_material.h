#pragma once
/// Materials of tissue, in the users' parameters.
#include <array>
#include <cstdint>
#include <string>

#include "tactus/base/vec.h"

namespace tactus {

/// All laws: the word in scene files, and the struct in material_laws.h. A row here is all that a new law
/// needs besides its struct (docs/new_material.md).
#define TACTUS_MATERIAL_LAWS(ROW)                 \
  ROW(neo_hookean, NeoHookean)                    \
  ROW(isochoric_neo_hookean, IsochoricNeoHookean) \
  ROW(transversely_isotropic, TransverselyIsotropic)

enum class MaterialLaw : std::uint8_t {
#define TACTUS_ROW(word, Law) word,
  TACTUS_MATERIAL_LAWS(TACTUS_ROW)
#undef TACTUS_ROW
};

/// A part of the shear modulus that fades after a step of strain, as exp(-t / time).
struct RelaxationTerm {
  float share = 0;        ///< of mu, 0..1, all terms together below 1; 0: no such term
  float time_s = 1;       ///< > 0; up to 1e4 substeps, or rounding stops it early
  bool is_added = false;  ///< it comes on top of mu, which is all that lasts: the share may be above 1
};

/// How cubes resist.
struct TledOptions {
  MaterialLaw law = MaterialLaw::neo_hookean;
  Vec3f fibre{1, 0, 0};           ///< transversely isotropic: direction at rest
  float fibre_ratio = 0;          ///< transversely isotropic: fibre stiffness over mu
  bool full_integration = false;  ///< 2x2x2 points instead of one and hourglass control; locks in bending
  /// Part of critical damping of the fastest mode, 0..0.7, by viscous elements: rigid motion is not damped.
  float damping_ratio = 0.05F;
  /// Viscoelastic: mu(t) = mu (1 - sum share (1 - exp(-t / time))), a Prony series (Taylor et al. 2009);
  /// lambda stays. Materials give the instantaneous stiffness.
  std::array<RelaxationTerm, 2> relaxation{};
  float faded_share() const { return share_of(false); }
  float added_share() const { return share_of(true); }
  int relaxing_terms() const { return relaxation[1].share > 0 ? 2 : relaxation[0].share > 0 ? 1 : 0; }

 private:
  float share_of(bool added) const {
    float sum = 0;
    for (const RelaxationTerm& term : relaxation) sum += term.is_added == added ? term.share : 0;
    return sum;
  }
};

struct ElasticMaterial {
  float young_Pa = 3000;  ///< > 0
  float poisson = 0.45F;  ///< -1 < nu < 0.5
  float density_kg_m3 = 1000;

  float mu_Pa() const { return young_Pa / (2 * (1 + poisson)); }
  float lambda_Pa() const { return young_Pa * poisson / ((1 + poisson) * (1 - 2 * poisson)); }
};

/// @throws Error naming a field that is out of range, and its value.
void check_material(const ElasticMaterial& material);

}  // namespace tactus
