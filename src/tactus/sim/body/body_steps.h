#pragma once
/// Limits of a body's substeps, and the speeds that set them.
#include "tactus/sim/body/body_status.h"

namespace tactus {

class BodyPlaces;
class BodySolver;
struct BodyDescription;
struct BodyShape;

/// The body must outlive it.
class BodySteps {
 public:
  BodySteps(const BodyDescription& description, const BodyShape& shape, const BodySolver& tissue,
            const BodyStatus& status, const BodyPlaces& places)
      : description_(description), shape_(shape), tissue_(tissue), status_(status), places_(places) {}
  /// Substeps for which the body is stable as strained as it was at the end of the last part of a frame.
  int substeps_for(float dt_s) const;
  /// Substeps of a frame are a multiple of this.
  int matching_every() const;
  /// Diverged nodes are looked for after so many substeps: nothing looks into the frame of a body on which
  /// nothing acts.
  int check_every(int substeps) const;
  /// Neither contact nor a motion nor a load.
  bool nothing_acts() const;
  /// Speed of the fastest among its elements and the things that act on it, in the time of its motions given
  /// [m/s]; 0 for a body on which nothing acts. Shape matching is as stable, however it is strained.
  double fastest_near_m_s(double surface_m_s, double from_s, double to_s) const;
  /// Speed of the fastest strain wave in its material [m/s].
  double wave_m_s() const;
  /// @throws Error when the elements are not stable in so many substeps, or shape matching, at its rate,
  /// would be softer than its material; warns, once, when so few make shape matching softer than its
  /// material, or when a frame takes more than `most_of_frame`.
  void check(float dt_frame_s, int substeps, int most_of_frame);

 private:
  void warn_of_many_substeps(float dt_s, int substeps, int most);

  const BodyDescription& description_;
  const BodyShape& shape_;
  const BodySolver& tissue_;
  const BodyStatus& status_;
  const BodyPlaces& places_;
  bool warned_of_softness_ = false, warned_of_substeps_ = false;
};

}  // namespace tactus
