#pragma once
/// Bytes of a file, unpacked where they are compressed. Internal to io.
#include <zlib.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace tactus {

class LabelBytes {
 public:
  /// Packing of the file's first bytes: perhaps gzip around all of the file, none, or zlib or gzip for sure.
  enum class Packing { perhaps, none, yes };
  /// @throws Error naming the path and the reason: missing, no regular file.
  explicit LabelBytes(const std::string& path, Packing packing = Packing::perhaps);
  LabelBytes(const LabelBytes&) = delete;
  LabelBytes& operator=(const LabelBytes&) = delete;
  ~LabelBytes();

  /// Reads up to `bytes`; returns how many there were. @throws Error for damaged compressed data.
  std::size_t read(void* data, std::size_t bytes);
  /// Up to the next line end, without it; false at the end of the file.
  /// @throws Error for lines of more than 1 MB together.
  bool line(std::string& text);
  /// Leaves bytes out, as far as there are any.
  void skip(std::uint64_t bytes);
  /// The bytes that follow are compressed by zlib or gzip.
  void unpack();

 private:
  bool fill();

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::vector<unsigned char> block_;
  std::size_t next_ = 0, end_ = 0;  ///< of the block
  std::size_t line_bytes_ = 0;
  bool packed_ = false, ended_ = false;
  z_stream stream_{};
};

/// The path of a file that a header names: a regular file in the header's folder or below.
/// @throws Error naming both.
std::string named_data_file(const std::string& header_path, const std::string& name);

}  // namespace tactus
