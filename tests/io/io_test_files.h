#pragma once
/// Folders and files of the io tests.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "support/data_folder.h"

namespace tactus {

/// An empty folder, removed with its contents at the end.
struct TempFolder {
  TempFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tactus-io-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "no temporary folder " << name;
    path = name;
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  /// Creates a file; returns its path.
  std::string write(const std::string& name, const std::string& content) const {
    std::string file = path + "/" + name;
    std::ofstream(file, std::ios::binary) << content;
    return file;
  }
  std::string path;
};

}  // namespace tactus

// NOLINTBEGIN(bugprone-macro-parentheses): `name` is declared here
#define TACTUS_DATA_OR_SKIP(name)                   \
  const std::string name = ::tactus::data_folder(); \
  if (name.empty()) GTEST_SKIP() << without_data("meshes")
// NOLINTEND(bugprone-macro-parentheses)
