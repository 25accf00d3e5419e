#include "cli/program.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <thread>
#include <utility>

namespace tactus::test {

namespace fs = std::filesystem;

std::string program() { return fs::exists(TACTUS_PROGRAM) ? TACTUS_PROGRAM : "bin/tactus"; }

Outcome run_tactus(const std::string& arguments) {
  FILE* pipe = popen((program() + " " + arguments + " 2>&1").c_str(), "r");
  std::string text;
  char buffer[4096];
  while (const std::size_t n = fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, n);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text};
}

Outcome run_and_signal(const std::vector<std::string>& arguments, const std::string& started, int signal,
                       int again, std::chrono::milliseconds after) {
  int ends[2];
  if (pipe(ends) != 0) return {-1, "no pipe"};
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGHUP, SIG_DFL);  // the tests may run under nohup
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    const std::string name = program();
    std::vector<char*> argv{const_cast<char*>(name.c_str())};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    execv(name.c_str(), argv.data());
    _exit(127);
  }
  close(ends[1]);
  fcntl(ends[0], F_SETFL, O_NONBLOCK);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  std::string text;
  char buffer[4096];
  bool sent = false;
  for (;;) {
    const ssize_t n = read(ends[0], buffer, sizeof buffer);
    if (n == 0) break;
    if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
    const bool late = std::chrono::steady_clock::now() > deadline;
    if (!sent && (text.find(started) != std::string::npos || late)) {
      kill(child, signal);
      sent = true;
    }
    if (sent && again != 0 && text.find("interrupted: ") != std::string::npos) {
      std::this_thread::sleep_for(after);
      kill(child, std::exchange(again, 0));
    }
    if (n < 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text};
}

void ProgramTest::SetUp() {
  if (!fs::exists(program())) GTEST_SKIP() << "the program is not here: " << program();
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  folder_ =
      fs::temp_directory_path() / ("tactus_" + std::string(info->name()) + "_" + std::to_string(getpid()));
  fs::create_directories(folder_);
}

void ProgramTest::TearDown() {
  if (!folder_.empty()) fs::remove_all(folder_);
}

std::string ProgramTest::write(const std::string& name, const std::string& text) const {
  std::ofstream(path(name), std::ios::binary) << text;
  return path(name);
}

nlohmann::json ProgramTest::read_json(const std::string& name) const {
  return nlohmann::json::parse(std::ifstream(path(name)));
}

std::vector<std::string> ProgramTest::files() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    if (entry.is_regular_file()) names.push_back(fs::relative(entry.path(), folder_).string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

void ProgramTest::expect_refused(const std::string& arguments, int code,
                                 const std::vector<std::string>& parts) const {
  SCOPED_TRACE(arguments);
  const std::vector<std::string> before = files();
  const Outcome o = run_tactus(arguments);
  EXPECT_EQ(o.code, code) << o.text;
  std::istringstream lines(o.text);
  std::string line, message;
  int messages = 0;
  while (std::getline(lines, line)) {
    if (line.starts_with("error: ")) {
      message = line;
      ++messages;
    } else {
      EXPECT_TRUE(line.starts_with(" frame ")) << "not one clear message: " << o.text;  // the table's head
    }
  }
  EXPECT_EQ(messages, 1) << o.text;
  for (const std::string& part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in: " << o.text;
  EXPECT_EQ(files(), before) << "something half-written stays";
}

}  // namespace tactus::test
