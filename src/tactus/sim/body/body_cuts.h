#pragma once
/// The cuts of one body: who follows them, the walls that they made, and the wounds that bleed.
#include <functional>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "tactus/contact/walls/wall_mesh.h"
#include "tactus/fluid/wound_piece.h"
#include "tactus/tissue/cut/body_cutter.h"
#include "tactus/tissue/cut/cut_points.h"
#include "tactus/tissue/cut/cut_wounds.h"

namespace tactus {

class BodySolver;
class EmbeddedSurface;
class ExecContext;
class SlabPoints;
class StateArchive;
struct BodyBoundary;
struct BodyDescription;
struct BodyPoint;
struct BodyShape;
struct BodyStatus;

/// The parts of a body that its cuts read and change. They must outlive its cuts.
struct CutTargets {
  const BodyDescription& description;
  const BodyStatus& status;
  BodyShape& shape;
  BodySolver& tissue;
  EmbeddedSurface& surface;
  SlabPoints& points;
};

/// The surface of a body as a liquid feels it, all of it. Synchronizes.
WallChange all_walls(ExecContext& ctx, const CubeLattice& lattice, const EmbeddedSurface& surface);

class BodyCuts {
 public:
  /// @param boundary of the points that touch; null: none does. Synchronizes.
  BodyCuts(ExecContext& ctx, const CutTargets& targets, const BodyBoundary* boundary);

  /// Called with each change, after the body took it over.
  using Observer = std::function<void(const TopologyChange&, std::span<const PointChange>)>;
  /// Cuts the body by the strip that an edge swept since the last frame, as the body saw it. Called between
  /// two frames. Synchronizes.
  /// @param blade number of the blade
  cut::CutReport cut(ExecContext& ctx, std::size_t blade, const cut::BladeStrip& strip,
                     const Observer& observer = {});
  /// Makes the cuts that found no capacity, now that there is some: a body that grew has the cuts of the one
  /// that was full by archive(). Likewise.
  cut::CutReport go_on(ExecContext& ctx, const Observer& observer = {});
  /// Whether archive() makes the same cuts in a body with more capacity. Not so where something was left out,
  /// for want of it, of cuts that were made.
  bool can_grow() const { return !has_left_out_; }
  /// After all blades cut in a frame.
  void remember_nodes();
  /// Cuts from now on count to this stroke, 0, 1, .. of the body.
  /// @param frame of the simulation
  void begin_stroke(Index stroke, int frame);
  /// Walls that a stroke made, at rest, in lattice coordinates.
  std::span<const std::array<Vec3d, 3>> walls_of(Index stroke) const;
  const cut::BodyCutter& cutter() const { return cutter_; }
  /// The cuts so far; cuts that are read are done once more. Before the body's archive(). Synchronizes.
  /// @param end_frame when all cuts of a frame were done
  /// @throws Error when the archive is another body's.
  void archive(ExecContext& ctx, StateArchive& a, const Observer& observer,
               const std::function<void(int frame)>& end_frame);
  /// A point moves with the copy that has its material now.
  void follow(BodyPoint& point) const;

  /// Changes of the surface that a liquid feels, by cuts since the last call.
  WallChange take_wall_change();
  void forget_wall_change() { wall_changes_ = {}; }
  /// From now on, walls of cuts are wounds of a liquid, if the body bleeds. @param spacing_m of its particles
  /// @returns the components that there will be at most; 0: it doesn't bleed
  Index keep_wounds(float spacing_m);
  std::vector<WoundPiece> wound_pieces() const;
  /// Some found no capacity.
  bool wounds_are_full() const { return wounds_.is_full(); }
  /// Vertices of the seen surface that a cut left without triangles, and the nearest ones at rest that have
  /// some. @param wanted per vertex: 1 for those to look at
  struct VertexHeir {
    Index from = 0, to = 0;
  };
  std::vector<VertexHeir> heirs(std::span<const std::uint8_t> wanted) const;
  /// The body's parts, copies in use, and the volumes that its surface encloses.
  struct State {
    int parts = 1;
    Index copies = 0;
    std::vector<double> closed_volumes_m3;
  };
  /// Synchronizes.
  State state(ExecContext& ctx) const;

 private:
  bool is_far(const cut::BladeStrip& strip) const;
  /// Which stroke, in which frame, made each journal of the cutter.
  struct JournalOrigin {
    Index stroke = 0;
    std::int32_t frame = 0;
    Index is_refused = 0;  ///< there was no capacity: the next one makes its cuts, too
  };
  void archive_trails(StateArchive& a);
  void archive_nodes(StateArchive& a);
  void do_again(ExecContext& ctx, const cut::LatticeCutter::Journal& journal, const JournalOrigin& origin,
                const Observer& observer);
  cut::CutReport take_over(ExecContext& ctx, cut::CutReport report, const Observer& observer);
  void follow(ExecContext& ctx, const TopologyChange& change, const Observer& observer);

  CutTargets body_;
  cut::BodyCutter cutter_;
  TopologyChange change_;  ///< by the last strip; its lists keep their capacity
  cut::CutPoints points_;
  cut::CutWounds wounds_;
  Index stroke_ = 0;
  int frame_ = 0;
  std::vector<std::vector<std::array<Vec3d, 3>>> stroke_walls_;  ///< per stroke
  std::vector<JournalOrigin> journal_origins_;
  bool has_left_out_ = false;
  float wound_spacing_m_ = 0;  ///< 0: no wounds are kept
  /// Ids that cuts changed since take_wall_change().
  struct WallChangeIds {
    std::set<Index> vertices, cubes, triangles;
  };
  WallChangeIds wall_changes_;
  std::vector<Vec3f> x_m_;       ///< of nodes, while blades cut; empty: none is near
  std::vector<Vec3f> last_x_m_;  ///< in the frame before; empty: none was
  std::map<std::size_t, cut::BladeTrail> trails_;
};

}  // namespace tactus
