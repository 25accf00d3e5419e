// A body that is grabbed at a point.
#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/body_pull.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

/// Floats of the devices hold the squares of smaller numbers.
void check(const Grab& grab) {
  constexpr double kMost = 1e12, kMost_m = 1e6;
  const auto near = [](const char* name, Vec3d p) {
    if (!(length(p) <= kMost_m))
      throw usage_error(std::string("grab: ") + name + " is " + point_text(p) +
                        ", expected to be finite, and at most 1e6 m away");
  };
  const auto positive = [](const char* name, const std::optional<double>& value) {
    if (value && !(*value > 0 && *value <= kMost))
      throw usage_error(std::string("grab: ") + name + " is " + number_text(*value) +
                        ", expected > 0 and <= 1e12");
  };
  near("point_m", grab.point_m);
  near("target_m", grab.target_m);
  positive("radius_m", grab.radius_m);
  positive("stiffness_N_m", grab.stiffness_N_m);
  positive("max_force_N", grab.max_force_N);
}

/// The vertex of a body's seen surface that is nearest, where the surface is now. @returns its cube and place
/// @throws usage Error where none is near.
BodyPoint nearest_point(const SoftBody& body, ExecContext& ctx, const Grab& grab, double most_m) {
  const TriangleMesh surface = body.surface().to_mesh(ctx);
  Index nearest = -1;
  double distance_m = INFINITY;
  for (const auto& triangle : surface.triangles) {
    for (const Index v : triangle) {
      const Vec3d p_m = vec_cast<double>(surface.positions_m[static_cast<std::size_t>(v)]);
      if (const double d_m = length(p_m - grab.point_m); d_m < distance_m) distance_m = d_m, nearest = v;
    }
  }
  if (!(distance_m <= most_m))
    throw usage_error("grab: point_m " + point_text(grab.point_m) + " is " + number_text(distance_m) +
                      " m from body '" + grab.body + "', expected at most " + number_text(most_m) + " m");
  const embed::Anchor anchor = to_host(ctx, body.surface().anchors().part(nearest, 1))[0];
  return {body.shape().lattice.cube_nodes[static_cast<std::size_t>(anchor.cube)], anchor.local, anchor.cube};
}

}  // namespace

void World::Impl::set_grab(const std::optional<Grab>& grab) {
  if (grab) check(*grab);
  const bool goes_on = grab && grab_ && grab->body == grab_->body && grab->point_m == grab_->point_m &&
                       grab->radius_m == grab_->radius_m;
  if (!goes_on && grab_) release_grab();
  if (!grab) return;
  if (!goes_on) attach(*grab);
  grab_ = grab;
  energy_watch_.turn_off();
}

void World::Impl::release_grab() {
  bodies_[grabbed_]->spring().release();
  grab_.reset();
  select_recording();
}

void World::Impl::attach(const Grab& grab) {
  const auto found = std::find_if(bodies_.begin(), bodies_.end(),
                                  [&](const auto& body) { return body->name() == grab.body; });
  if (found == bodies_.end()) {
    std::vector<std::string> names;
    for (const auto& body : bodies_) names.push_back(body->name());
    throw usage_error("grab: there is no body '" + grab.body + "'" + suggestion(grab.body, names));
  }
  SoftBody& body = **found;
  if (!body.spring().can_pull())
    throw usage_error("grab: body '" + grab.body + "' has 'contact: false': nothing touches it");
  const double radius_m = grab.radius_m.value_or(2 * body.description().spacing_m);
  const BodyPoint point =
      nearest_point(body, context(), grab, std::max(radius_m, 2 * body.description().spacing_m));
  const std::vector<Vec3f> x_m = body.positions_m(context());
  body.spring().attach(body.shape().lattice, point, radius_m, x_m);
  grabbed_at_m_ = vec_cast<double>(point.position_m(x_m));
  grabbed_ = static_cast<std::size_t>(found - bodies_.begin());
  grab_ = grab;
  select_recording();
}

/// The tissue that is held stays on its side of a cut.
void World::Impl::follow_cut_of_grab() {
  SoftBody& body = *bodies_[grabbed_];
  BodyPoint point = body.spring().point();
  body.cuts()->follow(point);
  body.spring().attach(body.shape().lattice, point,
                       grab_->radius_m.value_or(2 * body.description().spacing_m),
                       body.positions_m(context()));
}

void World::Impl::begin_grab() {
  if (!grab_) return;
  const SoftBody& body = *bodies_[grabbed_];
  const double young_Pa = scene_.bodies[grabbed_].material.young_modulus_pa,
               radius_m = grab_->radius_m.value_or(2 * body.description().spacing_m);
  bodies_[grabbed_]->spring().begin_frame(
      {.target_m = grabbed_at_m_ + (grab_->target_m - grab_->point_m),
       .stiffness_N_m = grab_->stiffness_N_m.value_or(8 * young_Pa * radius_m),
       .max_force_N = grab_->max_force_N.value_or(0.5 * M_PI * young_Pa * radius_m * radius_m)});
}

/// Stages that pull are in frames of a recording of their own.
void World::Impl::select_recording() {
  for (auto& body : bodies_) body->spring().set_active(grab_.has_value());
  schedule_.select(reductions_made_ >> 1 | (grab_ ? 1U << (kQualityReductions - 1) : 0U));
}

/// The nodes that are held are in the body's archive.
void World::Impl::archive_grab(StateArchive& a) {
  a.set_owner("grab");
  Index number = grab_ ? static_cast<Index>(grabbed_) : -1;
  a.value("body", number);
  a.check(number >= -1 && number < static_cast<Index>(bodies_.size()), "body");
  if (number < 0) return;
  if (!grab_) grab_.emplace();
  grabbed_ = static_cast<std::size_t>(number);
  grab_->body = bodies_[grabbed_]->name();
  a.value("point", grab_->point_m);
  a.value("target", grab_->target_m);
  a.value("place", grabbed_at_m_);
  for (std::optional<double>* setting : {&grab_->radius_m, &grab_->stiffness_N_m, &grab_->max_force_N}) {
    double value = setting->value_or(0);
    a.value("setting", value);
    *setting = value > 0 ? std::optional<double>(value) : std::nullopt;
  }
  select_recording();
}

}  // namespace tactus
