#include "tactus/contact/pairs/body_pairs.h"

#include <algorithm>
#include "tactus/base/at.h"
#include "tactus/contact/pairs/pair_bound_kernels.h"
#include "tactus/contact/pairs/pair_cut_kernels.h"
#include "tactus/contact/pairs/pair_find_kernels.h"
#include "tactus/contact/pairs/pair_response_kernels.h"

namespace tactus {
namespace {

Index size_of(const auto& v) { return static_cast<Index>(v.size()); }

/// That MovePairs works on together.
Index row_groups(Index rows) { return ceil_div(rows, Index(MovePairs::kNodes)); }

/// Capacity for the longest that lists may become.
Index list_capacity(const std::vector<std::vector<Index>>& lists, Index capacity) {
  Index sum = 0;
  for (const auto& list : lists) sum += size_of(list);
  return capacity > 0 ? sum + capacity : 0;
}

IndexListsView view(const IndexLists& lists) { return {lists.ranges(), lists.values()}; }

}  // namespace

BodyPairs::BodyPairs(ExecContext& ctx, std::span<const PairedBody> bodies, const ContactSettings& settings,
                     bool touch_others)
    : settings_(checked(settings)), touch_others_(touch_others) {
  auto made = std::make_unique<PairModel>();
  PairModel& all = *made;
  Index capacity = 0;  // cubes that may come
  for (const PairedBody& body : bodies) {
    first_.push_back({size_of(all.points), size_of(all.cubes), size_of(all.groups), size_of(all.nodes)});
    all.add(body);
    if (body.cuttable) capacity += body.lattice.cube_count();
  }
  first_.push_back({size_of(all.points), size_of(all.cubes), size_of(all.groups), size_of(all.nodes)});
  smallest_mass_kg_ = all.smallest_mass_kg;
  bodies_ = to_device(ctx, all.bodies);
  patches_ = to_device(ctx, all.patches);
  cubes_ = to_device(ctx, all.cubes);
  samples_ = to_device(ctx, all.samples);
  groups_ = to_device(ctx, all.groups);
  points_ = to_device(ctx, all.points);
  rest_ = to_device(ctx, all.rest);
  nodes_ = to_device(ctx, all.nodes);
  part_ = to_device(ctx, all.part);
  rows_ = to_device(ctx, all.rows);
  // A cube has eight nodes; points that come are as many per cube at most, of eight nodes each.
  patch_nodes_ = IndexLists(ctx, all.patch_nodes, list_capacity(all.patch_nodes, 16 * capacity));
  patch_cubes_ = IndexLists(ctx, all.patch_cubes, list_capacity(all.patch_cubes, capacity));
  incident_points_ = IndexLists(ctx, all.row_points,
                                list_capacity(all.row_points, capacity > 0 ? 8 * size_of(all.points) : 0));
  incident_cubes_ = IndexLists(ctx, all.row_cubes, list_capacity(all.row_cubes, 8 * capacity));
  contact_ = to_device(ctx, std::vector<PairContact>(all.points.size()));
  const auto zeros = [&](std::size_t n) { return to_device(ctx, std::vector<std::uint32_t>(n)); };
  group_active_ = zeros(all.groups.size());
  row_weight_ = zeros(all.nodes.size());
  cube_list_ = zeros(all.cubes.size());
  next_ = zeros(all.points.size());
  used_ = zeros(bodies.size() * bodies.size());
  patch_box_ = Buffer<PatchBox>(ctx.device(), size_of(all.patches));
  body_box_ = Buffer<PatchBox>(ctx.device(), size_of(bodies));
  wake_box_ = Buffer<PatchBox>(ctx.device(), size_of(bodies));
  cube_bounds_ = Buffer<float>(ctx.device(), CubeBoxes::size(patch_cubes_.capacity()));
  cube_places_ = Buffer<CubePlace>(ctx.device(), patch_cubes_.capacity());
  patch_way_ = Buffer<float>(ctx.device(), size_of(all.patches));
  last_x_ = to_device(ctx, std::vector<Vec3f>(at(patch_nodes_.capacity())));
  self_motion_ = to_device(ctx, std::vector<SelfMotion>(bodies.size()));
  group_sleep_ = to_device(ctx, std::vector<SelfSleep>(all.groups.size()));
  point_sleep_ = to_device(ctx, std::vector<SelfSleep>(all.points.size()));
  recorded_ = Buffer<Index>(ctx.device(), size_of(all.points));
  records_ = Buffer<ContactRecord>(ctx.device(), size_of(all.points));
  totals_ = to_device(ctx, std::vector<ColliderTotals>(bodies.size() * bodies.size()));
  moved_on_ = to_device(ctx, std::vector<ReactionSums>(bodies.size() * bodies.size()));
  if (capacity > 0) {
    all.samples = {};
    model_ = std::move(made);
    staged_places_ = Buffer<Index>(ctx.device(), size_of(all.cubes));
    staged_cubes_ = Buffer<SolidCube>(ctx.device(), size_of(all.cubes));
    staged_samples_ = Buffer<float>(ctx.device(), samples_.size());
    staged_points_ = Buffer<PairPointChange>(ctx.device(), size_of(all.points));
    make_used(ctx);
  }
  begin_frame(ctx);
  ctx.parallel_for("contact/place cubes", patches_.size(), PlaceCubes{table(), state()});
  ctx.synchronize();
}

void BodyPairs::make_used(ExecContext& ctx) {
  const PairModel& m = *model_;
  std::vector<bool> groups, rows(at(row_groups(nodes_.size())));
  for (const PointGroup& group : m.groups) groups.push_back(group.count > 0);
  for (std::size_t row = 0; row < m.nodes.size(); ++row)
    if (!m.row_points[row].empty() || !m.row_cubes[row].empty())
      rows[row / static_cast<std::size_t>(MovePairs::kNodes)] = true;
  used_groups_ = UsedList(ctx, groups);
  used_rows_ = UsedList(ctx, rows);
}

void BodyPairs::apply(ExecContext& ctx, Index body, const SolidChange& change) {
  if (!model_) throw Error("contact: no body is cuttable");
  model_->apply(body, change);
  upload_changes(ctx, change);
  const PairTable t = table();
  const PairState s = state();
  std::vector<Index> gone = model_->changed().gone;
  std::sort(gone.begin(), gone.end());
  const View<Index> staged = staged_places_.view().part(0, size_of(gone));
  ctx.upload(gone, staged);
  ctx.fill_bytes(row_weight_.view(), 0);
  ctx.parallel_for("contact/weigh pairs", points_.size(), WeighPairs{t, s, View<const Index>(staged)});
  ctx.parallel_for("contact/place cubes", patches_.size(), PlaceCubes{t, s});
  ctx.parallel_for("contact/start patches", patches_.size(), StartPatches{t, s});
  ctx.fill_bytes(group_sleep_.view(), 0);
  ctx.fill_bytes(point_sleep_.view(), 0);
  ctx.synchronize();
}

void BodyPairs::upload_changes(ExecContext& ctx, const SolidChange& change) {
  const PairModel& m = *model_;
  const PairModel::Changed& changed = m.changed();
  for (const Index patch : changed.patches) {
    patch_nodes_.set(patch, m.patch_nodes[at(patch)]);
    patch_cubes_.set(patch, m.patch_cubes[at(patch)]);
  }
  for (const Index row : changed.rows) {
    incident_points_.set(row, m.row_points[at(row)]);
    incident_cubes_.set(row, m.row_cubes[at(row)]);
    if (!m.row_points[at(row)].empty() || !m.row_cubes[at(row)].empty())
      used_rows_.add(row / MovePairs::kNodes);
  }
  for (std::size_t g = 0; g < m.groups.size(); ++g)
    if (m.groups[g].count > 0) used_groups_.add(static_cast<Index>(g));
  used_groups_.upload(ctx);
  used_rows_.upload(ctx);
  for (IndexLists* lists : {&patch_nodes_, &patch_cubes_, &incident_points_, &incident_cubes_})
    lists->upload(ctx);
  std::vector<SolidCube> cubes;
  for (const Index cube : changed.cubes) cubes.push_back(m.cubes[at(cube)]);
  std::vector<PairPointChange> points;
  for (const Index point : changed.points) {
    points.push_back({point, m.points[at(point)], m.rest[at(point)], {}});
    for (Index k = 0; k < 8; ++k) points.back().rows[k] = m.rows[at(8 * point + k)];
  }
  const View<Index> places = staged_places_.view().part(0, size_of(cubes));
  const View<SolidCube> staged = staged_cubes_.view().part(0, size_of(cubes));
  const View<float> samples = staged_samples_.view().part(0, size_of(change.sample_m));
  const View<PairPointChange> staged_points = staged_points_.view().part(0, size_of(points));
  ctx.upload(changed.cubes, places);
  ctx.upload(cubes, staged);
  ctx.upload(change.sample_m, samples);
  ctx.upload(points, staged_points);
  ctx.upload(m.bodies, bodies_.view());
  ctx.upload(m.groups, groups_.view());
  ctx.upload(m.part, part_.view());
  ctx.parallel_for("contact/set cubes", places.size(),
                   SetSolidCubes{View<const Index>(places), View<const SolidCube>(staged),
                                 View<const float>(samples), cubes_.view(), samples_.view()});
  ctx.parallel_for(
      "contact/set pair points", staged_points.size(),
      SetPairPoints{View<const PairPointChange>(staged_points), points_.view(), rest_.view(), rows_.view()});
  ctx.synchronize();
}

PairTable BodyPairs::table() const {
  return {bodies_.const_view(),   patches_.const_view(),   view(patch_nodes_),   view(patch_cubes_),
          cubes_.const_view(),    {samples_.const_view()}, groups_.const_view(), points_.const_view(),
          rows_.const_view(),     rest_.const_view(),      nodes_.const_view(),  part_.const_view(),
          view(incident_points_), view(incident_cubes_),   used_groups_.view(),  used_rows_.view()};
}

PairState BodyPairs::state() {
  return {patch_box_.view(),   body_box_.view(),    {cube_bounds_.view()}, cube_places_.view(),
          wake_box_.view(),    patch_way_.view(),   last_x_.view(),        self_motion_.view(),
          group_sleep_.view(), point_sleep_.view(), group_active_.view(),  contact_.view(),
          row_weight_.view(),  cube_list_.view(),   next_.view(),          recorded_.view(),
          records_.view(),     moved_on_.view(),    used_.view(),          smallest_mass_kg_};
}

void BodyPairs::set_response(float friction, float restitution) {
  ContactSettings changed = settings_;
  changed.friction = friction;
  changed.restitution = restitution;
  settings_ = checked(changed);
}

void BodyPairs::begin_frame(ExecContext& ctx) { ctx.fill_bytes(recorded_.view(), 0); }

void BodyPairs::correct(ExecContext& ctx, View<const SurfacePoses> poses, const CorrectionTime& time) {
  const PairTable t = table();
  const PairState s = state();
  ctx.parallel_for("contact/bound patches", patches_.size(), BoundPatches{t, s});
  ctx.parallel_for("contact/bound bodies", bodies_.size(), BoundBodies{t, s});
  const Index touch_others = touch_others_ ? 1 : 0;
  ctx.parallel_for("contact/bound cubes", patches_.size(), BoundCubes{t, s, touch_others});
  ctx.parallel_for("contact/find pairs", used_groups_.count(groups_.size()),
                   FindPairs{t, s, {time, settings_.restitution, settings_.friction}, touch_others});
  ctx.parallel_for("contact/pair impulses", used_groups_.count(groups_.size()), PairImpulses{t, s, poses});
  ctx.parallel_for("contact/move pairs", used_rows_.count(row_groups(nodes_.size())), MovePairs{t, s});
}

/// Patch by patch: where cuts put a patch's list is its own history.
void BodyPairs::archive_last_nodes(ExecContext& ctx, StateArchive& a) {
  std::vector<Vec3f> all = to_host(ctx, last_x_.const_view()), listed;
  for (Index patch = 0; patch < patch_nodes_.count(); ++patch) {
    const IndexRange range = patch_nodes_.range(patch);
    listed.insert(listed.end(), all.begin() + range.begin, all.begin() + range.end);
  }
  a.values("last nodes of patches", listed);
  if (!a.reads()) return;
  auto next = listed.begin();
  for (Index patch = 0; patch < patch_nodes_.count(); ++patch) {
    const IndexRange range = patch_nodes_.range(patch);
    std::copy_n(next, range.end - range.begin, all.begin() + range.begin);
    next += range.end - range.begin;
  }
  ctx.upload(all, last_x_.view());
  ctx.synchronize();
}

/// From the places that entries had where they were written to those that they have here.
struct BodyPairs::PlaceMove {
  const std::vector<Places>& from;
  const std::vector<Places>& to;
  Index operator()(Index place, Index Places::*of) const {
    if (place < 0) return place;
    std::size_t body = 0;
    while (body + 2 < from.size() && from[body + 1].*of <= place) ++body;
    return place - from[body].*of + to[body].*of;
  }
};

/// Body by body. @param take checks the values read, and takes them to the places of this
template <class T, class F>
void BodyPairs::archive_entries(ExecContext& ctx, StateArchive& a, const char* name, Buffer<T>& entries,
                                Index Places::*of, const std::vector<Places>& from, F&& take) {
  std::vector<T> here = to_host(ctx, entries.const_view()), there(at(from.back().*of));
  if (!a.reads()) there = here;
  a.values(name, there);
  for (T& entry : there) take(entry);
  if (!a.reads()) return;
  for (std::size_t body = 0; body + 1 < first_.size(); ++body)
    std::copy(there.begin() + from[body].*of, there.begin() + from[body + 1].*of,
              here.begin() + first_[body].*of);
  ctx.upload(here, entries.view());
  ctx.synchronize();
}

/// A body may have had capacity for fewer entries: all of them keep their order in the body, but not their
/// places.
void BodyPairs::archive(ExecContext& ctx, StateArchive& a) {
  std::vector<Places> from = first_;
  a.values("places of bodies", from);
  for (std::size_t body = 0; body + 1 < from.size(); ++body)
    for (const auto of : {&Places::point, &Places::cube, &Places::group, &Places::row}) {
      const Index count = from[body + 1].*of - from[body].*of;
      a.check(
          (body > 0 || from[0].*of == 0) && count >= 0 && count <= first_[body + 1].*of - first_[body].*of,
          "places of bodies");
    }
  const PlaceMove to{from, first_};
  const auto as_is = [](auto&) {};
  archive_entries(ctx, a, "contacts", contact_, &Places::point, from, [&](PairContact& c) {
    for (Index* cube : {&c.cube, &c.anchor_cube}) {
      a.check(*cube >= -1 && *cube < from.back().cube, "contacts");
      *cube = to(*cube, &Places::cube);
    }
  });
  const auto take_point = [&](std::uint32_t& point) {  // plus one
    a.check(point <= static_cast<std::uint32_t>(from.back().point), "points in cubes");
    if (point > 0) point = static_cast<std::uint32_t>(to(static_cast<Index>(point) - 1, &Places::point)) + 1;
  };
  archive_entries(ctx, a, "points in cubes", cube_list_, &Places::cube, from, take_point);
  archive_entries(ctx, a, "next points in cubes", next_, &Places::point, from, take_point);
  archive_entries(ctx, a, "active groups", group_active_, &Places::group, from, as_is);
  archive_last_nodes(ctx, a);
  a.buffer(ctx, "motion against itself", self_motion_);
  archive_entries(ctx, a, "sleeping groups", group_sleep_, &Places::group, from, as_is);
  archive_entries(ctx, a, "sleeping points", point_sleep_, &Places::point, from, as_is);
  archive_entries(ctx, a, "weights of nodes", row_weight_, &Places::row, from, as_is);
}

void BodyPairs::end_frame(ExecContext& ctx) {
  const Index n = bodies_.size();
  for (Index a = 0; a < n; ++a) {
    const Index first = first_[at(a)].point, count = first_[at(a) + 1].point - first;
    ctx.parallel_for("contact/pair totals", n,
                     SumRecords{{count},
                                recorded_.const_view().part(first, count),
                                records_.const_view().part(first, count),
                                moved_on_.view().part(a * n, n),
                                used_.view().part(a * n, n),
                                totals_.view().part(a * n, n)});
  }
}

std::vector<PairReaction> pair_reactions(std::span<const ColliderTotals> totals, Index bodies,
                                         float dt_frame_s) {
  std::vector<PairReaction> all;
  for (Index a = 0; a < bodies; ++a) {
    for (Index b = 0; b < bodies; ++b) {
      const ColliderTotals &there = totals[at(a * bodies + b)], &back = totals[at(b * bodies + a)];
      if (there.contacts + back.contacts == 0) continue;
      const Vec3f impulse = there.impulse_N_s() - back.impulse_N_s(),
                  moment = there.moment_N_m_s() - back.moment_N_m_s();
      all.push_back({a,
                     b,
                     {b, impulse / dt_frame_s, moment / dt_frame_s, impulse,
                      std::max(there.max_depth_m, back.max_depth_m),
                      a == b ? there.contacts : there.contacts + back.contacts}});
    }
  }
  return all;
}

}  // namespace tactus
