#pragma once
/// The tree of a YAML, JSON, TOML or XML file, whichever library read it. Every complaint names file, line
/// (JSON has none) and key.
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// The part of a foreign file's text that stands in a message: at most 16 letters. A rig file may name any
/// file, and a message must not be a way to read it.
std::string excerpt(std::string_view text);

class DataNode {
 public:
  enum class Kind : std::uint8_t { scalar, list, map };
  Kind kind = Kind::map;
  std::string file, path;  ///< path of keys from the root: "cam0.intrinsics[2]"
  std::string key;         ///< the last of them; "" in lists
  std::string text;        ///< of scalars
  int line = 0;            ///< 0: not known
  std::vector<DataNode> children;

  bool is_map() const { return kind == Kind::map; }
  /// The child of this key; nullptr without. The first, where XML repeats it.
  const DataNode* find(const std::string& key) const;
  bool has(const std::string& name) const { return find(name) != nullptr; }
  /// Children of this key, as XML repeats elements.
  std::vector<const DataNode*> all(const std::string& name) const;
  /// @throws Error naming the key and the nearest one there is.
  const DataNode& at(const std::string& name) const;
  /// The first of these keys that is there. @throws Error as at(names.front()).
  const DataNode& at_any(const std::vector<std::string>& names) const;
  const DataNode* find_any(const std::vector<std::string>& names) const;

  /// @throws Error when it is no finite number.
  double number() const;
  int integer(int least, int most) const;
  bool boolean() const;
  /// All numbers in here, nested lists flattened, OpenCV's {rows, cols, data} unwrapped. @throws Error for an
  /// entry that is no finite number.
  std::vector<double> numbers() const;
  /// The same, and exactly so many.
  std::vector<double> numbers(std::size_t count) const;
  /// A 3x3 matrix: nine numbers, row by row.
  Mat3d matrix3() const;
  /// @throws Error "FILE:LINE: 'KEY': REASON".
  [[noreturn]] void fail(const std::string& what) const;
};

/// @throws Error naming file and line: not of this syntax, or beyond the bounds of base/foreign_text.h.
DataNode parse_yaml_data(const std::string& text, const std::string& file);
DataNode parse_json_data(const std::string& text, const std::string& file);
DataNode parse_xml_data(const std::string& text, const std::string& file);
/// @throws Error also where Tactus was built without toml++.
DataNode parse_toml_data(const std::string& text, const std::string& file);
/// Why TOML can't be read by this build; "" when it can.
std::string toml_missing();

}  // namespace tactus
