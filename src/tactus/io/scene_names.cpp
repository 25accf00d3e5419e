// Names of a scene: each says which thing it is.
#include <algorithm>
#include <map>
#include <string_view>

#include "tactus/base/error.h"
#include "tactus/io/region_schema.h"

namespace tactus {
namespace {

/// @param section of the scene, where items aren't in one of their own
template <class T>
void check_unique_names(FieldVisitor& v, const std::vector<T>& items, const char* key,
                        const char* section = nullptr) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    const auto same = [&](const T& other) { return other.name == items[i].name; };
    v.check(std::none_of(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(i), same),
            section != nullptr ? section : key,
            "two of the '" + std::string(key) + "' have the name '" + items[i].name + "', names must differ");
  }
}

/// Results say by its name on which thing a force is, and a program moves a thing by its name.
void check_names_of_things(FieldVisitor& v, const Scene& scene) {
  std::map<std::string, const char*> things;
  const auto add = [&](const auto& items, const char* key) {
    for (const auto& item : items) {
      const auto [known, is_new] = things.emplace(item.name, key);
      v.check(
          is_new || known->second == std::string_view(key), key,
          "'" + item.name + "' is the name of one of the '" + known->second + "', too: names must differ");
      const bool is_label =
          !item.name.empty() && item.name.find_first_not_of("0123456789") == std::string::npos;
      v.check(
          !is_label || scene.source.kind == SourceKind::none, key,
          "the name '" + item.name +
              "' is a number, and so are those of the real surface's components: expected one with a letter");
    }
  };
  add(scene.bodies, "bodies");
  add(scene.obstacles, "obstacles");
  add(scene.blades, "blades");
}

void check_probes(FieldVisitor& v, const Scene& scene) {
  std::vector<std::string> names;
  for (const BodyDescription& body : scene.bodies) names.push_back(body.name);
  for (const ProbeDescription& probe : scene.probes) {
    const bool known = std::find(names.begin(), names.end(), probe.body) != names.end();
    if (!known) {
      v.check(false, "probes",
              "probe '" + probe.name + "' sits on the unknown body '" + probe.body + "'" +
                  (names.empty() ? "; the scene has no bodies" : suggestion(probe.body, names)));
    }
  }
}

}  // namespace

void check_names(FieldVisitor& v, const Scene& scene) {
  check_unique_names(v, scene.bodies, "bodies");
  check_unique_names(v, scene.obstacles, "obstacles");
  check_unique_names(v, scene.blades, "blades");
  if (scene.fluid) check_unique_names(v, scene.fluid->emitters, "emitters", "fluid");
  check_names_of_things(v, scene);
  check_unique_names(v, scene.plans, "plans");
  check_unique_names(v, scene.probes, "probes");
  check_probes(v, scene);
}

}  // namespace tactus
