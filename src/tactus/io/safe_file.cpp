#include "tactus/io/safe_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "tactus/base/error.h"

namespace tactus {
namespace fs = std::filesystem;

SafeFile::SafeFile(const std::string& path) : path_(path), part_(path + ".part") {
  std::error_code ignored;
  if (fs::is_directory(path_, ignored)) fail(EISDIR);
  file_ = std::fopen(part_.c_str(), "wb");
  if (file_ == nullptr) fail(errno);
}

SafeFile::~SafeFile() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  std::remove(part_.c_str());
}

void SafeFile::fail(int error_number) const {
  throw Error("can't write '" + path_ + "': " + std::strerror(error_number));
}

void SafeFile::write(const void* data, std::size_t bytes) {
  if (bytes != 0 && std::fwrite(data, 1, bytes, file_) != bytes) fail(errno);
}

void SafeFile::commit() {
  if (std::fflush(file_) != 0) fail(errno);
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0 || std::rename(part_.c_str(), path_.c_str()) != 0) {
    const int error_number = errno;
    std::remove(part_.c_str());
    fail(error_number);
  }
}

void output_is_writable(const std::string& path) { SafeFile probe(path); }

std::string read_text_file(const std::string& path) {
  const auto fail = [&](int error_number) {
    throw Error("can't read '" + path + "': " + std::strerror(error_number));
  };
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) fail(EISDIR);
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) fail(errno);
  std::string text;
  char block[65536];
  std::size_t n = 0;
  while ((n = std::fread(block, 1, sizeof block, file)) > 0) text.append(block, n);
  const bool bad = std::ferror(file) != 0;
  std::fclose(file);
  if (bad) fail(EIO);
  return text;
}

}  // namespace tactus
