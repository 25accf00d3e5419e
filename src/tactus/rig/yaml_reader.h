#pragma once
/// A YAML mapping whose keys, types and ranges are checked; every message names file and line.
#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

namespace tactus {

class YamlMapping {
 public:
  /// @throws usage Error: not a mapping, a key that is not in `known` (with the nearest one), a key twice.
  YamlMapping(const YAML::Node& node, std::string file, const std::vector<std::string>& known);
  /// Reads a whole file. @throws Error when it can't be read or isn't YAML.
  static YamlMapping load(const std::string& file, const std::vector<std::string>& known);

  bool has(const std::string& key) const;
  std::string text(const std::string& key) const;
  std::string text(const std::string& key, const std::string& otherwise) const;
  /// A finite number in [least, most].
  double number(const std::string& key, double least, double most) const;
  double number(const std::string& key, double least, double most, double otherwise) const;
  int integer(const std::string& key, int least, int most, int otherwise) const;
  /// Exactly `count` finite numbers.
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  YamlMapping child(const std::string& key, const std::vector<std::string>& known) const;
  std::vector<YamlMapping> children(const std::string& key, const std::vector<std::string>& known) const;
  /// @throws usage Error "FILE:LINE: 'KEY': REASON".
  [[noreturn]] void fail(const std::string& key, const std::string& what) const;

 private:
  YAML::Node required(const std::string& key) const;
  double finite(const YAML::Node& node, const std::string& key) const;
  YAML::Node node_;
  std::string file_;
};

}  // namespace tactus
