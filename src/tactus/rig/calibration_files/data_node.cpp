#include "tactus/rig/calibration_files/data_node.h"

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tactus/base/error.h"
#include "tactus/base/foreign_text.h"
#include "tactus/rig/yaml_document.h"

namespace tactus {

std::string excerpt(std::string_view text) {
  constexpr std::size_t kMost = 16;
  return "'" + std::string(text.substr(0, kMost)) + (text.size() > kMost ? "..." : "") + "'";
}

namespace {

/// "1.5", "1.", "+2", "1e-3"; NaN for any other text and for numbers that aren't finite.
double parse_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && std::isfinite(value) ? value : std::nan("");
}

DataNode make_child(const DataNode& parent, std::string key, int line) {
  DataNode child;
  child.file = parent.file;
  child.path = key.empty() ? parent.path + "[" + std::to_string(parent.children.size()) + "]"
                           : (parent.path.empty() ? key : parent.path + "." + key);
  child.key = std::move(key);
  child.line = line;
  return child;
}

void convert(const YAML::Node& from, DataNode& to) {
  if (from.IsScalar()) {
    to.kind = DataNode::Kind::scalar;
    to.text = from.Scalar();
  } else if (from.IsSequence()) {
    to.kind = DataNode::Kind::list;
    for (const YAML::Node& entry : from) {
      DataNode child = make_child(to, "", entry.Mark().line + 1);
      convert(entry, child);
      to.children.push_back(std::move(child));
    }
  } else if (from.IsMap()) {
    for (const auto& entry : from) {
      DataNode child =
          make_child(to, entry.first.IsScalar() ? entry.first.Scalar() : "?", entry.first.Mark().line + 1);
      convert(entry.second, child);
      to.children.push_back(std::move(child));
    }
  }
}

void convert(const nlohmann::json& from, DataNode& to) {
  if (from.is_object()) {
    for (const auto& [key, value] : from.items()) {
      DataNode child = make_child(to, key, 0);
      convert(value, child);
      to.children.push_back(std::move(child));
    }
  } else if (from.is_array()) {
    to.kind = DataNode::Kind::list;
    for (const nlohmann::json& value : from) {
      DataNode child = make_child(to, "", 0);
      convert(value, child);
      to.children.push_back(std::move(child));
    }
  } else {
    to.kind = DataNode::Kind::scalar;
    to.text = from.is_string() ? from.get<std::string>() : from.dump();
  }
}

/// The part of a node that stands in a message. A text that is all of a file is of no calibration, so nothing
/// of it is shown.
std::string shown(const DataNode& node) {
  if (node.kind == DataNode::Kind::list) return "a list";
  if (node.kind == DataNode::Kind::map) return "a mapping";
  return node.path.empty() && node.key.empty() ? "a text" : excerpt(node.text);
}

void add_numbers(const DataNode& node, std::vector<double>& values) {
  if (node.kind == DataNode::Kind::list) {
    for (const DataNode& child : node.children) add_numbers(child, values);
  } else if (node.kind == DataNode::Kind::map) {
    if (!node.has("data")) node.fail("a mapping, expected numbers");
    add_numbers(node.at("data"), values);
  } else {
    constexpr const char* kSpace = " \t\r\n";
    std::size_t begin = node.text.find_first_not_of(kSpace);
    if (begin == std::string::npos) node.fail("nothing, expected a number");
    while (begin != std::string::npos) {
      const std::size_t end = std::min(node.text.find_first_of(kSpace, begin), node.text.size());
      const std::string word = node.text.substr(begin, end - begin);
      values.push_back(parse_number(word));
      if (std::isnan(values.back()))
        node.fail((word.empty() ? "nothing" : excerpt(word)) + ", expected a finite number");
      begin = node.text.find_first_not_of(kSpace, end);
    }
  }
}

}  // namespace

const DataNode* DataNode::find(const std::string& name) const {
  if (kind != Kind::map) return nullptr;
  for (const DataNode& child : children) {
    if (child.key == name) return &child;
  }
  return nullptr;
}

std::vector<const DataNode*> DataNode::all(const std::string& name) const {
  std::vector<const DataNode*> found;
  for (const DataNode& child : children) {
    if (kind == Kind::map && child.key == name) found.push_back(&child);
  }
  return found;
}

const DataNode* DataNode::find_any(const std::vector<std::string>& names) const {
  for (const std::string& name : names) {
    if (const DataNode* found = find(name)) return found;
  }
  return nullptr;
}

const DataNode& DataNode::at(const std::string& name) const { return at_any({name}); }

const DataNode& DataNode::at_any(const std::vector<std::string>& names) const {
  if (const DataNode* found = find_any(names)) return *found;
  if (kind != Kind::map) fail(shown(*this) + ", expected a mapping with '" + names.front() + "'");
  std::vector<std::string> known;
  for (const DataNode& child : children) known.push_back(child.key);
  const std::string place = file + (line > 0 ? ":" + std::to_string(line) : "") + ": ";
  throw Error(place + (path.empty() ? "no '" : "'" + path + "' has no '") + names.front() + "'" +
              (known.empty() ? "; there is nothing in it" : suggestion(names.front(), known)));
}

double DataNode::number() const {
  if (kind != Kind::scalar) fail(shown(*this) + ", expected a number");
  const double value = parse_number(text);
  if (std::isnan(value)) fail(shown(*this) + ", expected a finite number");
  return value;
}

int DataNode::integer(int least, int most) const {
  const double value = number();
  if (value != std::floor(value) || value < least || value > most) {
    fail(shown(*this) + ", expected a whole number from " + std::to_string(least) + " to " +
         std::to_string(most));
  }
  return static_cast<int>(value);
}

bool DataNode::boolean() const {
  if (text == "true" || text == "1") return true;
  if (text != "false" && text != "0") fail(shown(*this) + ", expected true or false");
  return false;
}

std::vector<double> DataNode::numbers() const {
  std::vector<double> values;
  add_numbers(*this, values);
  if (has("data") && has("rows") && has("cols")) {
    const int rows = at("rows").integer(0, 1 << 20), columns = at("cols").integer(0, 1 << 20);
    if (static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns) != values.size()) {
      fail("holds " + std::to_string(values.size()) + " numbers, expected " + std::to_string(rows) + "x" +
           std::to_string(columns));
    }
  }
  return values;
}

std::vector<double> DataNode::numbers(std::size_t count) const {
  std::vector<double> values = numbers();
  if (values.size() != count)
    fail("holds " + std::to_string(values.size()) + " numbers, expected " + std::to_string(count));
  return values;
}

Mat3d DataNode::matrix3() const {
  const std::vector<double> v = numbers(9);
  return {{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]}}};
}

void DataNode::fail(const std::string& what) const {
  throw Error(file + (line > 0 ? ":" + std::to_string(line) : "") + ": " +
              (path.empty() ? "" : "'" + path + "': ") + what);
}

DataNode parse_yaml_data(const std::string& text, const std::string& file) {
  // OpenCV begins with "%YAML:1.0", which is no YAML; as a comment it keeps the numbers of the lines.
  std::string plain = text;
  if (plain.starts_with("%YAML")) plain[0] = '#';
  DataNode root;
  root.file = file;
  try {
    convert(parse_yaml(plain, file), root);
  } catch (const YAML::Exception& e) {
    throw Error(file + ": not valid YAML: " + e.msg);
  } catch (const Error& e) {
    throw Error(e.what());  // a damaged file is no wrong usage
  }
  return root;
}

DataNode parse_json_data(const std::string& text, const std::string& file) {
  check_foreign_text(text, TextSyntax::json, file);
  DataNode root;
  root.file = file;
  try {
    convert(nlohmann::json::parse(text), root);
  } catch (const nlohmann::json::parse_error& e) {
    const auto at = std::min(e.byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw Error(file + ":" + std::to_string(line) + ": not valid JSON" +
                (at == text.size() ? "; the file ends too early" : ""));
  } catch (const nlohmann::json::exception& e) {  // a number that no double holds
    throw Error(file + ": not valid JSON: " + e.what());
  }
  return root;
}

}  // namespace tactus
