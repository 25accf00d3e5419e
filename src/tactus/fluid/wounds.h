#pragma once
/// The wounds of a body, from which a liquid flows.
#include <span>
#include <vector>

#include "tactus/compute/buffer.h"
#include "tactus/fluid/wound_kernels.h"
#include "tactus/frame/state_archive.h"
#include "tactus/geom/search/neighbour_search.h"

namespace tactus {

struct WoundSettings {
  float rate_m_s = 0;  ///< volume per time and area: 1 ml / (s cm^2) is 0.01 m/s
  float fading_s = 0;  ///< the rate falls as exp(-t / fading_s); 0: it stays
  Pulse pulse = {};
  float spacing_m = 0;  ///< of the liquid's particles at rest
  Index max_pieces = 0;
};

/// Owns the pieces of wounds and the volumes that they owe, on one device. Between frames: set_pieces when
/// the body was cut. Once before the substeps of a frame: try_places; then solvers that have walls add them
/// to near_walls() of the places in search(), FindBoxWalls first; then bleed. Asynchronous, may be recorded,
/// but for set_pieces.
class Wounds {
 public:
  /// @throws Error naming the setting that is out of range.
  Wounds(ExecContext& ctx, const WoundSettings& settings);

  /// All pieces, in pairs; those that were given before have the same places in the list. Synchronizes.
  /// @throws Error when there are more than max_pieces.
  void set_pieces(ExecContext& ctx, std::span<const WoundPiece> pieces);

  /// Between frames. A recorded frame must be recorded anew. @throws Error unless it is positive.
  void set_rate_m_s(float rate_m_s);
  /// @param x_m, v_m_s of the body's nodes
  void try_places(ExecContext& ctx, View<const FrameParams> frame, View<const Vec3f> x_m,
                  View<const Vec3f> v_m_s);
  const NeighbourSearch& search() const { return search_; }
  NearWalls near_walls() { return {wall_count_.view(), walls_.view()}; }
  /// @param search of the liquid's last step
  void bleed(ExecContext& ctx, View<const FrameParams> frame, const NeighbourSearch& search,
             const LiquidArrivals& liquid);

  /// The volumes that pieces owe and strokes bled; pieces themselves are set before that. Synchronizes.
  /// @throws Error.
  void archive(ExecContext& ctx, StateArchive& a);

  Index max_pieces() const { return pieces_.size(); }
  /// (kStrokes)
  View<const WoundLedger> ledgers() const { return ledgers_.const_view(); }

 private:
  Count count() const { return {count_.const_view(), pieces_.size()}; }

  WoundSettings settings_;
  NeighbourSearch search_;
  Buffer<Index> count_;
  Buffer<WoundPiece> pieces_;
  Buffer<WoundState> states_;
  Buffer<WoundLedger> ledgers_;
  Buffer<Vec3f> place_m_, speed_m_s_;
  Buffer<std::uint32_t> key_;
  Buffer<WoundClock> clock_;
  Buffer<Index> is_shut_;
  Buffer<WoundPlace> open_;
  Buffer<std::uint32_t> open_count_;
  Buffer<Index> slot_, planned_, first_id_, wall_count_;
  Buffer<NearWall> walls_;
  Buffer<LiquidRound> round_;
};

}  // namespace tactus
