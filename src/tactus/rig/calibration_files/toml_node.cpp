#include "tactus/rig/calibration_files/data_node.h"

#ifdef TACTUS_WITH_TOML
#include <toml++/toml.h>

#include <sstream>
#endif

#include "tactus/base/error.h"
#include "tactus/base/foreign_text.h"

namespace tactus {

#ifdef TACTUS_WITH_TOML
namespace {

void convert(const toml::node& from, DataNode& to) {
  if (const toml::table* table = from.as_table()) {
    for (const auto& [key, value] : *table) {
      DataNode child;
      child.file = to.file;
      child.key = std::string(key.str());
      child.path = to.path.empty() ? child.key : to.path + "." + child.key;
      child.line = static_cast<int>(key.source().begin.line);
      convert(value, child);
      to.children.push_back(std::move(child));
    }
  } else if (const toml::array* array = from.as_array()) {
    to.kind = DataNode::Kind::list;
    for (const toml::node& value : *array) {
      DataNode child;
      child.file = to.file;
      child.path = to.path + "[" + std::to_string(to.children.size()) + "]";
      child.line = static_cast<int>(value.source().begin.line);
      convert(value, child);
      to.children.push_back(std::move(child));
    }
  } else {
    to.kind = DataNode::Kind::scalar;
    if (const auto text = from.value<std::string>(); text && from.is_string()) {
      to.text = *text;
    } else {
      std::ostringstream out;
      out.precision(17);
      if (const toml::value<double>* real = from.as_floating_point()) {
        out << real->get();
      } else {
        from.visit([&](const auto& value) { out << value; });
      }
      to.text = out.str();
    }
  }
}

}  // namespace

DataNode parse_toml_data(const std::string& text, const std::string& file) {
  check_foreign_text(text, TextSyntax::json, file);
  DataNode root;
  root.file = file;
  try {
    convert(toml::parse(text), root);
  } catch (const toml::parse_error& e) {
    throw Error(file + ":" + std::to_string(e.source().begin.line) +
                ": not valid TOML: " + std::string(e.description()));
  }
  return root;
}

std::string toml_missing() { return ""; }

#else

DataNode parse_toml_data(const std::string&, const std::string& file) {
  throw Error(file + ": " + toml_missing());
}

std::string toml_missing() {
  return "TOML can't be read: Tactus was built without toml++ (Debian: libtomlplusplus-dev)";
}

#endif

}  // namespace tactus
