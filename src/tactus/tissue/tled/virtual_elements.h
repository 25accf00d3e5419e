#pragma once
/// The virtual elements of a body: copies of cubes that were cut, beside the dense tiles.
#include <array>
#include <span>

#include "tactus/compute/exec_context.h"
#include "tactus/frame/state_archive.h"
#include "tactus/tissue/embedding.h"
#include "tactus/tissue/tled/summed_forces.h"
#include "tactus/tissue/tled/tled_data.h"

namespace tactus::tled {

struct MoveNodes;

/// Field by field, as `fields` lie behind one another: what reads them may have longer ones. Synchronizes.
void archive_fields(ExecContext& ctx, StateArchive& a, const char* name, View<float> fields, Index count);

/// Copies and their virtual nodes, on one device. Tled gives virtual nodes the cells behind its box, so
/// kernels that load and store nodes need no second path. A substep sums the copies' forces node by node:
/// either nodes of the tiles get them as external acceleration and virtual nodes move (move), or what moves
/// nodes asks for all forces of each (forces), or all are stored (add_to).
///
/// There is capacity for so many copies and virtual nodes. The copies in use may change between frames: write
/// them to copies() and stiffness(), then rebuild(). A recorded frame stays valid.
class VirtualElements {
 public:
  VirtualElements() = default;
  /// @param cell per node: where Tled keeps it
  /// @param own nodes that move on this device @param used nodes up to the last one that is in use
  /// @param history_fields of relaxing cubes; 0: none
  VirtualElements(ExecContext& ctx, std::span<const embed::CubeNodes> copies,
                  std::span<const Stiffness> stiffness, View<const Index> cell, const OwnNodes& own,
                  Index used, Index first_virtual_cell, Index history_fields);

  /// Copies that there is capacity for.
  Index capacity() const { return copies_.size(); }
  bool has_capacity() const { return capacity() > 0; }
  /// Nodes up to the last one that was ever in use: there are fewer than there is capacity for.
  Count nodes_in_use() const { return {used_on_device_.const_view().part(2, 1), cell_.size()}; }
  View<embed::CubeNodes> copies() { return copies_.view(); }
  View<Stiffness> stiffness() { return stiffness_.view(); }
  View<const Stiffness> stiffness() const { return stiffness_.const_view(); }
  View<const CopyCells> corners() const { return corners_.const_view(); }
  /// Stresses that relax, before and after substep k.
  View<float> history() { return history_Pa_[0].view(); }  ///< between frames
  void archive(ExecContext& ctx, StateArchive& a, Index history_fields) {
    archive_fields(ctx, a, "stresses that relax of copies", history(), history_fields);
  }
  View<const float> history_before(int k) const { return history_Pa_[at(k)].const_view(); }
  View<float> history_after(int k) { return history_Pa_[at(k + 1)].view(); }

  /// Sorts the corners of copies by node. Asynchronous, allocates nothing. @param copies_end, nodes_end no
  /// copy or node from there on is new
  void rebuild(ExecContext& ctx, Index copies_end, Index nodes_end);
  /// Keeps the external accelerations that load() of the tiles found.
  void load(ExecContext& ctx, View<const float> external_m_s2, Index cells);
  /// Forces of the copies for these positions. (tled.cpp has it: it knows the laws of cubes.)
  template <class Cube>
  void find_forces(ExecContext& ctx, const Cube& cube, View<const float> x_m, Index cells);
  void move(ExecContext& ctx, const MoveNodes& nodes, View<float> external_m_s2);
  /// Of nodes, for those of the tiles, three fields over cells.
  SummedForces forces(View<const float> of_tiles_N, Index cells) const;
  void add_to(ExecContext& ctx, View<float> f_N, Index cells);
  /// How strained the copies are. @param first_cube number of the first copy
  /// @param out one per 256 copies
  void find_extremes(ExecContext& ctx, View<const float> x_m, Index cells, Index first_cube,
                     float gradient_per_m, View<CubeExtremes> out);
  /// As Tled's.
  void keep_history(ExecContext& ctx, const MoveCount& moves);

 private:
  static std::size_t at(int k) { return static_cast<std::size_t>(k % 2); }
  CornersOfNodes by_node() const;
  /// Nodes that copies have.
  Count nodes() const { return {node_count_.const_view(), first_.size()}; }

  void use(Index copies, Index nodes);
  void sort_corners(ExecContext& ctx, Index copies);

  OwnNodes own_;
  std::array<Index, 3>
      used_{};  ///< up to the last one that was ever in use: copies, blocks of CopyForces, nodes
  Buffer<Index> used_on_device_;
  Index first_virtual_cell_ = 0;
  Buffer<Index> cell_;  ///< per node
  Buffer<embed::CubeNodes> copies_;
  Buffer<Stiffness> stiffness_;
  Buffer<CopyCells> corners_;
  Buffer<Vec3f> f_N_, outer_m_s2_;
  Buffer<std::uint32_t> node_, node_scratch_;  ///< per corner
  Buffer<Index> corner_, corner_scratch_, first_, node_count_;
  Buffer<Index> first_of_node_;
  std::array<Buffer<float>, 2> history_Pa_;
};

}  // namespace tactus::tled
