#pragma once
/// How a description declares its fields: once, for the visitors that read, check or document them.
#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/sim/scene.h"

namespace tactus {

enum class Presence : std::uint8_t { optional, required };

/// One key of a mapping.
struct Field {
  const char* name;
  const char* meaning;  ///< one line for the reference
  Presence presence = Presence::optional;
};

/// The numbers that a field takes: [min, max], or (min, max] when `min` itself is excluded.
struct Range {
  const char* unit = "";
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool excludes_min = false;
  bool contains(double x) const { return (excludes_min ? x > min : x >= min) && x <= max; }
};
/// "> 0 and <= 1 m", ">= 0"; "" when everything is allowed and there is no unit.
std::string range_text(const Range& range);

/// Visits the fields of one mapping. Values hold their defaults before the visit, and the values read after
/// it.
class FieldVisitor {
 public:
  virtual ~FieldVisitor() = default;
  virtual void text(const Field& field, std::string& value) = 0;
  /// A path: `$TACTUS_DATA` is replaced, a relative path starts at the folder of the file.
  virtual void path(const Field& field, std::string& value) = 0;
  /// One of the known words.
  virtual void word(const Field& field, std::string& value, std::span<const std::string> known) = 0;
  virtual void boolean(const Field& field, bool& value) = 0;
  virtual void integer(const Field& field, int& value, const Range& range) = 0;
  virtual void real(const Field& field, double& value, const Range& range) = 0;
  virtual void vector(const Field& field, Vec3d& value, const Range& range) = 0;
  virtual void pixel_size(const Field& field, Vec2i& value, const Range& range) = 0;
  virtual void frames(const Field& field, FrameRange& value) = 0;
  virtual void integers(const Field& field, std::vector<int>& value, const Range& range) = 0;
  /// A number or the word `auto` (none); `automatic` describes the effect of `auto`.
  virtual void integer_or_auto(const Field& field, std::optional<int>& value, const Range& range,
                               const char* automatic) = 0;
  virtual void real_or_auto(const Field& field, std::optional<double>& value, const Range& range,
                            const char* automatic) = 0;
  virtual void vector_or_auto(const Field& field, std::optional<Vec3d>& value, const Range& range,
                              const char* automatic) = 0;

  using Describe = std::function<void(FieldVisitor&)>;
  /// A mapping inside the mapping.
  virtual void section(const Field& field, const Describe& describe) = 0;
  /// A list of mappings.
  struct Items {
    std::function<Describe()> append;         ///< adds one element; returns its description
    std::function<std::size_t()> size;        ///< of those that are there
    std::function<Describe(std::size_t)> at;  ///< description of one of them
  };
  virtual void list(const Field& field, const Items& items) = 0;

  /// Rejects the values read unless `ok`: `key` is the place to look at, `message` names the fault and the
  /// values expected.
  virtual void check(bool ok, const char* key, const std::string& message) = 0;
  /// Rejects `key` where it would have no effect.
  virtual void only_when(bool condition, const char* key, const char* when) = 0;

  /// A word of an enumeration.
  template <class E>
  void choice(const Field& field, E& value, std::initializer_list<std::pair<const char*, E>> known) {
    choice(field, value, std::span<const std::pair<const char*, E>>(known.begin(), known.size()));
  }
  template <class E>
  void choice(const Field& field, E& value, std::span<const std::pair<const char*, E>> known) {
    std::vector<std::string> names;
    std::string name;
    for (const auto& [n, e] : known) {
      names.emplace_back(n);
      if (e == value) name = n;
    }
    word(field, name, names);
    for (const auto& [n, e] : known) {
      if (name == n) value = e;
    }
  }
};

/// Declares every field of a scene.
void describe_scene(FieldVisitor& v, Scene& scene);

}  // namespace tactus
