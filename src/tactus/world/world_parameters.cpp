// The parameters of a scene that may change between frames.
#include "tactus/world/world_impl.h"

namespace tactus {

void World::Impl::add_parameters() {
  static constexpr const char* kAxes[] = {".x", ".y", ".z"};
  for (int axis = 0; axis < 3; ++axis)
    parameters_.add(std::string("gravity_m_s2") + kAxes[axis], "gravity_m_s2", scene_.gravity_m_s2[axis],
                    [this, axis](double x) {
                      scene_.gravity_m_s2[axis] = x;
                      if (liquid_) liquid_->set_gravity(scene_.gravity_m_s2);
                    });
  const auto respond = [this] {
    const auto friction = static_cast<float>(scene_.contact.friction),
               restitution = static_cast<float>(scene_.contact.restitution);
    colliders_.set_response(friction, restitution);
    touching_.set_response(friction, restitution);
  };
  parameters_.add("contact.friction", "contact.friction", scene_.contact.friction, [this, respond](double x) {
    scene_.contact.friction = x;
    respond();
  });
  parameters_.add("contact.restitution", "contact.restitution", scene_.contact.restitution,
                  [this, respond](double x) {
                    scene_.contact.restitution = x;
                    respond();
                  });
  for (std::size_t b = 0; b < bodies_.size(); ++b) add_parameters_of(*bodies_[b], scene_.bodies[b]);
  add_view_parameters();
  parameters_.when_changed([this] {
    energy_watch_.turn_off();  // it knows one gravity and one stiffness
    schedule_.record_anew();
  });
}

void World::Impl::add_view_parameters() {
  ViewCameraDescription& camera = scene_.view.camera;
  const auto add = [this](const char* name, double& angle_deg) {
    parameters_.add(
        name, name, angle_deg, [&angle_deg](double deg) { angle_deg = deg; }, ParameterEffect::next_picture);
  };
  if (!camera.eye_m) {
    add("view.camera.azimuth_deg", camera.azimuth_deg);
    add("view.camera.elevation_deg", camera.elevation_deg);
  }
  add("view.camera.field_of_view_deg", camera.field_of_view_deg);
}

void World::Impl::add_parameters_of(SoftBody& body, const BodyDescription& description) {
  const std::string in = "bodies." + body.name() + ".";
  const MaterialDescription& m = description.material;
  // As printed, shape matching's stiffness follows the step, not Young's modulus.
  if (m.kappa == Stiffness::material) {
    constexpr double kMost = 1e6;  // of a stiffness over that which was built; floats hold its square root
    parameters_.add(in + "material.young_modulus_pa", "bodies[].material.young_modulus_pa",
                    m.young_modulus_pa, [&body](double E_Pa) { body.set_young_modulus_Pa(E_Pa); });
    parameters_.narrow(m.young_modulus_pa / kMost, m.young_modulus_pa * kMost);
  }
  parameters_.add(in + "material.drag_per_s", "bodies[].material.drag_per_s", m.drag_per_s,
                  [&body](double drag_per_s) { body.set_drag_per_s(drag_per_s); });
  if (description.bleeding && liquid_)
    parameters_.add(in + "bleeding.rate_m_s", "bodies[].bleeding.rate_m_s", description.bleeding->rate_m_s,
                    [&body](double rate_m_s) { body.set_bleeding_m_s(rate_m_s); });
}

}  // namespace tactus
