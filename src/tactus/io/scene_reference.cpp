#include <cmath>
#include <ostream>

#include "tactus/base/error.h"
#include "tactus/io/field_visitor.h"
#include "tactus/io/scene_file.h"

namespace tactus {
namespace {

std::string vector_text(Vec3d v) {
  return "[" + number_text(v.x) + ", " + number_text(v.y) + ", " + number_text(v.z) + "]";
}

/// Writes one table per mapping; the tables of inner mappings follow it.
class ReferenceWriter : public FieldVisitor {
 public:
  ReferenceWriter(std::ostream& out, std::string where) : out_(out), where_(std::move(where)) {}

  void write(const Describe& describe) {
    if (!where_.empty()) out_ << "\n## `" << where_ << "`\n";
    out_ << "\n| key | type | default | meaning |\n|---|---|---|---|\n";
    describe(*this);
    for (const auto& [where, inner] : inner_) ReferenceWriter(out_, where).write(inner);
  }

  void text(const Field& f, std::string& value) override { row(f, "text", value); }
  void path(const Field& f, std::string& value) override { row(f, "path", value); }
  void word(const Field& f, std::string& value, std::span<const std::string> known) override {
    std::string type;
    for (const std::string& k : known) type += (type.empty() ? "`" : ", `") + k + "`";
    row(f, type, value);
  }
  void boolean(const Field& f, bool& value) override { row(f, "`true`, `false`", value ? "true" : "false"); }
  void integer(const Field& f, int& value, const Range& range) override {
    row(f, with("whole number", range), std::to_string(value));
  }
  void real(const Field& f, double& value, const Range& range) override {
    row(f, with("number", range), number_text(value));
  }
  void vector(const Field& f, Vec3d& value, const Range& range) override {
    row(f, with("[x, y, z], each", range), vector_text(value));
  }
  void pixel_size(const Field& f, Vec2i& value, const Range& range) override {
    row(f, with("[width, height], each", range),
        "[" + std::to_string(value.x) + ", " + std::to_string(value.y) + "]");
  }
  void frames(const Field& f, FrameRange& value) override { row(f, "range", frame_range_text(value)); }
  void integers(const Field& f, std::vector<int>&, const Range& range) override {
    row(f, with("list of whole numbers", range), "");
  }
  void integer_or_auto(const Field& f, std::optional<int>&, const Range& range,
                       const char* automatic) override {
    row(f, with("whole number", range) + ", or `auto`", "auto", automatic);
  }
  void real_or_auto(const Field& f, std::optional<double>&, const Range& range,
                    const char* automatic) override {
    row(f, with("number", range) + ", or `auto`", "auto", automatic);
  }
  void vector_or_auto(const Field& f, std::optional<Vec3d>&, const Range& range,
                      const char* automatic) override {
    row(f, with("[x, y, z], each", range) + ", or `auto`", "auto", automatic);
  }
  void section(const Field& f, const Describe& describe) override {
    row(f, "mapping", "");
    inner_.emplace_back(path_of(f), describe);
  }
  void list(const Field& f, const Append& append) override {
    row(f, "list of mappings", "");
    inner_.emplace_back(path_of(f) + "[]", append());
  }
  void check(bool, const char*, const std::string&) override {}
  void only_when(bool, const char*, const char*) override {}

 private:
  std::string path_of(const Field& f) const { return where_.empty() ? f.name : where_ + "." + f.name; }

  static std::string with(const std::string& type, const Range& range) {
    const std::string limits = range_text(range);
    return limits.empty() ? type : type + " " + limits;
  }

  void row(const Field& f, const std::string& type, const std::string& value, const char* automatic = "") {
    std::string standard = value.empty() ? "" : "`" + value + "`";
    if (f.presence == Presence::required) standard = "**required**";
    if (*automatic != '\0') standard += ": " + std::string(automatic);
    out_ << "| `" << f.name << "` | " << type << " | " << standard << " | " << f.meaning << " |\n";
  }

  std::ostream& out_;
  std::string where_;
  std::vector<std::pair<std::string, Describe>> inner_;
};

}  // namespace

std::string range_text(const Range& range) {
  std::string text;
  if (std::isfinite(range.min)) text = (range.excludes_min ? "> " : ">= ") + number_text(range.min);
  if (std::isfinite(range.max)) text += (text.empty() ? "<= " : " and <= ") + number_text(range.max);
  if (*range.unit != '\0') text += (text.empty() ? "in " : " ") + std::string(range.unit);
  return text;
}

void write_scene_reference(std::ostream& out) {
  out << "# Scene files\n\n"
         "<!-- Generated from the declaration in src/tactus/io/scene_schema.cpp: change it there. -->\n\n"
         "`tactus run SCENE.yaml` plays a scene: what the cameras see, the soft bodies, how they meet, and "
         "the\n"
         "picture. The file is YAML. Only `source` is required; everything else has the default given here.\n"
         "Units are SI and stand in the key's name; +Y is up. An unknown, duplicate or missing key, a wrong\n"
         "type and a value out of range are refused with file and line.\n"
         "A relative path starts at the scene file's folder; `$TACTUS_DATA` at its start stands for the\n"
         "environment variable. `scenes/` holds examples.\n";
  Scene scene;
  ReferenceWriter(out, "").write([&](FieldVisitor& v) { describe_scene(v, scene); });
}

}  // namespace tactus
