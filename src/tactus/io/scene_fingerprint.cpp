#include "tactus/io/scene_fingerprint.h"

#include <filesystem>
#include <string_view>

#include "tactus/base/byte_io.h"
#include "tactus/io/field_visitor.h"

namespace tactus {
namespace {

/// Hashes the fields that a scene has.
class Fingerprint : public FieldVisitor {
 public:
  const std::vector<KeyFingerprint>& keys() const { return keys_; }

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
    if (depth_ == 0 && (name == "source" || name == "view" || name == "output")) return;
    add(f, "{");
    enter(describe);
    add_end("}");
  }
  void list(const Field& f, const Items& items) override {
    add(f, "[");
    for (std::size_t k = 0; k < items.size(); ++k) {
      enter(items.at(k));
      add_end(",");
    }
    add_end("]");
  }
  void check(bool, const char*, const std::string&) override {}
  void only_when(bool, const char*, const char*) override {}

 private:
  void enter(const Describe& describe) {
    ++depth_;
    describe(*this);
    --depth_;
  }
  void add(const Field& f, std::string_view value) {
    if (depth_ == 0) {
      if (std::string_view(f.name) == "name") return;  // a title
      keys_.push_back({f.name, fnv1a("")});
    }
    add_end(f.name);
    add_end(value);
  }
  void add_end(std::string_view value) { keys_.back().hash = fnv1a(value, keys_.back().hash); }
  void add_number(const Field& f, double x) {
    add(f, std::string_view(reinterpret_cast<const char*>(&x), sizeof x));
  }
  void add_vector(const Field& f, const Vec3d& p) {
    add(f, std::string_view(reinterpret_cast<const char*>(&p), sizeof p));
  }

  std::vector<KeyFingerprint> keys_;
  int depth_ = 0;  ///< 0: fields of the scene itself
};

}  // namespace

std::vector<KeyFingerprint> scene_fingerprint(const Scene& scene) {
  Scene all = scene;  // to describe a scene takes one that may change
  Fingerprint fingerprint;
  describe_scene(fingerprint, all);
  return fingerprint.keys();
}

}  // namespace tactus
