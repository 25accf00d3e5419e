#include "tactus/contact/contact_points.h"

#include <algorithm>

namespace tactus {
namespace {

TouchState state_of(Index touching, const PointContact& contact) {
  if (touching != 1) return TouchState::left;
  return contact.friction.unused_m_s > 0 ? TouchState::sticking : TouchState::sliding;
}

/// Integers that wrap round: the difference of two sums is that of their values.
void subtract(const ReactionSums& from, ReactionSums& sums) {
  for (int a = 0; a < 3; ++a) {
    sums.impulse[a] = from.impulse[a] - sums.impulse[a];
    sums.moment[a] = from.moment[a] - sums.moment[a];
  }
}

}  // namespace

ContactPointList read_contact_points(ExecContext& ctx, BodyPoints& points) {
  ContactPointList list;
  if (points.count() == 0) return list;
  const PointState state = points.state();
  const std::vector<Index> recorded = to_host(ctx, state.recorded), touching = to_host(ctx, state.touching);
  const std::vector<ContactRecord> records = to_host(ctx, state.records);
  const std::vector<PointContact> contacts = to_host(ctx, state.contact);
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    if (recorded[i] == 0) continue;
    const ContactRecord& record = records[i];
    const PointContact& contact = contacts[i];
    list.points.push_back({static_cast<Index>(i), record.collider, contact.x_m, contact.n, -contact.depth_m,
                           -record.impulse_N_s, state_of(touching[i], contact)});
    list.moved_on[static_cast<std::size_t>(record.collider)].add(record.impulse_N_s, record.moment_N_m_s);
  }
  const std::vector<ColliderTotals> totals = to_host(ctx, points.totals());
  for (std::size_t c = 0; c < list.moved_on.size(); ++c) subtract(totals[c].sums, list.moved_on[c]);
  return list;
}

void append_moved_on(const std::array<ReactionSums, kColliders>& moved_on, std::vector<ContactPoint>& to) {
  for (std::size_t c = 0; c < moved_on.size(); ++c) {
    const Vec3f impulse_N_s = -ReactionSums::value(moved_on[c].impulse);
    if (impulse_N_s == Vec3f{}) continue;
    to.push_back({.point = -1,
                  .collider = static_cast<Index>(c),
                  .n = normalized(impulse_N_s),
                  .impulse_N_s = impulse_N_s});
  }
}

}  // namespace tactus
