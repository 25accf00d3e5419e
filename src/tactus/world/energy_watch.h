#pragma once
/// Reports bodies that gain energy that nothing gave them.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// Follows bodies that begin undeformed, and that gravity, fixed nodes and obstacles at rest alone act on.
/// Their kinetic and gravitational energy is then never above that at the start: strain holds the rest. Where
/// something else acts, the strain energy isn't known, and the watch is turned off for good.
class EnergyWatch {
 public:
  static constexpr const char* kRemedy =
      "let 'frame.substeps' be auto, place bodies so that they don't overlap, take more 'damping' or a "
      "smaller "
      "spacing_m";
  struct Body {
    std::string name;
    double mass_kg = 0, spacing_m = 0;
    Vec3d center_m{};
    double kinetic_J = 0;
  };

  /// Off.
  EnergyWatch() = default;
  /// @param bodies at rest
  EnergyWatch(std::vector<Body> bodies, Vec3d gravity_m_s2);

  bool is_on() const { return is_on_; }
  void turn_off() { is_on_ = false; }
  /// Once a frame. @param bodies as the first ones @param step_s the last substep: kinetic energy is that of
  /// its middle
  /// @returns "" or, once, how much they gained, and which of them most
  std::string follow(std::span<const Body> bodies, double step_s);

 private:
  double potential_J(const Body& body) const { return -body.mass_kg * dot(gravity_m_s2_, body.center_m); }

  /// Tolerances: a share of the energy that was turned over so far, and the part of a cube's edge by which
  /// contact may lift a body that lies.
  static constexpr double kShare = 0.02, kLift = 0.1;
  /// Speed that rounding alone gives bodies on which nothing acts.
  static constexpr double kRounding_m_s = 1e-3;

  std::vector<Body> begin_;
  Vec3d gravity_m_s2_{};
  double turned_J_ = 0;  ///< most that was in motion, or that gravity gave
  bool is_on_ = false;
};

}  // namespace tactus
