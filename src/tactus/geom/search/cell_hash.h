#pragma once
/// Cells of unbounded space, and their numbers in a table of limited size.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// How cells are numbered: along rows of x, or in bricks of 4x4x4 in Z-order (Goswami et al. 2010 number all
/// of space so).
enum class CellIds : Index { linear, morton };

/// A number is x + P y + Q z modulo the size of the table, a power of two: cells with one number form a
/// lattice. P and Q are chosen so that no lattice vector fits into a small box of any shape, so a drop, a
/// thin sheet and a column all spread over the table without sharing. Cells along x follow one another.
///
/// Where cells share a number, the particles of all of them are visited; the test of distances drops those
/// that are far.
struct CellHash {
  static constexpr std::uint32_t kRowStep = 14355429, kLayerStep = 9650833;  // P, Q
  static constexpr int kBrickBits = 2;   ///< of Morton numbers: a brick is 4x4x4 cells
  static constexpr int kLeastBits = 12;  ///< below, cells side by side could share one

  float inverse_cell_1_m = 1;
  CellIds ids = CellIds::linear;

  /// Size of the table for so many particles, a power of two: at about eight particles in a cell, one number
  /// in six to twelve is taken.
  TACTUS_HD static constexpr Index table_size(Index particles) {
    Index size = Index(1) << kLeastBits;
    while (size < particles - particles / 4) size *= 2;
    return size;
  }
  /// False for NaN, infinity, and points too far away for integer cells.
  TACTUS_HD bool holds(Vec3f p_m) const {
    const float limit = 1e9F;
    return tactus::abs(p_m.x * inverse_cell_1_m) < limit && tactus::abs(p_m.y * inverse_cell_1_m) < limit &&
           tactus::abs(p_m.z * inverse_cell_1_m) < limit;
  }
  /// Cell of a point that is held.
  TACTUS_HD Vec3i cell(Vec3f p_m) const {
    return {floor_to_int(p_m.x * inverse_cell_1_m), floor_to_int(p_m.y * inverse_cell_1_m),
            floor_to_int(p_m.z * inverse_cell_1_m)};
  }
  /// Number of a cell in a table of that size.
  TACTUS_HD std::uint32_t number(Vec3i c, Index table_size) const {
    const auto size = static_cast<std::uint32_t>(table_size);
    if (ids == CellIds::linear) return mix(c) & (size - 1);
    const Vec3i brick{c.x >> kBrickBits, c.y >> kBrickBits, c.z >> kBrickBits};
    return ((mix(brick) << (3 * kBrickBits)) & (size - 1)) | z_order(c);
  }

 private:
  TACTUS_HD static std::uint32_t mix(Vec3i c) {
    return static_cast<std::uint32_t>(c.x) + kRowStep * static_cast<std::uint32_t>(c.y) +
           kLayerStep * static_cast<std::uint32_t>(c.z);
  }
  /// Within a brick.
  TACTUS_HD static std::uint32_t z_order(Vec3i c) {
    const auto spread = [](Index i) {
      const auto bits = static_cast<std::uint32_t>(i) & 3U;
      return (bits | bits << 2) & 9U;
    };
    return spread(c.x) | spread(c.y) << 1 | spread(c.z) << 2;
  }
};

}  // namespace tactus
