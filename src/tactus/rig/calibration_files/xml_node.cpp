#include <algorithm>
#include <pugixml.hpp>

#include "tactus/base/error.h"
#include "tactus/base/foreign_text.h"
#include "tactus/rig/calibration_files/data_node.h"

namespace tactus {
namespace {

class Converter {
 public:
  Converter(const std::string& text, std::string file) : text_(text), file_(std::move(file)) {}

  /// Elements become keys, attributes too; an element with text alone is a scalar.
  void convert(const pugi::xml_node& from, DataNode& to) {
    to.file = file_;
    for (const pugi::xml_attribute& attribute : from.attributes()) {
      DataNode& child = add(to, attribute.name(), to.line);
      child.kind = DataNode::Kind::scalar;
      child.text = attribute.value();
    }
    bool has_elements = false;
    for (const pugi::xml_node& element : from.children()) {
      if (element.type() != pugi::node_element) continue;
      has_elements = true;
      DataNode child;
      name(child, to, element.name(), line_of(element.offset_debug()));
      convert(element, child);
      to.children.push_back(std::move(child));
    }
    if (has_elements || !to.children.empty() || to.path.empty()) return;
    to.kind = DataNode::Kind::scalar;
    to.text = from.child_value();
  }

 private:
  void name(DataNode& child, const DataNode& parent, const char* key, int line) const {
    child.file = file_;
    child.key = key;
    child.path = parent.path.empty() ? key : parent.path + "." + key;
    child.line = line;
  }
  DataNode& add(DataNode& parent, const char* key, int line) const {
    parent.children.emplace_back();
    name(parent.children.back(), parent, key, line);
    return parent.children.back();
  }
  /// Elements come in the order of the text, so lines are counted once.
  int line_of(std::ptrdiff_t offset) {
    const std::ptrdiff_t at =
        std::clamp<std::ptrdiff_t>(offset, counted_, static_cast<std::ptrdiff_t>(text_.size()));
    line_ += static_cast<int>(std::count(text_.begin() + counted_, text_.begin() + at, '\n'));
    counted_ = at;
    return line_;
  }
  const std::string& text_;
  std::string file_;
  std::ptrdiff_t counted_ = 0;
  int line_ = 1;
};

}  // namespace

DataNode parse_xml_data(const std::string& text, const std::string& file) {
  check_foreign_text(text, TextSyntax::xml, file);
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
  if (!result) {
    const auto at = std::clamp<std::ptrdiff_t>(result.offset, 0, static_cast<std::ptrdiff_t>(text.size()));
    throw Error(file + ":" + std::to_string(1 + std::count(text.begin(), text.begin() + at, '\n')) +
                ": not valid XML: " + result.description());
  }
  DataNode root;
  Converter(text, file).convert(document, root);
  return root;
}

}  // namespace tactus
