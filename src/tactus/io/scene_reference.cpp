#include <cmath>
#include <ostream>

#include "tactus/base/error.h"
#include "tactus/io/field_visitor.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_source.h"

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
  void list(const Field& f, const Items& items) override {
    row(f, "list of mappings", "");
    inner_.emplace_back(path_of(f) + "[]", items.append());
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

namespace {

std::string box_text(const Box3f& box_m) {
  const auto number = [](float x) {
    return number_text(std::round(static_cast<double>(x) * 1e3) / 1e3 + 0.0);
  };
  const auto side = [&](float low, float high) { return number(low) + " to " + number(high); };
  return side(box_m.min.x, box_m.max.x) + " | " + side(box_m.min.y, box_m.max.y) + " | " +
         side(box_m.min.z, box_m.max.z);
}

/// The built-in rig and the figures that it films, measured: `scale` and `offset_m` start from these boxes.
void write_synthetic_rig(std::ostream& out) {
  const SyntheticRigOptions options;
  const Rig rig = make_synthetic_rig(options);
  out << "\n## The synthetic rig\n\n"
      << "`source: {kind: synthetic}` films a built-in figure with " << rig.cameras.size() << " cameras of "
      << options.width_px << "x" << options.height_px << " pixels,\nin a ring of "
      << number_text(options.ring_radius_m) << " m around the middle of the workspace, at heights of "
      << number_text(options.low_m) << " and " << number_text(options.high_m)
      << " m in turn. Figures stand in the\nworkspace; `scale` sizes them about the point (0, 0.5, 0), and "
         "`offset_m` moves what it gives. A figure that moves\ngoes its way at any scale: at `scale: s` up "
         "to "
         "1 it stays within s times its box plus 1 - s times the box of its\nway. Boxes that hold figures at "
         "`scale: 1` [m], over a whole movement where they move:\n\n"
         "| | x | y | z |\n|---|---|---|---|\n| workspace | "
      << box_text(rig.workspace_m) << " |\n";
  for (const std::string& name : figure_names()) {
    for (const bool moving : {false, true}) {
      const Figure figure = make_figure(name, {.moving = moving});
      if (moving != figure.moving()) continue;
      out << "| `" << name << "`" << (moving ? ", moving" : "") << " | " << box_text(figure.bounds_m())
          << " |\n";
      if (moving) out << "| its way | " << box_text(figure_displacement_m(name)) << " |\n";
    }
  }
}

/// Measured: docs/tissue_verification.md tells how.
void write_models(std::ostream& out) {
  out << R"(
## Which model

Take `flsm`, the default, for what is held and pressed, and for a first try. Take `tled` where forces and shapes
must be right, and for what is cut, stacked, soft and free to roll, or falls fast. Take `hybrid` for a large body
of which a part is cut or must be right. Leave `damping` out: bodies then come to rest as tissue does. Below 0.04
of critical at the slowest sway, what slides flutters, and slides on where it should stand. The figures are those
of a cube of 10 cm and 10 kPa with all defaults, on two cores that were busy with other work, too.

| | `flsm` | `hybrid` 6 : 4 | `tled` |
|---|---|---|---|
| Poisson's ratio, laws, fibres, `relaxation`, cuts | no | in its elements | yes |
| time for 1 s on a slope, 4096 cubes | 1.8 s | 4.4 s | 2.4 s |
| a bar in tension, against its E | -5 to -14 % | | 0.02 % |
| height of the centre at rest; 47 mm by a column's squash | 45.7 mm | 46.9 mm | 47.5 mm |
| slope on which it tips, by statics, where it sticks | 22 degrees | 21 degrees | 25 to 30 degrees |
| stands on 20 degrees with friction 0.4, let go: cubes; blocks half as high | from 30 kPa; 3 kPa | from 30 kPa; 3 kPa | from 10 kPa; 3 kPa |
| the same cubes on an obstacle that slopes, so turned in their lattice | from 30 kPa | from 30 kPa | from 10 kPa with 8 across, 30 kPa with 5 |
| default damping of the slowest sway, of critical, 5 and 8 cubes across | 0.07, 0.05 | 0.11, 0.10 | 0.14, 0.14 |
)";
}

}  // namespace

void write_scene_reference(std::ostream& out) {
  out << "# Scene files\n\n"
         "<!-- Generated from the declaration in src/tactus/io/scene_schema.cpp: change it there. -->\n\n"
         "`tactus run SCENE.yaml` plays a scene: what the cameras see, the soft bodies, how they meet, and "
         "the\n"
         "picture. The file is YAML. Only `source` is required; everything else has the default given here.\n"
         "Units are SI and stand in the key's name; +Y is up. An unknown, duplicate or missing key, a wrong\n"
         "type and a value out of range are refused with file and line.\n"
         "A relative path starts at the scene file's folder; `$TACTUS_DATA` at its start stands for the\n"
         "environment variable. `scenes/` holds examples, and [first_scene.md](first_scene.md) makes one.\n\n"
         "Bodies touch the real surface, `obstacles` and one another, and themselves where `contact.self` is "
         "set.\n"
         "They pass through the floor of the picture, which is only drawn. Hold what shall not fall with "
         "`fixed`.\n";
  Scene scene;
  ReferenceWriter(out, "").write([&](FieldVisitor& v) { describe_scene(v, scene); });
  write_models(out);
  write_synthetic_rig(out);
}

}  // namespace tactus
