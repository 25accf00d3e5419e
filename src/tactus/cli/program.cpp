#include "tactus/cli/program.h"

#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/cli/interrupt.h"

namespace tactus {
namespace {

int exit_code = 0;

/// A first word that is no verb gets the nearest one.
void check_verb(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    verbs.push_back(verb->get_name());
  if (std::find(verbs.begin(), verbs.end(), argv[1]) != verbs.end()) return;
  throw usage_error("unknown command '" + std::string(argv[1]) + "'" + suggestion(argv[1], verbs));
}

void add_shared_flags(CLI::App& verb) {
  CLI::Option* loud = verb.add_flag_callback(
      "--verbose", [] { set_log_level(LogLevel::debug); }, "tell more on standard error: a line per frame");
  verb.add_flag_callback(
          "--quiet", [] { set_log_level(LogLevel::quiet); },
          "only results and errors: no warnings, no progress")
      ->excludes(loud);
}

int parse_and_run(CLI::App& app, int argc, char** argv) {
  try {
    check_verb(app, argc, argv);
    app.parse(argc, argv);
    return interrupted() ? 130 : exit_code;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
}

}  // namespace

void set_exit_code(int code) { exit_code = code; }

int run_program(int argc, char** argv, const std::string& name, const std::string& description,
                const std::function<void(CLI::App&)>& set_up) {
  try {
    CLI::App app(description, name);
    app.require_subcommand(1);
    set_up(app);
    for (CLI::App* verb : app.get_subcommands([](CLI::App*) { return true; })) add_shared_flags(*verb);
    install_interrupt_handler();
    return parse_and_run(app, argc, argv);
  } catch (const Error& e) {
    std::fprintf(stderr, "error: %s\n", e.what());
    return e.kind() == ErrorKind::usage ? 2 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "error: %s\n", e.what());
    return 1;
  }
}

}  // namespace tactus
