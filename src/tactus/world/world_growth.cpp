// Bodies whose capacity for cuts grows between two strips of blades.
#include <algorithm>
#include <utility>

#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/body_pull.h"
#include "tactus/world/world_impl.h"

namespace tactus {

/// The body is made anew, its cuts are done once more, and then it gets its state: ids of nodes and copies
/// don't change, so it is the body that had this capacity from the start. Contact of bodies and the walls of
/// a liquid know the places of all cuttable bodies, so these are made anew with it, too.
bool World::Impl::grow(std::size_t number, bool in_frame) {
  if (!bodies_[number]->may_grow()) return false;
  devices_.synchronize();
  StateArchive written;
  const std::size_t goes_on = in_frame ? number : bodies_.size();
  archive_cut_bodies(written, goes_on);
  const std::optional<Grab> grab = std::exchange(grab_, std::nullopt);
  std::vector<Index> capacities = cut_capacities();
  capacities[number] *= 2;
  rebuild(capacities);
  StateArchive read = StateArchive::for_larger(std::move(written));
  archive_cut_bodies(read, goes_on);
  read.finish();
  grab_ = grab;
  for (const auto& body : bodies_) body->spring().set_active(grab_.has_value());
  devices_.synchronize();
  return true;
}

/// For all bodies; 0: not cuttable.
std::vector<Index> World::Impl::cut_capacities() const {
  std::vector<Index> all;
  for (const auto& body : bodies_)
    all.push_back(body->cuts() != nullptr ? static_cast<Index>(body->shape().lattice.copies.size()) : 0);
  return all;
}

/// Cuttable bodies are as they were made, with these capacities. Nothing may be on the way.
void World::Impl::rebuild(const std::vector<Index>& capacities) {
  for (std::size_t k = 0; k < bodies_.size(); ++k)
    if (bodies_[k]->cuts() != nullptr) bodies_[k]->rebuild(capacities[k]);
  touching_.rebuild(bodies_, scene_.contact);
  for (const auto& body : bodies_)
    if (liquid_ && body->cuts() != nullptr) liquid_->renew(*body);
  readback_.clear();
  schedule_.clear();
  add_stages();
  schedule_.close();
}

/// A checkpoint's bodies had grown, or had not yet. No more memory is taken than the file has numbers for:
/// two nodes a copy.
void World::Impl::archive_capacities(StateArchive& a) {
  const std::vector<Index> here = cut_capacities();
  std::vector<Index> all = here;
  a.values("capacities for cuts", all);
  if (!a.reads()) return;
  bool is_cut = false;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const bool may_differ = here[k] > 0 && !bodies_[k]->description().cut_capacity;
    a.check(all[k] == here[k] || (may_differ && all[k] > 0 &&
                                  static_cast<std::size_t>(all[k]) <= a.bytes_left() / (2 * sizeof(Vec3f))),
            "capacities for cuts");
    is_cut = is_cut || (here[k] > 0 && bodies_[k]->cuts()->cutter().lattice().copies_in_use() > 0);
  }
  if (all != here || is_cut) rebuild(all);
}

/// @param ends_frame false: cuts of this frame go on after it
void World::Impl::archive_cuts_of(std::size_t number, StateArchive& a, bool ends_frame) {
  SoftBody& body = *bodies_[number];
  body.cuts()->archive(
      context(), a,
      [&](const TopologyChange& change, std::span<const PointChange> points) {
        touching_.apply(static_cast<Index>(number), body.cuts()->cutter(), change, points);
      },
      [&](int frame) {
        std::vector<Notice> reported_before;
        if (ends_frame || frame != cut_frame_) follow_cuts(number, reported_before);
      });
}

/// All that rebuild() makes anew. @param goes_on the body that will be cut once more in this frame
void World::Impl::archive_cut_bodies(StateArchive& a, std::size_t goes_on) {
  for (std::size_t k = 0; k < bodies_.size(); ++k)
    if (bodies_[k]->cuts() != nullptr) archive_cuts_of(k, a, k != goes_on);
  for (const auto& body : bodies_)
    if (body->cuts() != nullptr) body->archive(a);
  a.set_owner("bodies that touch");
  touching_.archive(a);
  if (liquid_) liquid_->archive_of_bodies(a);
}

}  // namespace tactus
