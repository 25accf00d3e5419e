#pragma once
/// Contacts of bodies as data, for programs that ask for them.
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tactus/contact/contact_points.h"

namespace tactus {

enum class ColliderKind : std::uint8_t { component, obstacle, tool, body };
/// "component", "obstacle", "tool" or "body": for programs.
const char* kind_text(ColliderKind kind);
/// "sticking", "sliding" or "left"; likewise.
const char* state_text(TouchState state);

/// A point of a body's surface that touched something in a frame, and the impulse that it got there.
///
/// The impulses of all entries add up to the change of the body's momentum by contact; a share of it that
/// goes to nodes that are held doesn't move them. Friction keeps to Coulomb's law over the life of a contact:
/// tangential impulses are at most mu times the normal ones since it began. In one frame they may be more,
/// as friction may still use normal impulses of some corrections before (FrictionMemory).
///
/// Entries with point -1 have only an impulse: that of points that went on to another collider within the
/// frame, and that of another body, as one sum.
struct BodyPointContact {
  Index point = -1;     ///< number among the contact points of the body; the same as long as it isn't cut
  std::string other{};  ///< as BodyContact::component
  ColliderKind kind = ColliderKind::component;
  Vec3f point_m{};  ///< world
  Vec3f normal{};   ///< unit, towards the body; 0 with `response: paper`
  float gap_m = 0;  ///< before the last correction of the frame; < 0: inside
  /// On the body over the frame. Split by the normal of the last correction: normal_N_s * normal +
  /// tangential_N_s.
  Vec3f impulse_N_s{};
  float normal_N_s = 0;
  Vec3f tangential_N_s{};
  TouchState state = TouchState::left;
};

/// Keeps the contacts of a frame for the bodies whose contacts are asked for.
class ContactLog {
 public:
  /// @param bodies names, in the scene's order
  explicit ContactLog(std::vector<std::string> bodies);
  /// @throws usage Error for a name that no body has, with those that there are.
  void ask(const std::string& body);
  const std::vector<BodyPointContact>& of(const std::string& body) const;
  bool is_asked(std::size_t body) const { return bodies_[body].is_asked; }
  void begin_frame();
  /// A contact over a part of the frame; those of one point with one thing become one. Nothing where the
  /// body's contacts aren't asked for.
  void add(std::size_t body, const BodyPointContact& contact);

 private:
  struct Body {
    std::string name;
    bool is_asked = false;
    std::vector<BodyPointContact> contacts{};
    std::map<std::pair<Index, std::string>, std::size_t> place{};  ///< by point and other
  };
  std::size_t find(const std::string& body) const;
  std::vector<Body> bodies_;
};

}  // namespace tactus
