// `tactus help`, `version` and `completion`.
#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/help/help_texts.h"
#include "tactus/cli/version.h"

namespace tactus {
namespace {

/// Help of "calibrate rig", or of all.
void print_help(const CLI::App& app, const std::vector<std::string>& path) {
  const CLI::App* at = &app;
  std::string before;
  for (const std::string& name : path) {
    std::vector<std::string> known;
    const CLI::App* next = nullptr;
    for (const CLI::App* verb : at->get_subcommands([](const CLI::App*) { return true; })) {
      known.push_back(verb->get_name());
      if (verb->get_name() == name) next = verb;
    }
    if (next == nullptr) throw usage_error("unknown command '" + name + "'" + suggestion(name, known));
    before += (before.empty() ? "" : " ") + at->get_name();
    at = next;
  }
  // (CLI11 would show the verb that asks.)
  std::fputs(
      (before.empty() ? app.get_formatter()->make_help(&app, app.get_name(), CLI::AppFormatMode::Normal)
                      : at->help(before))
          .c_str(),
      stdout);
}

}  // namespace

void add_help_commands(CLI::App& app) {
  auto path = std::make_shared<std::vector<std::string>>();
  auto man = std::make_shared<bool>(false);
  CLI::App* help = app.add_subcommand("help", "Show a verb's flags and examples");
  help->add_option("verb", *path, "run, or calibrate rig; without one, all verbs");
  help->add_flag("--man", *man, "the manual page of all verbs, as troff: tactus help --man | man -l -");
  help->footer("Examples:\n  tactus help run\n  tactus help calibrate rig");
  help->callback([&app, path, man] {
    if (*man)
      std::fputs(man_page(app, version_number()).c_str(), stdout);
    else
      print_help(app, *path);
  });
  CLI::App* version = app.add_subcommand("version", "Version, commit and CUDA of this program");
  version->callback([] { std::printf("%s\n", version_text().c_str()); });
  auto shell = std::make_shared<std::string>();
  CLI::App* completion = app.add_subcommand("completion", "Print what completes verbs and flags in a shell");
  completion->add_option("shell", *shell, "bash, zsh or fish")->required();
  completion->footer(
      "Examples:\n  eval \"$(tactus completion bash)\"                        # now; 'make install' does it "
      "for good\n"
      "  tactus completion zsh > ~/.zfunc/_tactus\n"
      "  tactus completion fish > ~/.config/fish/completions/tactus.fish");
  completion->callback([&app, shell] { std::fputs(shell_completion(app, *shell).c_str(), stdout); });
}

}  // namespace tactus
