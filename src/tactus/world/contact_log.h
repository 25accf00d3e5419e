#pragma once
/// Contacts of bodies as data, for programs that ask for them.
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tactus/contact/contact_points.h"
#include "tactus/world/step_report.h"

namespace tactus {

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
