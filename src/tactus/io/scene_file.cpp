#include "tactus/io/scene_file.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/printable.h"
#include "tactus/base/read_file.h"
#include "tactus/io/field_visitor.h"
#include "tactus/rig/yaml_document.h"

namespace tactus {
namespace {

/// Spellings of keys from before they got the field's term. They still work, with a warning.
struct OldKey {
  std::string_view was, name;
};
constexpr OldKey kOldKeys[] = {{"cut_room", "cut_capacity"}};

/// The present spelling of a key.
std::string present_key(const std::string& key) {
  for (const OldKey& old : kOldKeys) {
    if (old.was == key) return std::string(old.name);
  }
  return key;
}

/// Learns the keys of one mapping; reads nothing.
class KeyCollector : public FieldVisitor {
 public:
  struct Key {
    std::string name, meaning;
    bool required;
  };
  std::vector<Key> keys;

  void text(const Field& f, std::string&) override { add(f); }
  void path(const Field& f, std::string&) override { add(f); }
  void word(const Field& f, std::string&, std::span<const std::string>) override { add(f); }
  void boolean(const Field& f, bool&) override { add(f); }
  void integer(const Field& f, int&, const Range&) override { add(f); }
  void real(const Field& f, double&, const Range&) override { add(f); }
  void vector(const Field& f, Vec3d&, const Range&) override { add(f); }
  void pixel_size(const Field& f, Vec2i&, const Range&) override { add(f); }
  void frames(const Field& f, FrameRange&) override { add(f); }
  void integers(const Field& f, std::vector<int>&, const Range&) override { add(f); }
  void integer_or_auto(const Field& f, std::optional<int>&, const Range&, const char*) override { add(f); }
  void real_or_auto(const Field& f, std::optional<double>&, const Range&, const char*) override { add(f); }
  void vector_or_auto(const Field& f, std::optional<Vec3d>&, const Range&, const char*) override { add(f); }
  void section(const Field& f, const Describe&) override { add(f); }
  void list(const Field& f, const Items&) override { add(f); }
  void check(bool, const char*, const std::string&) override {}
  void only_when(bool, const char*, const char*) override {}

 private:
  void add(const Field& f) { keys.push_back({f.name, f.meaning, f.presence == Presence::required}); }
};

std::string value_text(const YAML::Node& node) {
  if (node.IsNull()) return "empty";
  if (node.IsMap()) return "a mapping";
  if (node.IsSequence()) return "a list of " + std::to_string(node.size());
  return "'" + node.Scalar() + "'";
}

/// A zero byte would cut a path, an escape would steer the terminal that shows a name.
bool has_control_characters(std::string_view text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

template <class T>
std::optional<T> parse_number(const YAML::Node& node) {
  if (!node.IsScalar() || node.Tag() == "!") return {};  // "!": quoted, a text
  std::string_view s = node.Scalar();
  if (s.size() > 1 && s.front() == '+' && s[1] != '-') s.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (error != std::errc{} || end != s.data() + s.size()) return {};
  return value;
}

/// Reads the values of one mapping.
class MappingReader : public FieldVisitor {
 public:
  /// `where` is the mapping's place in the file ("bodies[0].shape"), "" at the top.
  MappingReader(const std::string& file, std::string where, const YAML::Node& mapping, int line)
      : file_(file), where_(std::move(where)), mapping_(mapping), line_(line) {}

  void read(const Describe& describe) {
    check_keys(describe);
    describe(*this);
  }

  void text(const Field& f, std::string& value) override {
    if (const YAML::Node node = find(f)) {
      if (!node.IsScalar() || node.Scalar().empty()) reject(f, node, "a text");
      if (has_control_characters(node.Scalar())) reject(f, node, "a text without control characters");
      value = node.Scalar();
    }
  }

  void path(const Field& f, std::string& value) override {
    static const std::string kData = "$TACTUS_DATA";
    const YAML::Node node = find(f);
    if (!node) return;
    if (!node.IsScalar() || node.Scalar().empty()) reject(f, node, "a path");
    if (has_control_characters(node.Scalar())) reject(f, node, "a path without control characters");
    std::string p = node.Scalar();
    if (p.starts_with(kData)) {
      const char* folder = std::getenv("TACTUS_DATA");
      if (folder == nullptr || *folder == '\0')
        fail(line_of(f.name),
             name_of(f) + " is '" + p + "', but the environment variable TACTUS_DATA is not set");
      p = folder + p.substr(kData.size());
    }
    const std::filesystem::path folder = std::filesystem::path(file_).parent_path();
    value = (folder / p).lexically_normal().string();  // an absolute p replaces the folder
  }

  void word(const Field& f, std::string& value, std::span<const std::string> known) override {
    const YAML::Node node = find(f);
    if (!node) return;
    if (node.IsScalar()) {
      for (const std::string& k : known) {
        if (k == node.Scalar()) {
          value = k;
          return;
        }
      }
    }
    std::string list;
    for (const std::string& k : known) list += (list.empty() ? "" : ", ") + k;
    const std::string near = node.IsScalar() ? nearest_spelling(node.Scalar(), known) : "";
    fail(line_of(f.name), name_of(f) + " is " + value_text(node) + ", expected one of: " + list +
                              (near.empty() ? "" : "; did you mean '" + near + "'?"));
  }

  void boolean(const Field& f, bool& value) override {
    const YAML::Node node = find(f);
    if (!node) return;
    const std::string s = node.IsScalar() ? node.Scalar() : "";
    if (s != "true" && s != "false") reject(f, node, "true or false");
    value = s == "true";
  }

  void integer(const Field& f, int& value, const Range& range) override {
    if (const YAML::Node node = find(f)) value = checked_integer(f, node, range, "");
  }
  void real(const Field& f, double& value, const Range& range) override {
    if (const YAML::Node node = find(f)) value = checked_real(f, node, range, "");
  }
  void integer_or_auto(const Field& f, std::optional<int>& value, const Range& range, const char*) override {
    const YAML::Node node = find(f);
    if (node && !is_auto(node)) value = checked_integer(f, node, range, " or auto");
  }
  void real_or_auto(const Field& f, std::optional<double>& value, const Range& range, const char*) override {
    const YAML::Node node = find(f);
    if (node && !is_auto(node)) value = checked_real(f, node, range, " or auto");
  }
  void vector(const Field& f, Vec3d& value, const Range& range) override {
    if (const YAML::Node node = find(f)) value = checked_vector(f, node, range, "");
  }
  void vector_or_auto(const Field& f, std::optional<Vec3d>& value, const Range& range, const char*) override {
    const YAML::Node node = find(f);
    if (node && !is_auto(node)) value = checked_vector(f, node, range, " or auto");
  }

  void pixel_size(const Field& f, Vec2i& value, const Range& range) override {
    const YAML::Node node = find(f);
    if (!node) return;
    if (!node.IsSequence() || node.size() != 2) reject(f, node, "[width, height], whole numbers");
    value = {checked_integer(f, node[0], range, ""), checked_integer(f, node[1], range, "")};
  }

  void frames(const Field& f, FrameRange& value) override {
    const YAML::Node node = find(f);
    if (!node) return;
    const std::optional<FrameRange> range =
        node.IsScalar() ? parse_frame_range(node.Scalar()) : std::optional<FrameRange>{};
    if (!range) reject(f, node, "A-B with 0 <= A <= B, or A- to the end");
    value = *range;
  }

  void integers(const Field& f, std::vector<int>& value, const Range& range) override {
    const YAML::Node node = find(f);
    if (!node) return;
    if (!node.IsSequence() || node.size() == 0) reject(f, node, "a list of whole numbers");
    value.clear();
    for (const YAML::Node& item : node) value.push_back(checked_integer(f, item, range, ""));
  }

  void section(const Field& f, const Describe& describe) override {
    const YAML::Node node = find(f);
    if (!node) return;
    if (!node.IsMap()) reject(f, node, "a mapping of keys");
    MappingReader(file_, path_of(f), node, line_of(f.name)).read(describe);
  }

  void list(const Field& f, const Items& items) override {
    const YAML::Node node = find(f);
    if (!node) return;
    if (!node.IsSequence()) reject(f, node, "a list (each element starts with '- ')");
    for (std::size_t i = 0; i < node.size(); ++i) {
      const std::string where = path_of(f) + "[" + std::to_string(i) + "]";
      const YAML::Node item = node[i];
      const int line = item.IsNull() ? line_of(f.name) : item.Mark().line + 1;
      if (!item.IsMap())
        fail(line, "'" + where + "' is " + value_text(item) + ", expected a mapping of keys");
      MappingReader(file_, where, item, line).read(items.append());
    }
  }

  void check(bool ok, const char* key, const std::string& message) override {
    if (!ok) fail(line_of(key), (where_.empty() ? "" : "in '" + where_ + "': ") + message);
  }
  void only_when(bool condition, const char* key, const char* when) override {
    if (!condition && find(key))
      fail(line_of(key),
           "'" + std::string(key) + "' in '" + where_ + "' has no effect, it is for when " + when);
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const {
    throw usage_error(file_ + ":" + std::to_string(line) + ": " + printable(message));
  }
  [[noreturn]] void reject(const Field& f, const YAML::Node& node, const std::string& expected) const {
    const int line = node.IsNull() ? line_of(f.name) : node.Mark().line + 1;
    fail(line, name_of(f) + " is " + value_text(node) + ", expected " + expected);
  }

  std::string path_of(const Field& f) const { return where_.empty() ? f.name : where_ + "." + f.name; }
  std::string name_of(const Field& f) const { return "'" + path_of(f) + "'"; }
  static bool is_auto(const YAML::Node& node) { return node.IsScalar() && node.Scalar() == "auto"; }

  YAML::Node find(const Field& f) const { return find(f.name); }
  /// By its present spelling.
  YAML::Node find(const std::string& key) const {
    for (const auto& entry : mapping_) {
      if (entry.first.IsScalar() && present_key(entry.first.Scalar()) == key) return entry.second;
    }
    return YAML::Node(YAML::NodeType::Undefined);
  }
  /// Line of a key, or of the mapping when it isn't there.
  int line_of(const char* key) const {
    for (const auto& entry : mapping_) {
      if (entry.first.IsScalar() && present_key(entry.first.Scalar()) == key)
        return entry.first.Mark().line + 1;
    }
    return line_;
  }

  /// Duplicate, unknown and missing keys, the first in the file's order.
  void check_keys(const Describe& describe) const {
    KeyCollector collector;
    describe(collector);
    std::vector<std::string> names;
    for (const KeyCollector::Key& key : collector.keys) names.push_back(key.name);
    const std::string place = where_.empty() ? "" : " in '" + where_ + "'";
    std::set<std::string> seen;
    for (const auto& entry : mapping_) {
      const int line = entry.first.Mark().line + 1;
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : value_text(entry.first);
      const std::string present = present_key(key);
      if (!seen.insert(present).second) fail(line, "duplicate key '" + key + "'" + place);
      if (std::find(names.begin(), names.end(), present) == names.end())
        fail(line, "unknown key '" + key + "'" + place + suggestion(key, names));
      if (present != key)
        log_warning(file_ + ":" + std::to_string(line) + ": '" + key + "'" + place + " is now spelt '" +
                    present + "'");
    }
    for (const KeyCollector::Key& key : collector.keys) {
      if (key.required && !seen.contains(key.name))
        fail(line_, (where_.empty() ? "the scene" : "'" + where_ + "'") + " lacks the required key '" +
                        key.name + "': " + key.meaning);
    }
  }

  int checked_integer(const Field& f, const YAML::Node& node, const Range& range, const char* or_auto) const {
    const std::optional<int> value = parse_number<int>(node);
    if (!value || !range.contains(*value)) reject(f, node, expected("a whole number", range) + or_auto);
    return *value;
  }
  double checked_real(const Field& f, const YAML::Node& node, const Range& range, const char* or_auto) const {
    const std::optional<double> value = parse_number<double>(node);
    if (!value || !std::isfinite(*value) || !range.contains(*value))
      reject(f, node, expected("a number", range) + or_auto);
    return *value;
  }
  Vec3d checked_vector(const Field& f, const YAML::Node& node, const Range& range,
                       const char* or_auto) const {
    if (!node.IsSequence() || node.size() != 3) reject(f, node, std::string("[x, y, z]") + or_auto);
    Vec3d value;
    for (int i = 0; i < 3; ++i) value[i] = checked_real(f, node[static_cast<std::size_t>(i)], range, "");
    return value;
  }
  static std::string expected(const std::string& what, const Range& range) {
    const std::string limits = range_text(range);
    return limits.empty() ? what : what + " " + limits;
  }

  const std::string& file_;
  std::string where_;
  YAML::Node mapping_;
  int line_;
};

}  // namespace

Scene parse_scene(const std::string& text, const std::string& path) {
  const YAML::Node root = parse_yaml(text, path);
  if (!root.IsMap()) {
    throw usage_error(path + ":1: the file is " + value_text(root) +
                      ", expected a mapping of keys such as 'source:' and 'bodies:'");
  }
  Scene scene;
  scene.name = std::filesystem::path(path).stem().string();
  MappingReader(path, "", root, 1).read([&](FieldVisitor& v) { describe_scene(v, scene); });
  return scene;
}

Scene read_scene(const std::string& path) { return parse_scene(read_text(path, kMaxYamlBytes), path); }

}  // namespace tactus
