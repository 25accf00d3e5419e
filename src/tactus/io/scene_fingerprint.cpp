#include "tactus/io/scene_fingerprint.h"

#include <filesystem>
#include <string_view>
#include <utility>

#include "tactus/base/byte_io.h"
#include "tactus/io/field_visitor.h"

namespace tactus {
namespace {

/// Hashes the fields that a scene has.
class Fingerprint : public FieldVisitor {
 public:
  std::uint64_t hash() const { return hash_; }

  void text(const Field& f, std::string& value) override { add(f, value); }
  void path(const Field& f, std::string& value) override {
    add(f, std::filesystem::path(value).filename().string());
  }
  void word(const Field& f, std::string& value, std::span<const std::string>) override { add(f, value); }
  void boolean(const Field& f, bool& value) override { add_number(f, value ? 1 : 0); }
  void integer(const Field& f, int& value, const Range&) override { add_number(f, value); }
  void real(const Field& f, double& value, const Range&) override { add_number(f, value); }
  void vector(const Field& f, Vec3d& value, const Range&) override { add_vector(f, value); }
  void pixel_size(const Field& f, Vec2i& value, const Range&) override {
    add_number(f, value.x);
    add_number(f, value.y);
  }
  void frames(const Field&, FrameRange&) override {}  // of a source
  void integers(const Field& f, std::vector<int>& value, const Range&) override {
    for (const int x : value) add_number(f, x);
  }
  void integer_or_auto(const Field& f, std::optional<int>& value, const Range&, const char*) override {
    if (value) add_number(f, *value);
  }
  void real_or_auto(const Field& f, std::optional<double>& value, const Range&, const char*) override {
    if (value) add_number(f, *value);
  }
  void vector_or_auto(const Field& f, std::optional<Vec3d>& value, const Range&, const char*) override {
    if (value) add_vector(f, *value);
  }
  void section(const Field& f, const Describe& describe) override {
    const std::string_view name = f.name;
    if (is_scene_ && (name == "source" || name == "view" || name == "output")) return;
    add(f, "{");
    enter(describe);
    add(f, "}");
  }
  void list(const Field& f, const Items& items) override {
    for (std::size_t k = 0; k < items.size(); ++k) {
      add(f, "[");
      enter(items.at(k));
    }
    add(f, "]");
  }
  void check(bool, const char*, const std::string&) override {}
  void only_when(bool, const char*, const char*) override {}

 private:
  void enter(const Describe& describe) {
    const bool was_scene = std::exchange(is_scene_, false);
    describe(*this);
    is_scene_ = was_scene;
  }
  void add(const Field& f, std::string_view value) {
    if (is_scene_ && std::string_view(f.name) == "name") return;  // a title
    hash_ = fnv1a(value, fnv1a(f.name, hash_));
  }
  void add_number(const Field& f, double x) {
    add(f, std::string_view(reinterpret_cast<const char*>(&x), sizeof x));
  }
  void add_vector(const Field& f, const Vec3d& p) {
    for (int k = 0; k < 3; ++k) add_number(f, p[k]);
  }

  std::uint64_t hash_ = fnv1a("scene");
  bool is_scene_ = true;  ///< not inside one of its parts
};

}  // namespace

std::uint64_t scene_fingerprint(const Scene& scene) {
  Scene all = scene;  // to describe a scene takes one that may change
  Fingerprint fingerprint;
  describe_scene(fingerprint, all);
  return fingerprint.hash();
}

}  // namespace tactus
