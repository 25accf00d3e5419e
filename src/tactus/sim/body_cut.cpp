#include "tactus/sim/body_cut.h"

#include <algorithm>

#include "tactus/geom/lattice_cut.h"
#include "tactus/sim/soft_body.h"

namespace tactus {
namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

}  // namespace

BodyShape with_cut_room(const BodyDescription& body, BodyShape shape) {
  if (!body.cuttable) return shape;
  const Index copies = body.cut_room.value_or(std::max(2000, shape.lattice.cube_count() / 4));
  shape.lattice =
      cut_lattice(shape.lattice, [](Vec3i, int) { return false; }, {.copies = copies, .nodes = 2 * copies});
  // Room is made of elements: only those are cut.
  shape.elements.resize(shape.lattice.cubes.size(), 1);
  shape.material_of_cube.resize(shape.lattice.cubes.size(), 0);
  shape.node_outside_m.resize(shape.lattice.nodes.size(), 0);
  return shape;
}

/// Walls of interior copies have a dozen triangles, those at the surface some more.
SurfaceRoom surface_room(const CubeLattice& lattice, const TriangleMesh& surface) {
  const auto copies = static_cast<Index>(lattice.copies.size());
  return {static_cast<Index>(surface.positions_m.size()) + 40 * copies,
          static_cast<Index>(surface.triangles.size()) + 80 * copies};
}

void SoftBody::make_cuttable(ExecContext& ctx) {
  const CubeLattice& lattice = shape_.lattice;
  std::vector<std::uint8_t> is_driven(lattice.nodes.size()), may_cut;
  for (const NodeMotion& motion : shape_.motions)
    for (const Index node : motion.nodes) is_driven[at(node)] = 1;
  for (std::size_t k = 0; k < shape_.loads.size(); ++k)
    for (const Index node : tissue_.boundary().loads().nodes_of(k)) is_driven[at(node)] = 1;
  for (Index c = 0; c < lattice.regular_cubes(); ++c) {
    const auto& nodes = lattice.cube_nodes[at(c)];
    const bool driven =
        std::any_of(nodes.begin(), nodes.end(), [&](Index i) { return is_driven[at(i)] != 0; });
    may_cut.push_back(shape_.elements[at(c)] != 0 && !driven ? 1 : 0);
  }
  const SurfaceRoom room = surface_room(lattice, shape_.surface_m);
  cutter_.emplace(lattice, std::move(may_cut), shape_.surface_m, to_host(ctx, surface_.anchors()),
                  cut::CutSurface::Room{room.vertices, room.triangles});
  last_x_m_ = lattice.rest_positions_m();
}

cut::CutReport SoftBody::cut(ExecContext& ctx, cut::BladeStrip strip) {
  const std::vector<Vec3f> x_m = positions_m(ctx);
  for (Vec3f& p : strip.begin_m) {
    float least_m2 = sqr(2 * shape_.lattice.spacing_m);
    Vec3f moved_m{};
    for (std::size_t i = 0; i < x_m.size(); ++i) {
      const Vec3f d = last_x_m_[i] - p;
      if (dot(d, d) >= least_m2 || shape_.lattice.node_mass_kg[i] == 0) continue;
      least_m2 = dot(d, d);
      moved_m = x_m[i] - last_x_m_[i];
    }
    p += moved_m;
  }
  TopologyChange change;
  const cut::CutReport report = cutter_->cut(strip, x_m, change);
  if (change.copies.empty()) return report;
  tissue_.apply(change);
  surface_.apply(ctx, change);
  surface_.update(ctx, tissue_.body());
  tactus::apply(change, shape_.lattice);
  for (const TopologyChange::Copy& copy : change.copies)
    shape_.material_of_cube[at(copy.cube)] = shape_.material_of_cube[at(copy.copy.of)];
  return report;
}

void SoftBody::follow_cut(BodyPoint& point) const {
  const Index regular = cutter_->lattice().regular_of(point.cube);
  const Vec3d p = vec_cast<double>(shape_.lattice.cubes[at(regular)]) + vec_cast<double>(point.local);
  point.cube = cutter_->surface().leaf(regular, p);
  point.nodes = shape_.lattice.cube_nodes[at(point.cube)];
}

SoftBody::CutState SoftBody::cut_state(ExecContext& ctx) const {
  return {cutter_->lattice().part_count(), cutter_->lattice().copies_in_use(),
          cutter_->closed_volumes_m3(positions_m(ctx))};
}

}  // namespace tactus
