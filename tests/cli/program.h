#pragma once
/// Runs the built program as a script would, in a folder of its own.
#include <gtest/gtest.h>
#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tactus::test {

struct Outcome {
  int code;
  std::string text;  ///< standard output and error
};

/// The program built beside this test, or the one in a bundle.
std::string program();
/// Runs it through a shell.
Outcome run_tactus(const std::string& arguments);
/// Starts it, waits until `started` appears in what it prints (at most a minute), then sends `signal`; and,
/// when it has told of that, `again` unless 0.
/// @returns its exit code (-1: it was killed by the signal) and all that it printed.
Outcome run_and_signal(const std::vector<std::string>& arguments, const std::string& started, int signal,
                       int again = 0, std::chrono::milliseconds after = std::chrono::milliseconds(25));

/// A folder for each test; the test is skipped where the program is not.
class ProgramTest : public ::testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const;
  nlohmann::json read_json(const std::string& name) const;
  /// Names of the files below the folder, sorted.
  std::vector<std::string> files() const;
  /// Runs, expects the code, every part in the one message ("error: ..."), and no new file.
  void expect_refused(const std::string& arguments, int code, const std::vector<std::string>& parts) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace tactus::test
