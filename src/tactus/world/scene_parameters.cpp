#include "tactus/world/scene_parameters.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/frame/state_archive.h"
#include "tactus/io/scene_numbers.h"

namespace tactus {
namespace {

std::string last_part(const std::string& name) { return name.substr(name.find_last_of('.') + 1); }

SceneNumber number_of(const SceneParameter& p) {
  return {p.name, p.unit, p.meaning, p.least, p.most, p.excludes_least};
}

}  // namespace

bool SceneParameter::allows(double x) const { return std::isfinite(x) && number_of(*this).allows(x); }

std::string SceneParameter::range_text() const { return number_of(*this).range_text(); }

const char* effect_text(ParameterEffect effect) {
  return effect == ParameterEffect::next_picture ? "next picture" : "next frame";
}

void SceneParameters::add(const std::string& name, const std::string& key, double value, Apply apply,
                          ParameterEffect effect) {
  const SceneNumber& number = scene_number(key);
  list_.push_back(
      {name, number.unit, number.meaning, value, number.least, number.most, number.excludes_least, effect});
  apply_.push_back(std::move(apply));
}

std::vector<SceneParameter> SceneParameters::of(ParameterEffect effect) const {
  std::vector<SceneParameter> some;
  for (const SceneParameter& p : list_)
    if (p.effect == effect) some.push_back(p);
  return some;
}

void SceneParameters::narrow(double least, double most) {
  SceneParameter& p = list_.back();
  if (least > p.least) p.least = least, p.excludes_least = false;
  p.most = std::min(p.most, most);
}

std::size_t SceneParameters::find(const std::string& name) const {
  const auto at =
      std::find_if(list_.begin(), list_.end(), [&](const SceneParameter& p) { return p.name == name; });
  if (at != list_.end()) return static_cast<std::size_t>(at - list_.begin());
  std::vector<std::string> names;
  for (const SceneParameter& p : list_) names.push_back(p.name);
  const std::vector<SceneNumber>& all = scene_numbers();
  const bool is_built_in =
      nearest_spelling(name, names).empty() && std::any_of(all.begin(), all.end(), [&](const SceneNumber& n) {
        return last_part(n.key) == last_part(name);
      });
  if (is_built_in) {
    throw usage_error("parameter '" + name +
                      "' can't change while the scene runs: change it in the scene file and start anew" +
                      suggestion(name, names));
  }
  throw usage_error("parameter '" + name + "' is unknown" + suggestion(name, names));
}

void SceneParameters::set(const std::string& name, double value) {
  const std::size_t k = find(name);
  const SceneParameter& p = list_[k];
  if (!p.allows(value)) {
    throw usage_error("parameter '" + name + "' is " + number_text(value) + ", expected " + p.range_text());
  }
  change(k, value);
}

void SceneParameters::change(std::size_t k, double value) {
  if (list_[k].value == value) return;
  apply_[k](value);
  list_[k].value = value;
  if (changed_ && list_[k].effect == ParameterEffect::next_frame) changed_();
}

void SceneParameters::archive(StateArchive& a) {
  a.set_owner("parameters");
  for (std::size_t k = 0; k < list_.size(); ++k) {
    double value = list_[k].value;
    a.value(list_[k].name.c_str(), value);
    a.check(list_[k].allows(value), list_[k].name.c_str());
    change(k, value);
  }
}

}  // namespace tactus
