#include "tactus/cli/help/verb_words.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "tactus/cli/bench/bench_flags.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/rig/sources/source_kinds.h"

namespace tactus {
namespace {

std::vector<std::string> figures() {
  const auto names = figure_names();
  return {names.begin(), names.end()};
}

std::vector<std::string> filming_kinds() {
  std::vector<std::string> kinds;
  for (const auto& [word, kind] : kSourceKinds)
    if (kind != SourceKind::none) kinds.emplace_back(word);
  return kinds;
}

std::vector<std::string> verbs_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(verb->get_name());
  return names;
}

/// "{file,none}" of a check that its value is one of these.
std::vector<std::string> checked_words(const std::string& type) {
  const auto begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

/// Where the help alone says which words there are.
std::vector<std::string> known_words(const std::string& verb, const std::string& name,
                                     const CLI::App& program) {
  if (name == "--devices") return {"auto", "cpu", "cpu:2", "cuda:0", "cuda:all"};
  if (name == "--source" && verb == "doctor") return {"masks", "videos", "middlebury"};
  if (name == "--source" && verb != "run") return filming_kinds();
  if (name == "what" || name == "figure") return figures();
  if (verb == "bench" && name == "name") return benchmark_words();
  if (verb == "paper" && name == "which")
    return {"fig14", "fig15", "fig16", "fig17", "fig18", "fig19", "fig20"};
  if (verb == "completion") return {"bash", "zsh", "fish"};
  if (verb == "help") return verbs_of(program);
  return {};
}

FlagWords words_of(const CLI::Option& option, const CLI::App& verb, const CLI::App& program) {
  FlagWords flag;
  flag.name = option.get_lnames().empty() ? option.get_name(true) : "--" + option.get_lnames().front();
  flag.help = option.get_description();
  if (option.get_items_expected_max() == 0) return flag;
  const std::string type = option.get_type_name();
  flag.words = checked_words(type);
  if (flag.words.empty()) flag.words = known_words(verb.get_name(), flag.name, program);
  const bool is_number = type.starts_with("INT") || type.starts_with("UINT") || type.starts_with("FLOAT");
  flag.value = !flag.words.empty() ? ValueKind::words : is_number ? ValueKind::number : ValueKind::file;
  if (!option.get_default_str().empty()) flag.help += " (default: " + option.get_default_str() + ")";
  return flag;
}

VerbWords words_below(const CLI::App& app, const std::string& path, const CLI::App& program) {
  VerbWords words{path, app.get_name(), app.get_description(), app.get_footer(), {}, {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    FlagWords flag = words_of(*option, app, program);
    (option->get_positional() ? words.arguments : words.flags).push_back(std::move(flag));
  }
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    const std::string below = path.empty() ? verb->get_name() : path + " " + verb->get_name();
    words.verbs.push_back(words_below(*verb, below, program));
  }
  return words;
}

}  // namespace

VerbWords words_of(const CLI::App& app) { return words_below(app, "", app); }

std::string one_line(const std::string& text) {
  std::string line = text.substr(0, text.find('\n'));
  std::replace(line.begin(), line.end(), '\t', ' ');
  return line;
}

}  // namespace tactus
