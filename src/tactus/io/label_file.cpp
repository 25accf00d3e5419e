#include "tactus/io/label_file.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr std::size_t kHeaderBytes = 256;  // headers are padded to a multiple of this
constexpr std::size_t kMaxHeaderBytes = 64 * kHeaderBytes;
constexpr std::int64_t kMaxVoxels = (std::int64_t{1} << 31) - 1;

struct CloseGz {
  void operator()(gzFile_s* file) const { gzclose(file); }
};

/// Bytes of a file, unpacked when it is compressed.
class InrFile {
 public:
  explicit InrFile(const std::string& path) : path_(path) {
    std::error_code ignored;
    const bool folder = std::filesystem::is_directory(path, ignored);
    if (!folder) file_.reset(gzopen(path.c_str(), "rb"));
    if (!file_) throw Error("can't read '" + path + "': " + std::strerror(folder ? EISDIR : errno));
    gzbuffer(file_.get(), 1U << 17);
  }
  /// Reads up to `bytes`; returns how many there were.
  std::size_t read(void* data, std::size_t bytes) {
    std::size_t done = 0;
    while (done < bytes) {
      const unsigned block = static_cast<unsigned>(std::min<std::size_t>(bytes - done, 1U << 26));
      const int n = gzread(file_.get(), static_cast<char*>(data) + done, block);
      int status = Z_OK;
      const char* reason = gzerror(file_.get(), &status);
      // Z_BUF_ERROR: the compressed stream ends early; the caller counts what is missing.
      if (n < 0 && status != Z_BUF_ERROR) throw Error(path_ + ": damaged compressed data (" + reason + ")");
      if (n <= 0) break;
      done += static_cast<std::size_t>(n);
    }
    return done;
  }

 private:
  std::string path_;
  std::unique_ptr<gzFile_s, CloseGz> file_;
};

std::map<std::string, std::string> read_header(InrFile& file, const std::string& path) {
  std::string header;
  while (header.find("##}") == std::string::npos) {
    char block[kHeaderBytes];
    const bool full = file.read(block, sizeof block) == sizeof block;
    header.append(block, full ? sizeof block : 0);
    if (!header.starts_with("#INRIMAGE-4#{"))
      throw Error(path + ": not an INRIMAGE-4 volume, expected '#INRIMAGE-4#{' at its start");
    if (!full || header.size() > kMaxHeaderBytes) throw Error(path + ": the header has no end ('##}')");
  }
  std::map<std::string, std::string> fields;
  std::size_t begin = header.find('\n');
  while (begin != std::string::npos) {
    const std::size_t end = header.find('\n', begin + 1);
    const std::string line = header.substr(begin + 1, end == std::string::npos ? end : end - begin - 1);
    if (const std::size_t equals = line.find('='); equals != std::string::npos)
      fields[line.substr(0, equals)] = line.substr(equals + 1);
    begin = end;
  }
  return fields;
}

/// Number of a header field in (0, max].
template <class T>
T header_number(const std::map<std::string, std::string>& fields, const std::string& key, T max,
                const std::string& path) {
  const auto found = fields.find(key);
  if (found == fields.end()) throw Error(path + ": the header lacks " + key);
  const std::string& s = found->second;
  T value{};
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (error != std::errc{} || end != s.data() + s.size() || !(value > 0) || value > max)
    throw Error(path + ": header field " + key + "=" + s + ", expected a number above 0");
  return value;
}

void expect_field(const std::map<std::string, std::string>& fields, const std::string& key,
                  const std::string& expected, const std::string& path) {
  const auto found = fields.find(key);
  if (found == fields.end() || found->second != expected) {
    throw Error(path + ": header field " + key + "=" + (found == fields.end() ? "" : found->second) +
                ", expected " + expected + " (labels are one unsigned byte a voxel)");
  }
}

}  // namespace

LabelVolume read_label_volume(const std::string& path) {
  InrFile file(path);
  const std::map<std::string, std::string> fields = read_header(file, path);
  expect_field(fields, "VDIM", "1", path);
  expect_field(fields, "TYPE", "unsigned fixed", path);
  expect_field(fields, "PIXSIZE", "8 bits", path);

  LabelVolume volume;
  const char* const dims[] = {"XDIM", "YDIM", "ZDIM"};
  const char* const sizes[] = {"VX", "VY", "VZ"};
  std::int64_t voxels = 1;
  for (int i = 0; i < 3; ++i) {
    volume.dims[i] = header_number<Index>(fields, dims[i], 1 << 20, path);
    volume.voxel_size_m[i] = static_cast<float>(1e-3 * header_number<double>(fields, sizes[i], 1e6, path));
    voxels *= volume.dims[i];
    if (voxels > kMaxVoxels) {
      throw Error(path + ": " + fields.at("XDIM") + " x " + fields.at("YDIM") + " x " + fields.at("ZDIM") +
                  " voxels are too many, expected fewer than 2^31");
    }
  }
  // Memory is taken as bytes come: a header may promise what no file holds.
  for (std::size_t done = 0; done < static_cast<std::size_t>(voxels);) {
    constexpr std::size_t kBlock = std::size_t{1} << 24;
    const std::size_t block = std::min(kBlock, static_cast<std::size_t>(voxels) - done);
    volume.labels.resize(done + block);
    const std::size_t n = file.read(volume.labels.data() + done, block);
    done += n;
    if (n != block)
      throw Error(path + ": truncated, it holds " + std::to_string(done) + " of " + std::to_string(voxels) +
                  " voxels");
  }
  return volume;
}

}  // namespace tactus
