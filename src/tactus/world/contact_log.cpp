#include "tactus/world/contact_log.h"

#include <algorithm>

#include "tactus/base/error.h"

namespace tactus {

const char* kind_text(ColliderKind kind) {
  switch (kind) {
    case ColliderKind::component:
      return "component";
    case ColliderKind::obstacle:
      return "obstacle";
    case ColliderKind::tool:
      return "tool";
    case ColliderKind::body:
      break;
  }
  return "body";
}

const char* state_text(TouchState state) {
  return state == TouchState::left ? "left" : state == TouchState::sticking ? "sticking" : "sliding";
}

ContactLog::ContactLog(std::vector<std::string> bodies) {
  for (std::string& name : bodies) bodies_.push_back({.name = std::move(name)});
}

std::size_t ContactLog::find(const std::string& body) const {
  const auto known =
      std::find_if(bodies_.begin(), bodies_.end(), [&](const Body& b) { return b.name == body; });
  if (known != bodies_.end()) return static_cast<std::size_t>(known - bodies_.begin());
  std::string names;
  for (const Body& b : bodies_) names += (names.empty() ? "'" : ", '") + b.name + "'";
  throw usage_error("'" + body + "' is no body; those are " + (names.empty() ? "none" : names));
}

void ContactLog::ask(const std::string& body) { bodies_[find(body)].is_asked = true; }

const std::vector<BodyPointContact>& ContactLog::of(const std::string& body) const {
  return bodies_[find(body)].contacts;
}

void ContactLog::begin_frame() {
  for (Body& body : bodies_) {
    body.contacts.clear();
    body.place.clear();
  }
}

void ContactLog::add(std::size_t body, const BodyPointContact& contact) {
  Body& to = bodies_[body];
  if (!to.is_asked) return;
  const auto [place, is_new] = to.place.try_emplace({contact.point, contact.other}, to.contacts.size());
  if (is_new) {
    to.contacts.push_back(contact);
  } else {
    BodyPointContact& known = to.contacts[place->second];
    const Vec3f impulse_N_s = known.impulse_N_s + contact.impulse_N_s;
    known = contact;
    known.impulse_N_s = impulse_N_s;
  }
  BodyPointContact& sum = to.contacts[place->second];
  if (sum.point < 0) sum.normal = normalized(sum.impulse_N_s);
  sum.normal_N_s = dot(sum.impulse_N_s, sum.normal);
  sum.tangential_N_s = sum.impulse_N_s - sum.normal_N_s * sum.normal;
}

}  // namespace tactus
