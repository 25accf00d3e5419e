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
#include "tactus/cli/exit_codes.h"
#include "tactus/cli/interrupt.h"

namespace tactus {
namespace {

int exit_code = 0;

std::vector<std::string> verbs_of(const CLI::App& app) {
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    verbs.push_back(verb->get_name());
  return verbs;
}

/// A first word that is no verb gets the nearest one.
void check_verb(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  const std::vector<std::string> verbs = verbs_of(app);
  if (std::find(verbs.begin(), verbs.end(), argv[1]) != verbs.end()) return;
  throw usage_error("unknown command '" + std::string(argv[1]) + "'" + suggestion(argv[1], verbs));
}

/// The innermost verb of the command line; `path` becomes its full name, as "tactus calibrate rig".
const CLI::App& innermost(const CLI::App& app, std::string& path) {
  const CLI::App* at = &app;
  path = app.get_name();
  while (!at->get_subcommands().empty()) {
    at = at->get_subcommands().front();
    path += " " + at->get_name();
  }
  return *at;
}

/// Refuses flags that the verb does not know, and unknown words where it has verbs of its own; the error
/// suggests the nearest known one.
void check_words(const CLI::App& app) {
  std::string path;
  const CLI::App& verb = innermost(app, path);
  const std::vector<std::string> verbs = verbs_of(verb);
  std::vector<std::string> flags;
  for (const CLI::Option* option : verb.get_options())
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
  for (const std::string& word : app.remaining(true)) {
    const bool is_flag =
        word.size() > 1 && word[0] == '-' && word != "--" && std::strchr("0123456789.", word[1]) == nullptr;
    const std::string flag = word.substr(0, word.find('='));
    if (is_flag) throw usage_error("'" + path + "' has no flag '" + flag + "'" + suggestion(flag, flags));
    if (!verbs.empty())
      throw usage_error("unknown command '" + path + " " + word + "'" + suggestion(word, verbs));
  }
}

/// Names the verb, word or flag that is missing, and says its purpose.
void check_required(const CLI::App& app) {
  std::string path;
  const CLI::App& verb = innermost(app, path);
  const std::vector<std::string> verbs = verbs_of(verb);
  if (!verbs.empty()) throw usage_error("'" + path + "' lacks a command" + suggestion("", verbs));
  for (const CLI::Option* option : verb.get_options()) {
    if (!option->get_required() || option->count() > 0) continue;
    throw usage_error("'" + path + "' lacks '" + option->get_name() + "': " + option->get_description() +
                      "; `" + path + " --help` says more");
  }
}

/// Other errors of the command line, in one form with all others.
[[noreturn]] void refuse(const CLI::App& app, const CLI::ParseError& error) {
  std::string path, text = error.what();
  innermost(app, path);
  const std::vector<std::string> more = app.remaining(true);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr && !more.empty())
    text = "'" + more.front() + "' is a word too many for '" + path + "': names with spaces stand in quotes";
  throw usage_error(text + "; `" + path + " --help` says more");
}

void add_shared_flags(CLI::App& verb) {
  CLI::Option* loud = verb.add_flag_callback(
      "--verbose", [] { set_log_level(LogLevel::debug); }, "say more on standard error: a line per frame");
  verb.add_flag_callback(
          "--quiet", [] { set_log_level(LogLevel::quiet); },
          "only results and errors: no warnings, no progress")
      ->excludes(loud);
}

/// A file that is opened later must not take the place of a standard stream that the caller closed.
void open_standard_streams() {
  for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd) {
    if (::fcntl(fd, F_GETFD) < 0) ::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

/// Printed text must have arrived: a full disk behind `> file` is a failure.
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
    return interrupted() ? kExitInterrupted : exit_code;
  } catch (const CLI::ParseError& e) {
    const bool asked = e.get_exit_code() == 0;  // --help, --version
    if (!asked) check_words(app);
    if (dynamic_cast<const CLI::RequiredError*>(&e) != nullptr) check_required(app);
    if (!asked) refuse(app, e);
    app.exit(e);
    flush_standard_output();
    return 0;
  }
}

}  // namespace

void set_exit_code(int code) { exit_code = code; }

void note_damage(const std::string& damage) {
  if (damage.empty()) return;
  log_warning(damage);
  set_exit_code(kExitDamaged);
}

CLI::Option* add_devices(CLI::App& command, std::string& devices) {
  return command.add_option("--devices", devices, "cpu, cpu:N (virtual), cuda:0, cuda:0-3, cuda:all, auto")
      ->envname("TACTUS_DEVICES")
      ->capture_default_str();
}

CLI::Option* add_output(CLI::App& command, const std::string& flags, std::string& path,
                        const std::string& help) {
  return command.add_option(flags, path, help)->each([](const std::string& value) {
    if (value == "-") reserve_standard_output();
  });
}

int run_program(int argc, char** argv, const std::string& name, const std::string& description,
                const std::function<void(CLI::App&)>& set_up) {
  open_standard_streams();
  // After a failure some colliders of files are never destroyed: a picture's belong to a thread that gave up.
  const struct Cleaner {
    ~Cleaner() { remove_temporary_files(); }
  } cleaner;
  try {
    CLI::App app(description, name);
    app.require_subcommand(1);
    set_up(app);
    for (CLI::App* verb : app.get_subcommands([](CLI::App*) { return true; })) add_shared_flags(*verb);
    install_interrupt_handler();
    return parse_and_run(app, argc, argv);
  } catch (const Error& e) {
    std::fprintf(stderr, "error: %s\n", printable(e.what()).c_str());
    return e.kind() == ErrorKind::usage ? kExitUsage : kExitFailed;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "error: %s\n", printable(e.what()).c_str());
    return kExitFailed;
  }
}

}  // namespace tactus
