// What is refused before a parser of others sees it.
#include "tactus/base/foreign_text.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "support/message_of.h"
#include "tactus/base/read_file.h"

namespace tactus {
namespace {

using test::message_of;

std::string repeat(const std::string& text, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}
std::string refusal(const std::string& text, TextSyntax syntax) {
  return message_of([&] { check_foreign_text(text, syntax, "f"); });
}

TEST(ForeignText, DepthIsBounded) {
  const auto nested = [](int n) { return repeat("[", n) + repeat("]", n); };
  for (const TextSyntax syntax : {TextSyntax::json, TextSyntax::yaml}) {
    EXPECT_EQ(refusal(nested(64), syntax), "");
    EXPECT_EQ(refusal("\n" + nested(65), syntax), "f:2: nested more than 64 deep");
    EXPECT_EQ(refusal(nested(15000), syntax), "f:1: nested more than 64 deep");
  }
  EXPECT_EQ(refusal(repeat("<a>", 64) + repeat("</a>", 64), TextSyntax::xml), "");
  EXPECT_EQ(refusal(repeat("<a>", 65), TextSyntax::xml), "f:1: nested more than 64 deep");
  EXPECT_EQ(refusal(repeat("<a></a>", 1000), TextSyntax::xml), "");
  EXPECT_EQ(refusal(repeat("- ", 300) + "1", TextSyntax::yaml), "f:1: nested more than 64 deep");
  std::string stairs;
  for (int i = 0; i < 300; ++i) stairs += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_EQ(refusal(stairs, TextSyntax::yaml), "f:258: nested more than 64 deep");  // 4 columns a level
}

TEST(ForeignText, BracketsInTextAreNoDepth) {
  EXPECT_EQ(refusal("\"" + repeat("[", 100) + "\\\"" + repeat("{", 100) + "\"", TextSyntax::json), "");
  EXPECT_EQ(refusal(repeat("[1, 2]\n", 1000), TextSyntax::yaml), "");
  EXPECT_EQ(refusal(repeat("]", 100) + repeat("[", 65), TextSyntax::json), "f:1: nested more than 64 deep");
}

TEST(ForeignText, ZeroBytesAreRefused) {
  EXPECT_EQ(refusal(std::string("a\nb\0c", 5), TextSyntax::yaml), "f:2: a zero byte, expected text");
}

class ReadFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "tactus-base-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  std::string folder_;
};

TEST_F(ReadFile, SizeIsBoundedBeforeMemoryIsTaken) {
  std::ofstream(path("a")) << "12345";
  EXPECT_EQ(read_file(path("a"), 5), "12345");
  EXPECT_EQ(message_of([&] { read_file(path("a"), 4); }),
            "can't read '" + path("a") + "': it has 5 B, expected at most 4 B");
  // 8 TB that take no room on the disk: taking them in would end the program.
  std::ofstream(path("hole")) << "";
  ASSERT_EQ(truncate(path("hole").c_str(), 1LL << 43), 0);
  EXPECT_EQ(message_of([&] { read_file(path("hole"), kMaxMeshBytes); }),
            "can't read '" + path("hole") + "': it has 8.8 TB, expected at most 4.3 GB");
  EXPECT_EQ(message_of([&] { read_file("/dev/zero", 1 << 20); }),
            "can't read '/dev/zero': it does not end, expected at most 1.0 MB");
}

TEST_F(ReadFile, WhatIsNoFileIsNamed) {
  EXPECT_EQ(message_of([&] { read_file(path("none"), 1); }),
            "can't read '" + path("none") + "': No such file or directory");
  EXPECT_EQ(message_of([&] { read_file(folder_, 1); }), "can't read '" + folder_ + "': Is a directory");
  EXPECT_EQ(message_of([&] { read_file(std::string("a\0b", 3), 1); }),
            "can't read 'a\\x00b': the path holds a zero byte");
}

TEST_F(ReadFile, FifoThatAnotherFileNamesDoesNotBlock) {
  ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);
  EXPECT_EQ(message_of([&] { read_file(path("fifo"), 1, ReadFrom::regular_file); }),
            "can't read '" + path("fifo") + "': not a regular file");
  EXPECT_EQ(message_of([&] { read_file("/dev/zero", 1, ReadFrom::regular_file); }),
            "can't read '/dev/zero': not a regular file");
}

}  // namespace
}  // namespace tactus
