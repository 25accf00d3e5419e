#include "tactus/rig/yaml_reader.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/rig/yaml_document.h"

namespace tactus {
namespace {

std::string place(const std::string& file, const YAML::Mark& mark) {
  return file + ":" + std::to_string(mark.line + 1) + ": ";
}

}  // namespace

YamlMapping::YamlMapping(const YAML::Node& node, std::string file, const std::vector<std::string>& known)
    : node_(node), file_(std::move(file)) {
  if (!node_.IsMap()) throw usage_error(place(file_, node_.Mark()) + "expected a mapping (key: value)");
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) {
      throw usage_error(place(file_, entry.first.Mark()) + "a key must be a word");
    }
    const std::string& key = entry.first.Scalar();
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      throw usage_error(place(file_, entry.first.Mark()) + "unknown key '" + key + "'" +
                        suggestion(key, known));
    }
    if (!seen.insert(key).second) {
      throw usage_error(place(file_, entry.first.Mark()) + "key '" + key + "' stands here a second time");
    }
  }
}

YamlMapping YamlMapping::load(const std::string& file, const std::vector<std::string>& known) {
  const YAML::Node node = load_yaml(file);
  if (node.IsNull()) throw usage_error(file + ":1: the file is empty, expected keys such as 'cameras'");
  return {node, file, known};
}

void YamlMapping::fail(const std::string& key, const std::string& what) const {
  const YAML::Node value = node_[key];
  throw usage_error(place(file_, value.IsDefined() ? value.Mark() : node_.Mark()) + "'" + key +
                    "': " + printable(what));
}

bool YamlMapping::has(const std::string& key) const { return node_[key].IsDefined(); }

YAML::Node YamlMapping::required(const std::string& key) const {
  const YAML::Node value = node_[key];
  if (!value.IsDefined()) fail(key, "is missing");
  return value;
}

std::string YamlMapping::text(const std::string& key) const {
  const YAML::Node value = required(key);
  if (!value.IsScalar() || value.Scalar().empty()) fail(key, "expected a text");
  for (const char c : value.Scalar()) {  // a zero byte would cut a path
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      fail(key, "'" + value.Scalar() + "', expected a text without control characters");
  }
  return value.Scalar();
}

std::string YamlMapping::text(const std::string& key, const std::string& otherwise) const {
  return has(key) ? text(key) : otherwise;
}

double YamlMapping::finite(const YAML::Node& node, const std::string& key) const {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    fail(key,
         (node.IsScalar() ? "'" + node.Scalar() + "'" : "a list or mapping") + ", expected a finite number");
  }
  return value;
}

double YamlMapping::number(const std::string& key, double least, double most) const {
  const double value = finite(required(key), key);
  if (value < least || value > most) {
    fail(key, number_text(value, value < least ? least : most) + ", expected " + number_text(least) + " to " +
                  number_text(most));
  }
  return value;
}

double YamlMapping::number(const std::string& key, double least, double most, double otherwise) const {
  return has(key) ? number(key, least, most) : otherwise;
}

int YamlMapping::integer(const std::string& key, int least, int most, int otherwise) const {
  const double value = number(key, least, most, otherwise);
  if (value != std::floor(value)) fail(key, number_text(value) + ", expected a whole number");
  return static_cast<int>(value);
}

std::vector<double> YamlMapping::numbers(const std::string& key, std::size_t count) const {
  const YAML::Node list = required(key);
  if (!list.IsSequence() || list.size() != count) {
    fail(key, "expected a list of " + std::to_string(count) + " numbers");
  }
  std::vector<double> values;
  for (const auto& entry : list) values.push_back(finite(entry, key));
  return values;
}

YamlMapping YamlMapping::child(const std::string& key, const std::vector<std::string>& known) const {
  return {required(key), file_, known};
}

std::vector<YamlMapping> YamlMapping::children(const std::string& key,
                                               const std::vector<std::string>& known) const {
  const YAML::Node list = required(key);
  if (!list.IsSequence()) fail(key, "expected a list");
  std::vector<YamlMapping> result;
  for (const auto& entry : list) result.emplace_back(entry, file_, known);
  return result;
}

}  // namespace tactus
