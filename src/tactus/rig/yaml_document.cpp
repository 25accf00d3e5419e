#include "tactus/rig/yaml_document.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <sstream>
#include <string_view>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/foreign_text.h"
#include "tactus/base/read_file.h"

namespace tactus {
namespace {

constexpr int kMaxValues = 100000, kMaxAliases = 1000;

std::string place(const std::string& file, const YAML::Mark& mark) {
  return file + ":" + std::to_string(mark.line + 1) + ": ";
}

/// Reads a text without building anything, and ends where a bound is passed.
class Census final : public YAML::EventHandler {
 public:
  Census(const std::string& file, std::string_view text) : file_(file), text_(text) {}
  /// yaml-cpp takes a stray ',' for an empty document, does not move on, and meets it again.
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ == 1) return;
    const auto at = std::min(text_.size(), static_cast<std::size_t>(std::max(mark.pos, 0)));
    const std::string_view rest = text_.substr(at);
    if (rest.starts_with("---"))
      throw usage_error(place(file_, mark) + "a second YAML document begins, expected one");
    throw usage_error(place(file_, mark) + "not valid YAML: '" +
                      std::string(rest.substr(0, rest.find('\n', 1)).substr(0, 20)) +
                      "' belongs to no key and no list");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { count(mark); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    if (++aliases_ > kMaxAliases)
      throw usage_error(place(file_, mark) + "more than " + std::to_string(kMaxAliases) + " aliases");
    count(mark);
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t, const std::string&) override {
    count(mark);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnMapEnd() override { --depth_; }

 private:
  void enter(const YAML::Mark& mark) {
    count(mark);
    if (++depth_ > kMaxTextDepth)
      throw usage_error(place(file_, mark) + "nested more than " + std::to_string(kMaxTextDepth) + " deep");
  }
  void count(const YAML::Mark& mark) {
    if (++values_ > kMaxValues)
      throw usage_error(place(file_, mark) + "more than " + std::to_string(kMaxValues) + " values");
  }
  const std::string& file_;
  std::string_view text_;
  int documents_ = 0, values_ = 0, aliases_ = 0, depth_ = 0;
};

}  // namespace

YAML::Node parse_yaml(const std::string& text, const std::string& file) {
  if (text.size() > kMaxYamlBytes)
    throw usage_error(file + ": " +
                      bytes_text(static_cast<double>(text.size()), static_cast<double>(kMaxYamlBytes)) +
                      " of YAML, expected at most " + bytes_text(static_cast<double>(kMaxYamlBytes)));
  try {
    check_foreign_text(text, TextSyntax::yaml, file);
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    Census census(file, text);
    while (parser.HandleNextDocument(census)) {
    }
    return YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw usage_error(place(file, e.mark) + "not valid YAML: " + e.msg);
  } catch (const Error& e) {
    throw usage_error(e.what());
  }
}

YAML::Node load_yaml(const std::string& file) { return parse_yaml(read_text(file, kMaxYamlBytes), file); }

}  // namespace tactus
