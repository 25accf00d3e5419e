#pragma once
/// What of a scene may change while it runs.
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace tactus {

class StateArchive;

/// When a new value is seen.
enum class ParameterEffect : std::uint8_t {
  next_frame,   ///< of the simulation
  next_picture  ///< physics knows nothing of it
};
/// "next frame"
const char* effect_text(ParameterEffect effect);

/// A number of the scene, named as its place in the scene file: "gravity_m_s2.y",
/// "bodies.liver.material.young_modulus_pa" (of the body of that name).
struct SceneParameter {
  std::string name;
  std::string unit;     ///< "Pa"; "" for none
  std::string meaning;  ///< docs/scene.md's
  double value = 0;
  double least = 0, most = 0;   ///< infinite where nothing limits it
  bool excludes_least = false;  ///< it must be more than `least`
  ParameterEffect effect = ParameterEffect::next_frame;

  bool allows(double x) const;
  /// "> 0 and <= 1e+09 Pa"
  std::string range_text() const;
};

/// Parameters that may change between two frames. The rest of a scene is built into its bodies and
/// liquid: another value takes another World.
///
///   world.parameters().set("bodies.liver.material.young_modulus_pa", 5000);
class SceneParameters {
 public:
  /// In the scene's order.
  std::span<const SceneParameter> list() const { return list_; }
  /// Those of one effect: viewers with a camera of their own have no use for the pictures'.
  std::vector<SceneParameter> of(ParameterEffect effect) const;
  /// @throws usage Error for a name that isn't there, with the nearest one.
  double get(const std::string& name) const { return list_[find(name)].value; }
  /// Between two frames. @throws usage Error for a name that isn't there, or for a value that the scene file
  /// would not take, either; nothing changed then.
  void set(const std::string& name, double value);

  // For the World.
  using Apply = std::function<void(double)>;
  /// Narrows the range of the parameter that was added last.
  void narrow(double least, double most);
  /// @param name with the names of list entries @param key the schema's
  void add(const std::string& name, const std::string& key, double value, Apply apply,
           ParameterEffect effect = ParameterEffect::next_frame);
  /// Called after each change that physics knows of.
  void when_changed(std::function<void()> changed) { changed_ = std::move(changed); }
  /// Values, those that the file has are set.
  void archive(StateArchive& a);

 private:
  std::size_t find(const std::string& name) const;
  void change(std::size_t k, double value);

  std::vector<SceneParameter> list_;
  std::vector<Apply> apply_;  ///< of each
  std::function<void()> changed_;
};

}  // namespace tactus
