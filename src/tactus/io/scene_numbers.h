#pragma once
/// The numbers of a scene file as its schema knows them, for whatever changes them while a scene runs.
#include <string>
#include <vector>

namespace tactus {

/// A key that takes a number, or each number of a vector.
struct SceneNumber {
  std::string key;   ///< "bodies[].material.young_modulus_pa"
  std::string unit;  ///< "Pa"; "" for none
  std::string meaning;
  double least = 0, most = 0;  ///< infinite where nothing limits it
  bool excludes_least = false;

  bool allows(double x) const { return (excludes_least ? x > least : x >= least) && x <= most; }
  /// "> 0 and <= 1e9 Pa"
  std::string range_text() const;
};

/// All of them, in the order of docs/scene.md.
const std::vector<SceneNumber>& scene_numbers();
/// @throws Error for a key that isn't one of them.
const SceneNumber& scene_number(const std::string& key);

}  // namespace tactus
