#pragma once
/// Dynamic relaxation of one body by kinetic damping (Cundall 1976; Barnes 1999).
#include <optional>

namespace tactus {

/// A body swings without friction through its rest. Where its kinetic energy peaks it is nearest to it: all
/// of it is stopped there and starts again. Each stop takes the energy of the slowest and largest swing, so
/// no damping has to be chosen. After a stop, the momentum that its nodes gain per time is the force that is
/// left.
///
///   KineticDamping damping;
///   per piece of dt: if (auto back = damping.after_piece(kinetic_J)) stop(x - *back * dt * v, v = 0);
class KineticDamping {
 public:
  /// @returns by how many pieces the peak is over, if one is.
  std::optional<double> after_piece(double kinetic_J) {
    const double two_before = before_, before = last_;
    before_ = last_, last_ = kinetic_J;
    ++pieces_;
    if (!(kinetic_J < before)) return std::nullopt;
    // The peak of the parabola through the last three: 0.5 to 1.5 pieces ago.
    const double bend = two_before - 2 * before + kinetic_J;
    const double after_middle = bend < 0 ? 0.5 * (two_before - kinetic_J) / bend : 0;
    pieces_of_swing_ = pieces_;
    before_ = last_ = 0;
    pieces_ = 0;
    return 1 - after_middle;
  }
  /// The piece that ended was the first since a stop.
  bool just_started() const { return pieces_ == 1; }
  /// From the last stop but one to the last: a quarter of a swing; 0: there was none.
  int pieces_of_swing() const { return pieces_of_swing_; }
  int pieces_since_stop() const { return pieces_; }

 private:
  double before_ = 0, last_ = 0;
  int pieces_ = 0, pieces_of_swing_ = 0;
};

}  // namespace tactus
