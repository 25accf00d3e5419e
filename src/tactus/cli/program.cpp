#include "tactus/cli/program.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/printable.h"
#include "tactus/base/safe_file.h"
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

/// What is opened later must not take the place of a standard stream that the caller closed.
void open_standard_streams() {
  for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd) {
    if (::fcntl(fd, F_GETFD) < 0) ::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

/// What was printed must have arrived: a full disk behind `> file` is a failure.
void flush_standard_output() {
  errno = 0;
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout) return;
  throw Error(std::string("can't write standard output: ") + std::strerror(errno == 0 ? EIO : errno));
}

int parse_and_run(CLI::App& app, int argc, char** argv) {
  try {
    check_verb(app, argc, argv);
    app.parse(argc, argv);
    flush_standard_output();
    return interrupted() ? 130 : exit_code;
  } catch (const CLI::ParseError& e) {
    const bool asked = app.exit(e) == 0;  // --help, --version
    if (asked) flush_standard_output();
    return asked ? 0 : 2;
  }
}

}  // namespace

void set_exit_code(int code) { exit_code = code; }

CLI::Option* add_output(CLI::App& command, const std::string& flags, std::string& path,
                        const std::string& help) {
  return command.add_option(flags, path, help)->each([](const std::string& value) {
    if (value == "-") reserve_standard_output();
  });
}

int run_program(int argc, char** argv, const std::string& name, const std::string& description,
                const std::function<void(CLI::App&)>& set_up) {
  open_standard_streams();
  try {
    CLI::App app(description, name);
    app.require_subcommand(1);
    set_up(app);
    for (CLI::App* verb : app.get_subcommands([](CLI::App*) { return true; })) add_shared_flags(*verb);
    install_interrupt_handler();
    return parse_and_run(app, argc, argv);
  } catch (const Error& e) {
    std::fprintf(stderr, "error: %s\n", printable(e.what()).c_str());
    return e.kind() == ErrorKind::usage ? 2 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "error: %s\n", printable(e.what()).c_str());
    return 1;
  }
}

}  // namespace tactus
