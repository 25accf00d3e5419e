#include "tactus/io/scene_numbers.h"

#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/io/field_visitor.h"

namespace tactus {
namespace {

Range range_of(const SceneNumber& n) { return {n.unit.c_str(), n.least, n.most, n.excludes_least}; }

/// Notes the numbers of a scene's declaration; reads nothing.
class NumberCollector : public FieldVisitor {
 public:
  NumberCollector(std::vector<SceneNumber>& found, std::string where)
      : found_(found), where_(std::move(where)) {}

  void text(const Field&, std::string&) override {}
  void path(const Field&, std::string&) override {}
  void word(const Field&, std::string&, std::span<const std::string>) override {}
  void boolean(const Field&, bool&) override {}
  void integer(const Field&, int&, const Range&) override {}
  void real(const Field& f, double&, const Range& range) override { add(f, range); }
  void vector(const Field& f, Vec3d&, const Range& range) override { add(f, range); }
  void pixel_size(const Field&, Vec2i&, const Range&) override {}
  void frames(const Field&, FrameRange&) override {}
  void integers(const Field&, std::vector<int>&, const Range&) override {}
  void integer_or_auto(const Field&, std::optional<int>&, const Range&, const char*) override {}
  void real_or_auto(const Field& f, std::optional<double>&, const Range& range, const char*) override {
    add(f, range);
  }
  void vector_or_auto(const Field& f, std::optional<Vec3d>&, const Range& range, const char*) override {
    add(f, range);
  }
  void section(const Field& f, const Describe& describe) override {
    NumberCollector inside(found_, where_ + f.name + ".");
    describe(inside);
  }
  void list(const Field& f, const Items& items) override {
    NumberCollector inside(found_, where_ + f.name + "[].");
    items.append()(inside);
  }
  void check(bool, const char*, const std::string&) override {}
  void only_when(bool, const char*, const char*) override {}

 private:
  void add(const Field& f, const Range& range) {
    found_.push_back({where_ + f.name, range.unit, f.meaning, range.min, range.max, range.excludes_min});
  }

  std::vector<SceneNumber>& found_;
  std::string where_;
};

}  // namespace

std::string SceneNumber::range_text() const { return tactus::range_text(range_of(*this)); }

const std::vector<SceneNumber>& scene_numbers() {
  static const std::vector<SceneNumber> all = [] {
    std::vector<SceneNumber> found;
    Scene scene;
    NumberCollector collector(found, "");
    describe_scene(collector, scene);
    return found;
  }();
  return all;
}

const SceneNumber& scene_number(const std::string& key) {
  const std::vector<SceneNumber>& all = scene_numbers();
  const auto at = std::find_if(all.begin(), all.end(), [&](const SceneNumber& n) { return n.key == key; });
  if (at == all.end()) throw Error("a scene has no number '" + key + "'");
  return *at;
}

}  // namespace tactus
