// Files that are whole or not there, whatever their name already is; one run a folder.
#include "tactus/base/safe_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "support/message_of.h"
#include "tactus/base/read_file.h"
#include "tactus/base/timing.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::message_of;

class SafeFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "tactus-base-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  std::string make(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }
  static std::string text_of(const std::string& path) { return read_file(path, 1 << 20); }
  std::ptrdiff_t file_count() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }
  std::string folder_;
};

TEST_F(SafeFileTest, UncommittedLeavesTheOldFileAlone) {
  const std::string old = make("a", "old");
  {
    SafeFile file(old);
    file.write("half");
    EXPECT_EQ(file_count(), 2);
    EXPECT_EQ(text_of(old), "old");
  }
  EXPECT_EQ(text_of(old), "old");
  EXPECT_EQ(file_count(), 1);
  write_file(old, "new");
  EXPECT_EQ(text_of(old), "new");
  EXPECT_EQ(file_count(), 1);
}

TEST_F(SafeFileTest, TemporaryNamesAreNeverTheSameAndMayBeLong) {
  const std::string name = path(std::string(255, 'a'));  // no room for ".part"
  const TemporaryFile one(name), two(name, ".mp4");
  EXPECT_NE(one.path(), two.path());
  EXPECT_TRUE(two.path().ends_with(".mp4"));
  write_file(name, "x");
  EXPECT_EQ(text_of(name), "x");
}

/// What was written beside the target had a name that anyone could lay a link under.
TEST_F(SafeFileTest, LinkUnderTheOldWorkingNameIsNotWrittenThrough) {
  const std::string victim = make("victim", "precious");
  fs::create_symlink(victim, path("o.json.part"));
  write_file(path("o.json"), "{}");
  EXPECT_EQ(text_of(victim), "precious");
  EXPECT_EQ(text_of(path("o.json")), "{}");
}

TEST_F(SafeFileTest, LinksAreFollowedAndStay) {
  fs::create_directories(path("deep"));
  make("deep/target", "old");
  fs::create_symlink("deep/target", path("link"));
  fs::create_symlink("link", path("link2"));
  write_file(path("link2"), "new");
  EXPECT_TRUE(fs::is_symlink(path("link2")));
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(text_of(path("deep/target")), "new");
  fs::create_symlink("deep/none", path("dangling"));
  write_file(path("dangling"), "made");
  EXPECT_TRUE(fs::is_symlink(path("dangling")));
  EXPECT_EQ(text_of(path("deep/none")), "made");
  fs::create_symlink("round", path("round"));
  EXPECT_EQ(message_of([&] { write_file(path("round"), ""); }),
            "can't write '" + path("round") + "': Too many levels of symbolic links");
}

TEST_F(SafeFileTest, PermissionsOfAReplacedFileStay) {
  const std::string file = make("a", "old");
  ASSERT_EQ(chmod(file.c_str(), 0640), 0);
  write_file(file, "new");
  EXPECT_EQ(fs::status(file).permissions(), static_cast<fs::perms>(0640));
}

TEST_F(SafeFileTest, FifoGetsTheBytesAndStaysAFifo) {
  ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);
  EXPECT_EQ(message_of([&] { output_is_writable(path("fifo")); }), "");  // without waiting for a reader
  std::string got;
  std::thread reader([&] { got = text_of(path("fifo")); });
  write_file(path("fifo"), "through");
  reader.join();
  EXPECT_EQ(got, "through");
  EXPECT_TRUE(fs::is_fifo(path("fifo")));
}

/// As root, a device's name became a regular file.
TEST_F(SafeFileTest, DeviceIsWrittenToAndItsErrorTold) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_EQ(message_of([] { output_is_writable("/dev/full"); }), "");
  EXPECT_EQ(message_of([] { write_file("/dev/full", "x"); }),
            "can't write '/dev/full': No space left on device");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  fs::create_symlink("/dev/full", path("link"));
  EXPECT_EQ(message_of([&] { write_file(path("link"), "x"); }),
            "can't write '" + path("link") + "': No space left on device");
  EXPECT_TRUE(fs::is_symlink(path("link")));
  write_file("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(SafeFileTest, ErrorsNamePathAndReason) {
  const std::string file = make("a", "");
  const auto refusal = [](const std::string& target) {
    std::string early = message_of([&] { output_is_writable(target); });
    EXPECT_EQ(early, message_of([&] { write_file(target, "x"); }));
    return early;
  };
  EXPECT_EQ(refusal(folder_), "can't write '" + folder_ + "': it is a folder");
  EXPECT_EQ(refusal(file + "/b"), "can't write '" + file + "/b': '" + file + "' is not a folder");
  EXPECT_EQ(refusal(path("none/b")),
            "can't write '" + path("none/b") + "': the folder '" + path("none") + "' does not exist");
  EXPECT_EQ(refusal(""), "can't write '': the path is empty");
  EXPECT_EQ(refusal(std::string("a\0b", 3)), "can't write 'a\\x00b': the path holds a zero byte");
  EXPECT_EQ(refusal(path(std::string(300, 'a'))),
            "can't write '" + path(std::string(300, 'a')) + "': File name too long");
  EXPECT_EQ(message_of([&] { output_is_writable(path("b")); }), "");
  EXPECT_EQ(file_count(), 1);
}

TEST_F(SafeFileTest, DashIsStandardOutput) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  std::fflush(stdout);  // the child would print what is still here
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
    reserve_standard_output();
    std::printf("table\n");
    write_file("-", "data");
    std::fflush(stdout);
    const bool twice = message_of([] { reserve_standard_output(); }).starts_with("'-' (standard output)");
    _exit(twice ? 0 : 1);
  }
  close(ends[1]);
  char text[32] = {};
  EXPECT_EQ(read(ends[0], text, sizeof text), 4);
  EXPECT_STREQ(text, "data");
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST_F(SafeFileTest, HandlersRemoveWhatIsUnfinished) {
  SafeFile file(path("a"));
  EXPECT_EQ(file_count(), 1);
  remove_temporary_files();
  EXPECT_EQ(file_count(), 0);
}

TEST_F(SafeFileTest, TraceOfTimesMeetsAFullDisk) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_EQ(message_of([] { Timings().write_trace("/dev/full"); }),
            "can't write '/dev/full': No space left on device");
}

TEST_F(SafeFileTest, SecondRunInAFolderIsRefusedWithTheFirstOnesProcess) {
  int ready[2], go[2];
  ASSERT_EQ(pipe(ready) + pipe(go), 0);
  const pid_t child = fork();
  if (child == 0) {
    const FolderLock lock(path("out"));
    char byte = 0;
    if (write(ready[1], &byte, 1) != 1 || read(go[0], &byte, 1) != 1) _exit(1);
    raise(SIGKILL);  // a lock outlives nobody
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(message_of([&] { const FolderLock lock(path("out")); }),
            "output folder '" + path("out") + "': another run (process " + std::to_string(child) +
                ") writes into it; wait for its end or choose another folder");
  ASSERT_EQ(write(go[1], &byte, 1), 1);
  waitpid(child, nullptr, 0);
  {
    const FolderLock lock(path("out"));
    EXPECT_EQ(text_of(path("out/.tactus.lock")), std::to_string(getpid()));
  }
  EXPECT_TRUE(fs::is_empty(path("out")));
  for (const int fd : {ready[0], ready[1], go[0], go[1]}) close(fd);
}

TEST_F(SafeFileTest, LockDoesNotWriteThroughALink) {
  const std::string victim = make("victim", "precious");
  fs::create_symlink(victim, path(FolderLock::kName));
  EXPECT_EQ(message_of([&] { const FolderLock lock(folder_); }),
            "output folder '" + folder_ + "': Too many levels of symbolic links");
  EXPECT_EQ(text_of(victim), "precious");
}

}  // namespace
}  // namespace tactus
